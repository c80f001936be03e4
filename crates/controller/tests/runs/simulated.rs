//! The controller on the simulated rig.

use skinrig_controller::{ControlHandle, ControllerSettings, Run};
use skinrig_model::*;
use skinrig_protocol::plan::{Plan, Step};
use skinrig_sim::config::SimConfig;
use skinrig_sim::rig::simulated_rig;

use crate::mock::{MS, Sink, header, plan};

/// The mock's plan at a pace that a robot with inertia can follow.
pub(crate) fn paced_plan() -> Plan {
    let mut plan = plan();
    for step in &mut plan.steps {
        if let Step::Press(p) = step {
            p.start_after_begin = Some(HostDuration::from_millis(
                500 + 2000 * i64::from(p.press.index()),
            ));
            p.deadline = HostDuration::from_millis(1900);
        }
    }
    plan
}

fn sim_header(plan: &Plan, config: &SimConfig) -> RunHeader {
    RunHeader {
        robot_from_skin: config.robot_from_skin,
        ..header(plan)
    }
}

#[test]
fn presses_on_the_simulated_rig_are_valid_and_reproducible() {
    let config = SimConfig::new(11, SimLevel::Kinematic);
    let plan = paced_plan();
    let run = || {
        let mut sink = Sink::default();
        let report = Run::new(
            &plan,
            sim_header(&plan, &config),
            simulated_rig(&config),
            &ControlHandle::new(),
            &mut sink,
        )
        .execute();
        assert_eq!(report.end, RunEnd::Completed, "{report:?}");
        assert_eq!(report.problems, Vec::new());
        assert!(report.retracted && report.disarmed);
        sink.records
    };
    let records = run();
    let mut outcomes = 0;
    let (mut sent, mut result) = (Vec::new(), Vec::new());
    let mut edges = [Vec::new(), Vec::new()];
    let mut intents = Vec::new();
    for r in &records {
        match r {
            Record::Outcome(o) => {
                outcomes += 1;
                assert_eq!(o.verdict, PressVerdict::Valid, "{o:?}");
                let planned = plan.presses[o.attempt.press.index() as usize];
                let off = o.measured_at.map(|at| at.distance_mm(planned.at));
                assert!(
                    off.is_some_and(|d| d > 0.0 && d < 0.03),
                    "measured, {off:?}"
                );
                assert!(o.peak_force_n.is_some_and(|f| f > 0.5));
            }
            Record::MarkSent(s) => sent.push(s.mark),
            Record::BoxReports { reports, .. } => {
                result.extend(reports.iter().filter_map(|r| match r {
                    BoxReport::Mark { mark, .. } => Some(*mark),
                    _ => None,
                }));
            }
            Record::Chunk(c) => edges[c.camera.index()].extend_from_slice(&c.triggers),
            Record::Intent { t, .. } => intents.push(t.0),
            _ => {}
        }
    }
    assert_eq!(outcomes, 3);
    assert_eq!(
        [intents[1] - intents[0], intents[2] - intents[1]],
        [2000 * MS; 2]
    );
    // The box reported every mark, and both cameras received it.
    assert_eq!(sent.len(), 9);
    assert_eq!(result, sent);
    for edges in edges {
        let observed = pulse::decode_marks(&edges);
        assert_eq!(observed.stray_edges, 0);
        assert_eq!(
            observed.marks.iter().map(|m| m.mark).collect::<Vec<_>>(),
            sent
        );
    }
    assert!(records == run(), "the same seed gives the same records");
}

#[test]
fn no_tick_of_1_to_10_ms_breaks_a_press() {
    let config = SimConfig::new(3, SimLevel::Kinematic);
    let plan = paced_plan();
    for ms in [1, 2, 7, 10] {
        let mut sink = Sink::default();
        let settings = ControllerSettings {
            tick: HostDuration::from_millis(ms),
            ..ControllerSettings::default()
        };
        let rig = simulated_rig(&config);
        let header = sim_header(&plan, &config);
        let control = ControlHandle::new();
        let report = Run::new(&plan, header, rig, &control, &mut sink)
            .with_settings(settings)
            .execute();
        assert_eq!(
            (report.valid, &report.end),
            (3, &RunEnd::Completed),
            "{report:?}"
        );
    }
}
