//! Faults of the simulated rig at every stage of a press, and how the real controller ends the run.

use skinrig_controller::{ControlHandle, Run, RunReport};
use skinrig_model::*;
use skinrig_protocol::plan::Plan;
use skinrig_sim::config::SimConfig;
use skinrig_sim::faults::{Fault, FaultSizes, FaultTrigger, LineNoise};
use skinrig_sim::rig::simulated_rig;

use crate::mock::{MS, Sink, header};
use crate::simulated::paced_plan;

/// Report and records of a run.
struct RunResult {
    report: RunReport,
    records: Vec<Record>,
}

fn run(plan: &Plan, config: &SimConfig) -> RunResult {
    let mut sink = Sink::default();
    let header = RunHeader {
        robot_from_skin: config.robot_from_skin,
        ..header(plan)
    };
    let rig = simulated_rig(config);
    let report = Run::new(plan, header, rig, &ControlHandle::new(), &mut sink).execute();
    RunResult {
        report,
        records: sink.records,
    }
}

impl RunResult {
    fn end(&self) -> String {
        let reason = self.report.end.reason();
        reason.unwrap_or_else(|| "completed".to_owned())
    }

    fn last_height_mm(&self) -> f64 {
        let blocks = self.records.iter().rev().filter_map(|r| match r {
            Record::Poses(block) => block.last(),
            _ => None,
        });
        blocks.map(|p| p.measured.z_mm).next().unwrap_or(f64::NAN)
    }

    /// Every planned press ends once, consistent with the counts of the report.
    fn check_presses(&self, case: &str) {
        let r = &self.report;
        assert_eq!(r.planned, r.valid + r.invalid + r.missed, "{case}: {r:?}");
        for press in 0..r.planned as u32 {
            let ends = self.records.iter().filter(|record| match record {
                Record::Outcome(o) => o.attempt.press.index() == press,
                Record::Missed(a, MissedReason::RunEnded(_)) => a.press.index() == press,
                _ => false,
            });
            assert_eq!(ends.count(), 1, "{case}: press {press} ends once");
        }
    }

    /// Off the skin and without power, according to the poses.
    fn check_safe(&self, case: &str) {
        let r = &self.report;
        assert!(r.disarmed && r.retracted, "{case}: {r:?}");
        assert!(
            self.last_height_mm() > 4.9,
            "{case}: the tip ended at z = {} mm",
            self.last_height_mm()
        );
    }
}

#[test]
fn too_much_force_ends_at_clearance_height() {
    for level in [SimLevel::Kinematic, SimLevel::Geometric] {
        // From a touch to just below the force of a press of 2 mm (1.2 N at rest, more in motion).
        for limit_n in [0.1, 0.3, 0.5, 0.8, 1.0, 1.1, 1.2] {
            for seed in [1, 2, 3] {
                let mut plan = paced_plan();
                plan.limits.max_force_n = limit_n;
                let result = run(&plan, &SimConfig::new(seed, level));
                let case = format!("{level:?}, {limit_n} N, seed {seed}");
                let expected = format!("force: expected at most {limit_n} N, found ");
                assert!(
                    result.end().starts_with(&expected),
                    "{case}: {}",
                    result.end()
                );
                result.check_presses(&case);
                result.check_safe(&case);
                assert_eq!(result.report.problems, Vec::new(), "{case}");
            }
        }
    }
}

/// Named times in a good run: within the travel, and within each phase of two presses.
fn instants(plan: &Plan, seed: u64) -> Vec<(String, FaultTrigger)> {
    let good = run(plan, &SimConfig::new(seed, SimLevel::Kinematic));
    assert_eq!(good.report.end, RunEnd::Completed, "{:?}", good.report);
    let mut all = vec![
        ("before arming".to_owned(), FaultTrigger::At(HostTime(0))),
        ("travel".to_owned(), FaultTrigger::At(HostTime(200 * MS))),
    ];
    for record in &good.records {
        let Record::Outcome(o) = record else { continue };
        let Some(t) = o.timing.filter(|_| o.attempt.press.index() < 2) else {
            continue;
        };
        let middle = |a: HostTime, b: HostTime| FaultTrigger::At(HostTime(i64::midpoint(a.0, b.0)));
        for (phase, when) in [
            ("approach", middle(t.approach, t.contact)),
            ("contact", FaultTrigger::Contact(o.attempt.press.index())),
            ("indentation", middle(t.contact, t.at_depth)),
            ("hold", middle(t.at_depth, t.retract)),
            ("retraction", middle(t.retract, t.release)),
            ("rise", middle(t.release, t.clear)),
        ] {
            all.push((format!("{phase} of {}", o.attempt), when));
        }
    }
    assert_eq!(all.len(), 14, "{all:?}");
    all
}

#[test]
fn every_fault_at_every_stage_ends_safely() {
    let seed = 5;
    let mut plan = paced_plan();
    plan.presses[0].role = PressRole::Sync;
    let (one, two) = (CameraId::One, CameraId::Two);
    let timed = |fault, when| Fault::new(fault, when).unwrap();
    let start = FaultTrigger::At(HostTime::ZERO);
    let mut cases = vec![
        (
            "ignored limit".to_owned(),
            timed(RigFault::RobotSettingIgnored, start),
        ),
        (
            "ignored bias".to_owned(),
            timed(RigFault::CameraSettingIgnored(two), start),
        ),
    ];
    for press in 0..2 {
        let (camera, contact, train) = (one, press, 3 * press);
        let dead = Fault::DeadPress { camera, contact };
        cases.push((format!("no events in press {press}"), dead));
        let pulse = 1;
        let lost = Fault::PulseLost {
            camera,
            train,
            pulse,
        };
        cases.push((format!("pulse lost in press {press}"), lost));
    }
    for camera in [one, two] {
        let noisy = timed(RigFault::LineNoisy(camera), start);
        cases.push((format!("noisy trigger line of {camera:?}"), noisy));
    }
    for (stage, when) in instants(&plan, seed) {
        for fault in [
            RigFault::RobotLost,
            RigFault::RobotSlow,
            RigFault::CameraUnplugged(one),
            RigFault::CameraUnplugged(two),
            RigFault::CameraDrops(two),
            RigFault::BoxSilent,
        ] {
            cases.push((format!("{fault}, {stage}"), timed(fault, when)));
        }
    }
    let mut runs = Vec::new();
    for (case, fault) in cases {
        if fault.kind() == Some(RigFault::RobotSlow) {
            runs.push((format!("{case}, 30 %"), fault, 30));
        }
        runs.push((case, fault, 5));
    }
    for (case, fault, slow_percent) in runs {
        let mut config = SimConfig::new(seed, SimLevel::Kinematic);
        config.faults = vec![fault];
        config.fault_sizes = FaultSizes {
            lost_words: 7,
            slow_percent,
            line_noise: LineNoise {
                lost_percent: 20,
                doubled_percent: 5,
                spurious_percent: 5,
            },
            ..FaultSizes::default()
        };
        let result = run(&plan, &config);
        result.check_presses(&case);
        let r = &result.report;
        let end = result.end();
        let robot_gone = fault.kind() == Some(RigFault::RobotLost);
        match fault.kind() {
            Some(RigFault::RobotSettingIgnored | RigFault::CameraSettingIgnored(_)) => {
                assert!(end.contains("after writing"), "{case}: {end}");
                assert!(r.disarmed && r.missed == r.planned, "{case}: {r:?}");
            }
            Some(RigFault::RobotLost | RigFault::CameraUnplugged(_) | RigFault::BoxSilent) => {
                assert!(matches!(r.end, RunEnd::Faulted(_)), "{case}: {r:?}");
                assert!(end.contains("sim-00000005-"), "{case}, device: {end}");
            }
            Some(RigFault::RobotSlow) => {
                // Late, but in position: a press is invalid, or a travel ends the run.
                assert!(r.valid < r.planned || r.end == RunEnd::Completed, "{case}");
            }
            // A lost pulse or a press without events.
            None | Some(RigFault::CameraDrops(_) | RigFault::LineNoisy(_)) => {
                assert_eq!(r.end, RunEnd::Completed, "{case}: {r:?}");
            }
            // docs/reference/runs.md lists whole runs with each of them, with session and analysis.
            Some(other) => panic!("{case}: expected a fault handled above, found {other:?}"),
        }
        if let RunEnd::Faulted(_) = r.end {
            assert!(
                end.contains("expected") && end.contains("found"),
                "{case}: {end}"
            );
        }
        if robot_gone {
            assert!(!r.disarmed, "{case}: {r:?}");
            assert!(end.contains("switch it off by hand"), "{case}: {end}");
        } else if r.missed < r.planned {
            result.check_safe(&case);
        } else {
            assert!(r.disarmed && r.retracted, "{case}: {r:?}");
        }
    }
}
