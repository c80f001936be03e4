//! Runs interrupted at every device call, at every record and at every tick.

use crate::course::*;
use crate::mock::*;
use std::collections::BTreeSet;

use skinrig_model::*;

#[test]
fn every_device_call_may_fail() {
    let total = lock(&run(faults()).world).calls;
    assert!(total > 500, "{total}");
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        let text = info.payload().downcast_ref::<String>();
        if !text.is_some_and(|t| t.starts_with("mock ") || t.starts_with("sink ")) {
            hook(info); // unintended panics stay visible
        }
    }));
    for failure in [Failure::Once, Failure::Forever, Failure::Panic] {
        for k in 1..=total {
            let result = run(Faults {
                at_call: Some((k, failure)),
                ..faults()
            });
            let case = format!("call {k} of {total}, {failure:?}");
            result.check(&case);
            let is_reported = matches!(result.report.end, RunEnd::Faulted(_))
                || !result.report.problems.is_empty();
            assert!(
                is_reported,
                "{case}: the failure is reported: {:?}",
                result.report
            );
        }
    }
}

#[test]
fn every_record_may_be_refused() {
    let total = run(faults()).records.len();
    for failure in [
        SinkFailure::Once,
        SinkFailure::Forever,
        SinkFailure::Panic,
        SinkFailure::Late,
    ] {
        for k in 0..total {
            let sink = Sink {
                fail: Some((k, failure)),
                ..Sink::default()
            };
            let result = run_plan(&plan(), faults(), START, sink);
            let case = format!("record {k} of {total}, {failure:?}");
            result.check_rig(&case);
            assert!(
                matches!(result.report.end, RunEnd::Faulted(_))
                    || !result.report.problems.is_empty(),
                "{case}: {:?}",
                result.report
            );
            // A sink that recovers has every press once; a lost outcome is repeated as invalid.
            let records = || result.records.iter();
            let ends = records().filter_map(|r| match r {
                Record::Outcome(outcome) => Some(outcome.attempt),
                Record::Missed(attempt, _) => Some(*attempt),
                _ => None,
            });
            let ends: Vec<AttemptId> = ends.collect();
            let begun = records().filter_map(|r| match r {
                Record::Intent { attempt, .. } | Record::Missed(attempt, _) => Some(*attempt),
                _ => None,
            });
            let begun: Vec<AttemptId> = begun.collect();
            let n = |all: &[AttemptId]| all.iter().collect::<BTreeSet<_>>().len();
            assert_eq!(
                (n(&ends), n(&begun)),
                (ends.len(), begun.len()),
                "{case}: twice"
            );
            let is_begin = matches!(result.records.get(k), Some(Record::Intent { .. }));
            if failure == SinkFailure::Forever {
                assert!(ends.len() <= 3 && result.records.len() == k, "{case}");
            } else if failure == SinkFailure::Late && is_begin {
                // The press was not made, but its intent is recorded.
                assert_eq!((ends.len(), begun.len()), (2, 3), "{case}");
            } else {
                assert_eq!(ends.len(), 3, "{case}");
            }
        }
    }
}

#[test]
fn the_operator_may_interrupt_at_every_tick() {
    let ticks = lock(&run(faults()).world).ticks;
    assert!(ticks > 200, "{ticks}");
    let (mut broken_off, mut halted_in_skin) = (0, 0);
    for tick in 1..=ticks {
        for press in OperatorAction::REQUESTS {
            let result = run(Faults {
                operator: Some((tick, press)),
                ..faults()
            });
            let case = format!("{press:?} at tick {tick} of {ticks}");
            result.check(&case);
            match press {
                OperatorAction::Pause => {
                    assert_eq!(result.report.end, RunEnd::Completed, "{case}");
                    assert_eq!(result.report.valid, 3, "{case}");
                }
                OperatorAction::PauseNow => {
                    assert_eq!(result.report.end, RunEnd::Completed, "{case}");
                    assert_eq!(result.report.missed, 0, "{case}");
                    let outcomes = result.outcomes().into_iter();
                    let broken: Vec<PressVerdict> = outcomes
                        .map(|o| o.verdict.clone())
                        .filter(|verdict| *verdict != PressVerdict::Valid)
                        .collect();
                    broken_off += broken.len();
                    let is_pause = |verdict: &PressVerdict| {
                        let PressVerdict::Invalid(InvalidReason::Faults(faults)) = verdict else {
                            return false;
                        };
                        faults.as_slice().first() == Some(&PressFault::Paused)
                    };
                    assert!(
                        broken.len() <= 1 && broken.iter().all(is_pause),
                        "{case}: {broken:?}"
                    );
                }
                OperatorAction::Halt => {
                    if result.report.end == RunEnd::Completed {
                        assert!(tick >= ticks - 1, "{case}");
                        continue;
                    }
                    let w = lock(&result.world);
                    halted_in_skin += usize::from(w.tip[2] < -1.0);
                    assert!(
                        result.report.disarmed && result.report.invalid <= 1,
                        "{case}"
                    );
                    assert!(
                        w.ticks <= tick + 1,
                        "{case}: motors off within a tick, found {}",
                        w.ticks
                    );
                }
                OperatorAction::Stop => {
                    // The press in progress is finished; none is interrupted.
                    assert_eq!(result.report.invalid, 0, "{case}: {:?}", result.outcomes());
                    if result.report.end == RunEnd::Completed {
                        assert_eq!(result.report.valid, 3, "{case}");
                    }
                }
                OperatorAction::Note => unreachable!("has a test of its own"),
                OperatorAction::Abort => {
                    let expected = RunEnd::Stopped(StopReason::Abort);
                    // At the very last ticks nothing is left to abort.
                    if result.report.end != RunEnd::Completed {
                        assert_eq!(result.report.end, expected, "{case}");
                        assert!(result.report.invalid <= 1, "{case}");
                    }
                }
            }
        }
    }
    assert!(broken_off > 50, "{broken_off}");
    assert!(halted_in_skin > 20, "{halted_in_skin}");
}

#[test]
fn a_pause_does_not_shorten_the_period_after_it() {
    let result = run(Faults {
        operator: Some((130, OperatorAction::Pause)),
        ..faults()
    });
    let intents: Vec<i64> = result
        .records
        .iter()
        .filter_map(|r| match r {
            Record::Intent { t, .. } => Some(t.0 / MS),
            _ => None,
        })
        .collect();
    let kinds: Vec<InterruptionKind> = result
        .records
        .iter()
        .filter_map(|r| match r {
            Record::Interruption { kind, .. } => Some(*kind),
            _ => None,
        })
        .collect();
    assert_eq!(kinds, [InterruptionKind::Pause, InterruptionKind::Resume]);
    assert_eq!(result.report.valid, 3);
    let gaps = [intents[1] - intents[0], intents[2] - intents[1]];
    assert_eq!(gaps[1], 503, "{gaps:?}");
    assert!(gaps[0] > 1000, "{gaps:?}");
}

#[test]
fn a_halt_cancels_the_retraction_of_an_abort() {
    let kinds = |result: &RunResult| -> Vec<InterruptionKind> {
        let kind = |r: &Record| match r {
            Record::Interruption { kind, .. } => Some(*kind),
            _ => None,
        };
        result.records.iter().filter_map(kind).collect()
    };
    // Before the plan's first press nothing retracts, so search for the first tick whose abort finds the tip in the skin.
    let ticks = lock(&run(faults()).world).ticks;
    let mut ended = Vec::new();
    for tick in (1..ticks).step_by(20) {
        let abort = Faults {
            operator: Some((tick, OperatorAction::Abort)),
            ..faults()
        };
        let rises = lock(&run(abort.clone()).world).ticks - tick;
        if rises < 10 {
            continue;
        }
        let result = run(Faults {
            halt_after: Some(5),
            ..abort
        });
        let case = format!("abort at tick {tick}, halt 5 ticks later");
        result.check_rig(&case);
        assert!(result.report.disarmed && !result.report.retracted, "{case}");
        assert!(lock(&result.world).ticks <= tick + 6, "{case}");
        ended.push(kinds(&result));
    }
    let both = [InterruptionKind::Abort, InterruptionKind::Halt];
    assert!(
        ended.len() > 3 && ended.iter().all(|k| k[..] == both),
        "{ended:?}"
    );
}
