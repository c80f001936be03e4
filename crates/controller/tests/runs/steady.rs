//! Encoder noise: readings of a healthy robot reject no motion, and a robot off its position is identified as the fault.

use skinrig_controller::{PressFault, Run, RunFault, RunReport};
use skinrig_model::*;
use skinrig_protocol::plan::{Plan, Step};

use crate::mock::*;

/// Discards all records.
struct DiscardSink;

impl skinrig_controller::RecordSink for DiscardSink {
    fn accept(&mut self, _record: Record) -> Result<(), SinkFault> {
        Ok(())
    }
}

/// This many short presses, alternating between two locations.
fn presses(n: usize) -> Plan {
    let mut plan = plan();
    let steps = std::mem::take(&mut plan.steps);
    let listed = std::mem::take(&mut plan.presses);
    let block: Vec<Step> = steps
        .into_iter()
        .filter(|s| !matches!(s, Step::Pause { .. } | Step::Begin { .. }))
        .collect();
    plan.steps.push(Step::Begin {
        repetition: Some(RepetitionId::from_index(0)),
    });
    for i in 0..n {
        let from = 2 * (i % 2) * 2;
        let mut pair: Vec<Step> = block[from..from + 2].to_vec();
        let mut planned = listed[2 * (i % 2)];
        planned.id = PressId::from_index(i as u32);
        if let Some(Step::Press(p)) = pair.last_mut() {
            (p.press, p.start_after_begin) = (planned.id, None);
            p.hold = HostDuration::from_millis(5);
            p.marks.clear();
        }
        plan.presses.push(planned);
        plan.steps.extend(pair);
    }
    plan
}

fn run(plan: &Plan, encoders: (u64, i64, f64)) -> (RunReport, Vec<String>) {
    let faults = Faults {
        encoders: Some(encoders),
        train_ms: 10,
        ..Faults::default()
    };
    let world = World::shared(faults, [0.0, 0.0, 10.0]);
    let control = lock(&world).control.clone();
    let report = Run::new(plan, header(plan), rig(&world), &control, &mut DiscardSink).execute();
    let violations = lock(&world).violations.clone();
    (report, violations)
}

/// Readings within one count of a tip that rests up to two of five counts off, and in free air a jolt of six counts in one
/// reading of 200: every settled motion leads to a press. 10,000 presses.
#[test]
fn noisy_encoders_reject_no_motion() {
    let presses_each = 500;
    let plan = presses(presses_each);
    let mut pressed = 0;
    for seed in 1..=20_u64 {
        let aside_mm = 0.01 * (seed % 3) as f64;
        let (report, violations) = run(&plan, (seed, 1, aside_mm));
        assert_eq!(report.end.faults(), [], "seed {seed}");
        assert_eq!(
            (report.end, report.valid),
            (RunEnd::Completed, presses_each),
            "seed {seed}: {:?}",
            report.press_faults.first()
        );
        assert_eq!(violations, Vec::<String>::new());
        pressed += report.valid;
    }
    assert_eq!(pressed, 10_000);
}

/// Beyond the settling tolerance the run ends with the robot as the cause, not a rejected motion.
#[test]
fn a_tip_that_rests_off_target_is_a_fault_of_the_robot() {
    let plan = presses(4);
    for aside_mm in [0.06, 0.2] {
        let (report, _) = run(&plan, (7, 0, aside_mm));
        assert!(
            matches!(report.end.faults().first(), Some(RunFault::NotArrived(_))),
            "{:?}",
            report.end
        );
        assert!(report.retracted && report.disarmed);
    }
}

/// Noise beyond the tolerance never settles: also a fault of the robot.
#[test]
fn noise_beyond_the_tolerance_is_a_fault_of_the_robot() {
    let (report, violations) = run(&presses(4), (3, 12, 0.0));
    let refused = |e: &RunFault| matches!(e, RunFault::Guard(_));
    assert!(
        !report.end.faults().is_empty() && !report.end.faults().iter().any(refused),
        "{:?}",
        report.end
    );
    assert_eq!(violations, Vec::<String>::new());
    assert!(
        report
            .press_faults
            .iter()
            .all(|(_, f)| !matches!(f, PressFault::Paused))
    );
}
