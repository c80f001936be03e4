//! Properties of the remaining plan when some of its presses are done.

use proptest::prelude::*;
use skinrig_model::{
    CameraId, Causes, ExcludedReason, HostDuration, InvalidReason, MissedReason, PressFault,
    PressHistory, PressId, PressRole, PressVerdict, RunEnd, StopReason, TimingFault,
};
use skinrig_protocol::{Plan, PressStep, Protocol, Retakes, Route, Step, check};

use crate::common::{parse, shipped};

fn presses(plan: &Plan) -> Vec<&PressStep> {
    let steps = plan.steps.iter();
    steps
        .filter_map(|s| match s {
            Step::Press(p) => Some(p),
            _ => None,
        })
        .collect()
}

/// Presses of each block, in order.
fn blocks(plan: &Plan) -> Vec<Vec<&PressStep>> {
    let mut blocks = Vec::new();
    for step in &plan.steps {
        match step {
            Step::Begin { .. } => blocks.push(Vec::new()),
            Step::Press(p) => blocks.last_mut().unwrap().push(p),
            _ => {}
        }
    }
    blocks
}

fn shipped_protocol(name: &str) -> Protocol {
    parse(&shipped(&format!("{name}.yaml")), &[]).unwrap()
}

#[test]
fn the_remaining_plan_of_all_presses_is_the_plan() {
    for name in [
        "demo",
        "paper-meander",
        "circles",
        "depth-sweep",
        "quick-check",
    ] {
        let plan = shipped_protocol(name).compile();
        for route in [Route::Straight, Route::AsPlanned] {
            assert_eq!(plan.remaining(|_| true, route), plan, "{name}");
        }
        assert_eq!(plan.remaining(|_| false, Route::AsPlanned).steps, []);
    }
}

#[test]
fn missing_presses_follow_the_sync_presses() {
    let plan = shipped_protocol("quick-check").compile();
    let sync = plan.presses.iter().filter(|p| p.role == PressRole::Sync);
    let sync = sync.count();
    assert!(sync > 0);
    let done = PressHistory {
        attempts: 1,
        spent: 0,
        verdict: Some(PressVerdict::Valid),
        ..PressHistory::default()
    };
    let mut histories = vec![done; plan.presses.len()];
    let none = plan.pending(&histories);
    assert!(none.iter().all(|w| !w), "no press is left");
    // A sync press alone does not restart the run.
    histories[0].verdict = None;
    assert_eq!(plan.pending(&histories), none);
    histories[sync].verdict = Some(PressVerdict::cut_off(1));
    let mut expected = vec![false; plan.presses.len()];
    expected[..=sync].fill(true);
    assert_eq!(plan.pending(&histories), expected);
}

#[test]
fn a_press_is_final_if_valid_or_without_attempts_left() {
    let wants = |spent, verdict| {
        let retakes = Retakes {
            per_press: 2,
            per_session: 0,
        };
        retakes.should_retake(&PressHistory {
            attempts: 9,
            spent,
            verdict,
            ..PressHistory::default()
        })
    };
    let invalid = |fault| {
        Some(PressVerdict::Invalid(InvalidReason::Faults(Causes::one(
            fault,
        ))))
    };
    let stopped = RunEnd::Stopped(StopReason::Stop);
    let moved = || PressFault::Timing(TimingFault::NoHold);
    assert!(wants(0, None));
    assert!(wants(7, None));
    assert!(wants(
        7,
        Some(PressVerdict::Missed(MissedReason::RunEnded(
            stopped.clone()
        )))
    ));
    assert!(wants(7, invalid(PressFault::RunEnded(stopped))));
    assert!(wants(2, invalid(moved())));
    assert!(!wants(3, invalid(moved())));
    assert!(!wants(1, Some(PressVerdict::Valid)));
    assert!(!wants(
        1,
        Some(PressVerdict::Excluded(ExcludedReason::NotUsed {
            presses_used: "[1]".to_owned()
        }))
    ));
}

/// After a completed plan only presses lost to the rig or the operator are open.
#[test]
fn after_a_completed_plan_only_lost_presses_are_retaken() {
    let wants = |given_back, spent, verdict: PressVerdict| {
        Retakes::default().should_retake(&PressHistory {
            attempts: 3,
            spent,
            verdict: Some(verdict),
            given_back,
            plan_done: true,
        })
    };
    let invalid = |fault| PressVerdict::Invalid(InvalidReason::Faults(Causes::one(fault)));
    let lost = || {
        invalid(PressFault::NoData {
            camera: CameraId::One,
        })
    };
    assert!(wants(true, 0, lost()));
    assert!(wants(true, 2, lost()));
    assert!(!wants(true, 3, lost()));
    assert!(!wants(
        false,
        1,
        invalid(PressFault::Timing(TimingFault::NoHold))
    ));
    assert!(!wants(false, 0, PressVerdict::Valid));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_rest_of_a_plan_is_a_safe_plan_without_gaps(seed in any::<u64>(), name in 0..4_usize, eighths in 0..=8_u64) {
        let name = ["demo", "circles", "depth-sweep", "quick-check"][name];
        let protocol = shipped_protocol(name);
        let plan = protocol.compile();
        let pending = |id: PressId| {
            let mixed = (seed ^ u64::from(id.index())).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            (mixed >> 32) % 8 < eighths
        };
        for route in [Route::Straight, Route::AsPlanned] {
            let rest = plan.remaining(pending, route);
            let found = check(&rest, &protocol.surroundings, Some(protocol.motion.home));
            prop_assert_eq!(found, vec![]);
            let expected: Vec<PressId> =
                presses(&plan).iter().map(|p| p.press).filter(|id| pending(*id)).collect();
            let found: Vec<PressId> = presses(&rest).iter().map(|p| p.press).collect();
            prop_assert_eq!(found, expected);
            prop_assert_eq!(&rest.presses, &plan.presses);
            for block in blocks(&rest) {
                prop_assert!(!block.is_empty());
                let start = |p: &PressStep| p.start_after_begin.unwrap_or_default();
                let planned = |p: &PressStep| {
                    let all = presses(&plan);
                    let at = all.iter().position(|q| q.press == p.press).unwrap();
                    // Time in the plan between this press and the next one, whether wanted or not.
                    all.get(at + 1).map(|next| HostDuration(start(next).0 - start(all[at]).0))
                };
                if plan.presses[block[0].press.index() as usize].role != PressRole::Sync {
                    prop_assert_eq!(start(block[0]), HostDuration::ZERO);
                }
                for pair in block.windows(2) {
                    let gap = HostDuration(start(pair[1]).0 - start(pair[0]).0);
                    prop_assert_eq!(Some(gap), planned(pair[0]));
                }
            }
        }
    }
}
