//! Looks of a campaign: a decided question ends the run after the press, undecided and failed looks change nothing.

use std::cell::RefCell;
use std::rc::Rc;

use skinrig_controller::{LookFault, LookOutcome, Looks, Run, RunReport};
use skinrig_model::*;
use skinrig_protocol::Stop;
use skinrig_protocol::plan::{Plan, Step};

use crate::course::{START, faults};
use crate::mock::*;

/// A look after each of the first two presses.
fn looking_plan() -> Plan {
    let mut plan = plan();
    plan.stop = Some(Stop {
        metric: StopMetric::Rmse,
        question: StopQuestion::Target(1.0),
        alpha: 0.05,
        looks: 2,
    });
    let presses: Vec<usize> = (0..plan.steps.len())
        .filter(|n| matches!(plan.steps[*n], Step::Press(_)))
        .collect();
    for (number, at) in [(2, presses[1]), (1, presses[0])] {
        let repetition = RepetitionId::from_index(0);
        plan.steps.insert(at + 1, Step::Look { number, repetition });
    }
    plan
}

fn look(number: u32, answer: Option<StopAnswer>) -> Look {
    Look {
        number,
        declared: 2,
        repetition: RepetitionId::from_index(0),
        presses: 4,
        attempted: None,
        metric: StopMetric::Rmse,
        question: StopQuestion::Target(1.0),
        alpha: 0.025,
        value_mm: 0.5,
        low_mm: Some(0.4),
        high_mm: Some(0.6),
        answer,
    }
}

/// What a mock look finds, and after how many polls.
type Plot = fn(u32) -> (u32, Result<Option<StopAnswer>, LookFault>);

struct MockLooks {
    plot: Plot,
    begun: Rc<RefCell<Vec<u32>>>,
    pending: Vec<(u32, u32)>,
}

impl Looks for MockLooks {
    fn begin(&mut self, number: u32) {
        self.begun.borrow_mut().push(number);
        self.pending.push((number, (self.plot)(number).0));
    }

    fn poll(&mut self, _: HostTime) -> Option<LookOutcome> {
        let (number, left) = self.pending.first_mut()?;
        if *left > 0 {
            *left -= 1;
            return None;
        }
        let number = *number;
        self.pending.remove(0);
        Some(match (self.plot)(number).1 {
            Ok(answer) => LookOutcome::Taken(look(number, answer)),
            Err(why) => LookOutcome::NotTaken { number, why },
        })
    }
}

fn run(plot: Plot, operator: Option<(u64, OperatorAction)>) -> (RunReport, Vec<Record>, Vec<u32>) {
    let world = World::shared(
        Faults {
            operator,
            ..faults()
        },
        START,
    );
    let control = lock(&world).control.clone();
    let (plan, mut sink) = (looking_plan(), Sink::default());
    let begun = Rc::default();
    let looks = MockLooks {
        plot,
        begun: Rc::clone(&begun),
        pending: Vec::new(),
    };
    let report = Run::new(&plan, header(&plan), rig(&world), &control, &mut sink)
        .looking(Box::new(looks))
        .execute();
    let begun = begun.borrow().clone();
    (report, sink.records, begun)
}

fn decided(number: u32) -> RunEnd {
    RunEnd::Stopped(StopReason::Decided(Box::new(look(
        number,
        Some(StopAnswer::Below),
    ))))
}

#[test]
fn a_decided_question_ends_the_run_before_the_next_step() {
    let (report, records, begun) = run(|_| (0, Ok(Some(StopAnswer::Below))), None);
    assert_eq!((report.end.clone(), begun), (decided(1), vec![1]));
    assert_eq!((report.valid, report.missed), (1, 2));
    assert!(report.retracted && report.disarmed && report.end.is_complete());
    let missed = MissedReason::RunEnded(decided(1));
    let all = records.iter().filter_map(|r| match r {
        Record::Missed(_, reason) => Some(reason),
        _ => None,
    });
    assert!(all.clone().count() == 2 && all.clone().all(|r| *r == missed));
    let stops = records.iter().filter(|r| {
        matches!(r, Record::Interruption { kind: InterruptionKind::Stop, reason, .. }
            if *reason == InterruptionReason::End(decided(1)))
    });
    assert_eq!(stops.count(), 1);
}

#[test]
fn a_late_answer_ends_the_run_after_the_press_under_way() {
    // 50 polls later the second press is under way.
    let (report, _, begun) = run(|_| (50, Ok(Some(StopAnswer::Below))), None);
    assert_eq!((report.end, begun), (decided(1), vec![1]));
    assert_eq!((report.valid, report.missed), (2, 1));
}

#[test]
fn undecided_failed_and_unfinished_looks_change_nothing() {
    let plots: [Plot; 3] = [
        |_| (0, Ok(None)),
        |_| (0, Err(LookFault::Overtaken)),
        |_| (u32::MAX, Ok(Some(StopAnswer::Below))),
    ];
    for (n, plot) in plots.into_iter().enumerate() {
        let (report, records, begun) = run(plot, None);
        assert_eq!(report.end, RunEnd::Completed, "{n}");
        assert_eq!((report.valid, begun), (3, vec![1, 2]), "{n}");
        let is_note =
            |r: &&Record| matches!(r, Record::Note { text, .. } if text.starts_with("look"));
        let notes = records.iter().filter(is_note).count();
        assert_eq!(notes, if n == 2 { 0 } else { 2 }, "{n}");
    }
}

#[test]
fn the_operators_requests_come_before_an_answer() {
    use OperatorAction::{Abort, Pause, Stop};
    let plot: Plot = |_| (5, Ok(Some(StopAnswer::Below)));
    for tick in (1..1500).step_by(50) {
        // A paused run stays paused until it is resumed, 200 ticks later.
        for (action, own) in [
            (Stop, Some(StopReason::Stop)),
            (Abort, Some(StopReason::Abort)),
            (Pause, None),
        ] {
            let (report, ..) = run(plot, Some((tick, action)));
            let case = format!("{action:?} at {tick}: {report:?}");
            let by_operator = own.map(RunEnd::Stopped);
            let ends = [Some(decided(1)), by_operator];
            assert!(ends.contains(&Some(report.end)), "{case}");
            assert!(report.retracted && report.disarmed, "{case}");
        }
    }
}
