//! Retakes: immediately in place, and by a resumed run.

use skinrig_controller::{ProgressTracker, Resume, Run};
use skinrig_model::*;
use skinrig_protocol::plan::{Plan, Step};
use skinrig_protocol::{Retakes, Route};

use crate::course::{RunResult, START, faults, run_plan};
use crate::mock::*;

fn retaking(per_press: u32, per_session: u32) -> Plan {
    Plan {
        retakes: Retakes {
            per_press,
            per_session,
        },
        ..plan()
    }
}

/// Press and number of each intent, with its time in ms.
fn intents(result: &RunResult) -> Vec<(u32, u32, i64)> {
    let intent = |r: &Record| match r {
        Record::Intent { attempt, t } => Some((attempt.press.index(), attempt.number, t.0 / MS)),
        _ => None,
    };
    result.records.iter().filter_map(intent).collect()
}

/// Press, number and verdict of each outcome.
fn outcomes(result: &RunResult) -> Vec<(u32, u32, &'static str)> {
    let outcome = |r: &Record| match r {
        Record::Outcome(o) => Some((o.attempt.press.index(), o.attempt.number, o.verdict.name())),
        _ => None,
    };
    result.records.iter().filter_map(outcome).collect()
}

/// A chunk of camera 2 during the second press.
fn chunk_of_the_second_press() -> u64 {
    let good = run_plan(&plan(), faults(), START, Sink::default());
    let mut records = good.records.iter().skip_while(
        |r| !matches!(r, Record::Intent { attempt, .. } if attempt.press == PressId::from_index(1)),
    );
    records
        .find_map(|r| match r {
            Record::Chunk(c) if c.camera == CameraId::Two => Some(c.seq),
            _ => None,
        })
        .unwrap_or_default()
}

#[test]
fn a_press_with_lost_data_is_retaken_immediately() {
    let losing = Faults {
        loss: Some((CameraId::Two, chunk_of_the_second_press(), 7)),
        ..faults()
    };
    let result = run_plan(&retaking(2, 20), losing, START, Sink::default());
    let valid = "valid";
    assert_eq!(
        outcomes(&result),
        [
            (0, 1, valid),
            (1, 1, "invalid"),
            (1, 2, valid),
            (2, 1, valid)
        ]
    );
    assert_eq!((result.report.valid, result.report.invalid), (3, 0));
    assert_eq!(result.report.end, RunEnd::Completed);
    // The period from the retake to the next press is no shorter than without a retake.
    let t = intents(&result);
    let took = t[2].2 - t[1].2;
    assert_eq!(t[3].2 - t[1].2, 503 + took, "{t:?}");
    // The progress counts presses, not attempts.
    let mut tracker = ProgressTracker::new(None);
    for record in &result.records {
        let p = tracker.update(record);
        assert!(p.done == p.valid + p.invalid + p.missed && p.done <= 3);
    }
    let p = tracker.progress();
    assert_eq!((p.done, p.valid, p.invalid, p.retaken), (3, 3, 0, 1));
}

#[test]
fn a_press_interrupted_by_the_operator_is_retaken_after_the_pause() {
    let good = intents(&run_plan(&plan(), faults(), START, Sink::default()));
    let ticks = lock(&run_plan(&plan(), faults(), START, Sink::default()).world).ticks;
    let mut broken = 0;
    for tick in 1..=ticks {
        let paused = Faults {
            operator: Some((tick, OperatorAction::PauseNow)),
            ..faults()
        };
        let result = run_plan(&retaking(2, 20), paused, START, Sink::default());
        let r = &result.report;
        assert_eq!((r.valid, &r.end), (3, &RunEnd::Completed), "tick {tick}");
        broken += usize::from(intents(&result).len() > good.len());
    }
    assert!(broken > 20, "{broken} of {ticks} ticks are within a press");
}

#[test]
fn the_protocol_limits_retakes() {
    // An obstacle 1.2 mm below the surface, from the first press on.
    let blocked = || Faults {
        floor_mm: Some((0, -1.2, i64::MAX)),
        ..faults()
    };
    let attempts = |per_press, per_session| {
        let plan = retaking(per_press, per_session);
        let result = run_plan(&plan, blocked(), START, Sink::default());
        assert_eq!(result.report.end, RunEnd::Completed);
        assert_eq!((result.report.invalid, result.report.valid), (3, 0));
        let mut counts = [0; 3];
        for (press, number, _) in intents(&result) {
            counts[press as usize] += 1;
            assert_eq!(number, counts[press as usize]);
        }
        counts
    };
    assert_eq!(attempts(0, 20), [1, 1, 1]);
    assert_eq!(attempts(1, 20), [2, 2, 2]);
    assert_eq!(attempts(2, 3), [3, 2, 1]);
}

#[test]
fn faults_of_the_skin_are_not_retaken() {
    let good = run_plan(&plan(), faults(), START, Sink::default());
    let at_depth = good.records.iter().find_map(|r| match r {
        Record::Outcome(o) if o.attempt.press == PressId::from_index(1) => {
            o.timing.map(|t| t.at_depth.0 / MS)
        }
        _ => None,
    });
    let at_depth = at_depth.unwrap_or_default();
    let gives_way = Faults {
        floor_mm: Some((at_depth + 10, -1.9, at_depth + 15)),
        ..faults()
    };
    let result = run_plan(&retaking(2, 20), gives_way, START, Sink::default());
    assert_eq!(
        outcomes(&result),
        [(0, 1, "valid"), (1, 1, "invalid"), (2, 1, "valid")]
    );
}

#[test]
fn a_run_that_ends_during_a_press_cuts_it_off() {
    let result = run_plan(
        &plan(),
        Faults {
            stiffness_n_mm: 4.5,
            ..faults()
        },
        START,
        Sink::default(),
    );
    let cut_off = result.records.iter().any(|r| {
        matches!(r, Record::Outcome(o) if o.verdict.is_cut_off()
            && o.verdict.reason().is_some_and(|r| r.contains("force: expected at most 8 N")))
    });
    assert!(cut_off, "{:?}", result.report);
}

fn history(attempts: u32, verdict: Option<PressVerdict>) -> PressHistory {
    PressHistory {
        attempts,
        spent: attempts,
        verdict,
        ..PressHistory::default()
    }
}

/// The mock's plan with its first press made a sync press.
fn with_sync() -> Plan {
    let mut plan = retaking(0, 0);
    plan.presses[0].role = PressRole::Sync;
    plan
}

fn resume(plan: &Plan, rest: &Plan, histories: &[PressHistory], faults: Faults) -> RunResult {
    let world = World::shared(faults, START);
    let control = lock(&world).control.clone();
    let mut sink = Sink::default();
    let report = Run::new(rest, header(plan), rig(&world), &control, &mut sink)
        .resumed(Resume {
            header: ResumeHeader {
                operator: "o".into(),
                started_at: String::new(),
                host: String::new(),
                software: String::new(),
                command_line: String::new(),
            },
            histories: histories.to_vec(),
        })
        .execute();
    RunResult {
        world,
        records: sink.records,
        report,
    }
}

fn rest_of(plan: &Plan, histories: &[PressHistory]) -> Plan {
    let pending = plan.pending(histories);
    plan.remaining(|id| pending[id.index() as usize], Route::Straight)
}

fn cut_off_in_the_second_press() -> [PressHistory; 3] {
    [
        history(1, Some(PressVerdict::Valid)),
        history(1, None),
        history(0, None),
    ]
}

#[test]
fn a_resumed_run_continues_at_the_press_that_was_cut_off() {
    let histories = cut_off_in_the_second_press();
    let plan = plan();
    let rest = rest_of(&plan, &histories);
    let result = resume(&plan, &rest, &histories, faults());
    assert!(matches!(result.records[0], Record::Resumed(_)));
    assert!(
        !result
            .records
            .iter()
            .any(|r| matches!(r, Record::Started(_)))
    );
    let r = &result.report;
    assert_eq!(r.end, RunEnd::Completed, "{r:?}");
    assert_eq!((r.planned, r.valid, r.invalid, r.missed), (3, 3, 0, 0));
    assert_eq!(outcomes(&result), [(1, 2, "valid"), (2, 1, "valid")]);
    // The first slot starts at once (the plan's first one is at 300 ms), the next one a period later.
    let t = intents(&result);
    assert_eq!(t[1].2 - t[0].2, 503);
    // The robot goes only to the locations of the remaining presses, with lateral motion at clearance height.
    let w = lock(&result.world);
    assert_eq!(w.violations, Vec::<String>::new());
    let sideways: Vec<_> = w.commands.iter().filter(|c| c.0[2] == 5.0).collect();
    assert_eq!(sideways[0].0, [10.0, 2.0, 5.0]);
}

#[test]
fn sync_presses_repeat_and_stay_valid_otherwise() {
    let plan = with_sync();
    let histories = cut_off_in_the_second_press();
    let rest = rest_of(&plan, &histories);
    let result = resume(&plan, &rest, &histories, faults());
    let all = [(0, 2, "valid"), (1, 2, "valid"), (2, 1, "valid")];
    assert_eq!(outcomes(&result), all);
    // Stopped before any press: valid presses stay valid, and cut-off ones do not become missed.
    let stopped = Faults {
        operator: Some((1, OperatorAction::Stop)),
        ..faults()
    };
    let result = resume(&plan, &rest, &histories, stopped);
    let r = &result.report;
    assert_eq!((r.valid, r.invalid, r.missed), (1, 1, 1), "{r:?}");
    let missed: Vec<_> = result
        .records
        .iter()
        .filter_map(|r| match r {
            Record::Missed(attempt, _) => Some((attempt.press.index(), attempt.number)),
            _ => None,
        })
        .collect();
    assert_eq!(missed, [(2, 1)]);
}

#[test]
fn a_resumed_run_survives_every_failing_call() {
    let histories = cut_off_in_the_second_press();
    let plan = with_sync();
    let rest = rest_of(&plan, &histories);
    let total = lock(&resume(&plan, &rest, &histories, faults()).world).calls;
    for k in 1..=total {
        let failing = Faults {
            at_call: Some((k, Failure::Once)),
            ..faults()
        };
        let result = resume(&plan, &rest, &histories, failing);
        result.check_rig(&format!("call {k} of {total}"));
    }
}

#[test]
fn a_plan_other_than_the_remaining_one_is_rejected() {
    let histories = cut_off_in_the_second_press();
    let plan = plan();
    let rest = rest_of(&plan, &histories);
    let refused = |rest: &Plan, histories: &[PressHistory], words: &str| {
        let result = resume(&plan, rest, histories, faults());
        match &result.report.end {
            RunEnd::Faulted(causes) => assert!(causes.to_string().contains(words), "{causes}"),
            other => panic!("expected a fault, found {other:?}"),
        }
        assert!(!lock(&result.world).ever_armed);
    };
    refused(&plan, &histories, "expected no step for press 1");
    refused(&rest, &[], "expected those of 3 presses, found 0");
    let mut less = rest.clone();
    less.steps
        .retain(|s| !matches!(s, Step::Press(p) if p.press == PressId::from_index(2)));
    refused(&less, &histories, "expected a step for press 3");
}
