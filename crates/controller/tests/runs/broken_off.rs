//! Runs that break off: at every device call, at every record, at every tick of the operator.

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
            hook(info); // what no mock intends stays visible
        }
    }));
    for failure in [Failure::Once, Failure::Forever, Failure::Panic] {
        for k in 1..=total {
            let told = run(Faults {
                at_call: Some((k, failure)),
                ..faults()
            });
            let case = format!("call {k} of {total}, {failure:?}");
            told.check(&case);
            let told_of =
                matches!(told.report.end, RunEnd::Faulted(_)) || !told.report.problems.is_empty();
            assert!(told_of, "{case}: a failure is told: {:?}", told.report);
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
            let told = run_plan(&plan(), faults(), START, sink);
            let case = format!("record {k} of {total}, {failure:?}");
            told.check_rig(&case);
            assert!(
                matches!(told.report.end, RunEnd::Faulted(_)) || !told.report.problems.is_empty(),
                "{case}: {:?}",
                told.report
            );
            // A sink that recovers has every press once; a lost outcome is told again as invalid.
            let records = || told.records.iter();
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
            let is_begin = matches!(told.records.get(k), Some(Record::Intent { .. }));
            if failure == SinkFailure::Forever {
                assert!(ends.len() <= 3 && told.records.len() == k, "{case}");
            } else if failure == SinkFailure::Late && is_begin {
                // The press was not made, and its intent stands.
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
        for press in Press::REQUESTS {
            let told = run(Faults {
                operator: Some((tick, press)),
                ..faults()
            });
            let case = format!("{press:?} at tick {tick} of {ticks}");
            told.check(&case);
            match press {
                Press::Pause => {
                    assert_eq!(told.report.end, RunEnd::Completed, "{case}");
                    assert_eq!(told.report.valid, 3, "{case}");
                }
                Press::PauseNow => {
                    assert_eq!(told.report.end, RunEnd::Completed, "{case}");
                    assert_eq!(told.report.missed, 0, "{case}");
                    let broken = told
                        .outcomes()
                        .into_iter()
                        .filter_map(|o| match &o.verdict {
                            PressVerdict::Valid => None,
                            other => Some(format!("{other:?}")),
                        });
                    let broken: Vec<String> = broken.collect();
                    broken_off += broken.len();
                    assert!(
                        broken.len() <= 1
                            && broken.iter().all(|b| b.contains("paused by the operator")),
                        "{case}: {broken:?}"
                    );
                }
                Press::Halt => {
                    if told.report.end == RunEnd::Completed {
                        assert!(tick >= ticks - 1, "{case}");
                        continue;
                    }
                    let w = lock(&told.world);
                    halted_in_skin += usize::from(w.tip[2] < -1.0);
                    assert!(told.report.disarmed && told.report.invalid <= 1, "{case}");
                    assert!(
                        w.ticks <= tick + 1,
                        "{case}: motors off within a tick, found {}",
                        w.ticks
                    );
                }
                Press::Stop => {
                    // The press under way is finished, none is broken off.
                    assert_eq!(told.report.invalid, 0, "{case}: {:?}", told.outcomes());
                    if told.report.end == RunEnd::Completed {
                        assert_eq!(told.report.valid, 3, "{case}");
                    }
                }
                Press::Note => unreachable!("has a test of its own"),
                Press::Abort => {
                    let wanted = RunEnd::Stopped(StopReason::Abort);
                    // At the very last ticks nothing is left to abort.
                    if told.report.end != RunEnd::Completed {
                        assert_eq!(told.report.end, wanted, "{case}");
                        assert!(told.report.invalid <= 1, "{case}");
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
    let told = run(Faults {
        operator: Some((130, Press::Pause)),
        ..faults()
    });
    let intents: Vec<i64> = told
        .records
        .iter()
        .filter_map(|r| match r {
            Record::Intent { t, .. } => Some(t.0 / MS),
            _ => None,
        })
        .collect();
    let kinds: Vec<InterruptionKind> = told
        .records
        .iter()
        .filter_map(|r| match r {
            Record::Interruption { kind, .. } => Some(*kind),
            _ => None,
        })
        .collect();
    assert_eq!(kinds, [InterruptionKind::Pause, InterruptionKind::Resume]);
    assert_eq!(told.report.valid, 3);
    let gaps = [intents[1] - intents[0], intents[2] - intents[1]];
    assert_eq!(gaps[1], 503, "{gaps:?}");
    assert!(gaps[0] > 1000, "{gaps:?}");
}

#[test]
fn a_halt_breaks_off_the_retraction_of_an_abort() {
    let kinds = |told: &Told| -> Vec<InterruptionKind> {
        let kind = |r: &Record| match r {
            Record::Interruption { kind, .. } => Some(*kind),
            _ => None,
        };
        told.records.iter().filter_map(kind).collect()
    };
    // Before the plan's first press nothing retracts, so the first tick whose abort finds the tip in the skin is sought.
    let ticks = lock(&run(faults()).world).ticks;
    let mut ended = Vec::new();
    for tick in (1..ticks).step_by(20) {
        let abort = Faults {
            operator: Some((tick, Press::Abort)),
            ..faults()
        };
        let rises = lock(&run(abort.clone()).world).ticks - tick;
        if rises < 10 {
            continue;
        }
        let told = run(Faults {
            halt_after: Some(5),
            ..abort
        });
        let case = format!("abort at tick {tick}, halt 5 ticks later");
        told.check_rig(&case);
        assert!(told.report.disarmed && !told.report.retracted, "{case}");
        assert!(lock(&told.world).ticks <= tick + 6, "{case}");
        ended.push(kinds(&told));
    }
    let both = [InterruptionKind::Abort, InterruptionKind::Halt];
    assert!(
        ended.len() > 3 && ended.iter().all(|k| k[..] == both),
        "{ended:?}"
    );
}
