//! Campaigns that end by themselves: the looks in the plan, what a further leg keeps of them, and diagnostics.

use skinrig_model::{
    Look, MissedReason, PressHistory, PressId, PressVerdict, RepetitionId, RunEnd, StopAnswer,
    StopMetric, StopQuestion, StopReason,
};
use skinrig_protocol::{Diagnostics, Plan, Protocol, Route, Step, Stop};

use crate::common::{demo, parse, shipped};

/// The demo with five repetitions, four of them scored.
fn with(stop: &str) -> Result<Protocol, Diagnostics> {
    let text = format!("{}\n{stop}\n", shipped("demo.yaml"));
    parse(&text, &["repetitions.count=5", "evaluation.score=[2-5]"])
}

/// Number and repetition of each look, and presses before it.
fn looks(plan: &Plan) -> Vec<(u32, u32, usize)> {
    let mut presses = 0;
    let mut found = Vec::new();
    for step in &plan.steps {
        match step {
            Step::Press(_) => presses += 1,
            Step::Look { number, repetition } => {
                found.push((*number, repetition.number(), presses));
            }
            _ => {}
        }
    }
    found
}

#[test]
fn a_plan_without_a_stop_omits_it() {
    let text = demo(&[]).compile().to_json();
    assert!(!text.contains("\"stop\"") && !text.contains("look"));
}

#[test]
fn a_look_follows_each_scored_repetition_or_the_listed_ones() {
    let plan = with("stop: {narrower_than: 0.2 mm}").unwrap().compile();
    let rule = Stop {
        metric: StopMetric::Rmse,
        question: StopQuestion::NarrowerThan(0.2),
        alpha: 0.05,
        looks: 4,
    };
    assert_eq!(plan.stop, Some(rule));
    // Three sync presses, 81 locations.
    let at = |repetition: usize| 3 + 81 * repetition;
    let all = [(1, 2, at(2)), (2, 3, at(3)), (3, 4, at(4)), (4, 5, at(5))];
    assert_eq!(looks(&plan), all);
    let plan = with("stop: {metric: median, target: 3 mm, alpha: 1 %, looks: [3, 5]}");
    let plan = plan.unwrap().compile();
    let stop = plan.stop.unwrap();
    assert_eq!((stop.metric, stop.looks), (StopMetric::Median, 2));
    assert_eq!(stop.question, StopQuestion::Target(3.0));
    assert!((stop.alpha - 0.01).abs() < 1e-12);
    assert_eq!(looks(&plan), [(1, 3, at(3)), (2, 5, at(5))]);
    // A stored plan is read again.
    let read: Plan = serde_json::from_str(&plan.to_json()).unwrap();
    assert_eq!(read, plan);
}

#[test]
fn a_further_leg_takes_the_looks_of_its_presses_and_the_one_before() {
    let plan = with("stop: {target: 1 mm}").unwrap().compile();
    let from = |first: usize| {
        let rest = plan.remaining(
            |id: PressId| id.index() < 3 || id.index() as usize >= first,
            Route::Straight,
        );
        let numbers = looks(&rest).into_iter().map(|(number, ..)| number);
        numbers.collect::<Vec<_>>()
    };
    assert_eq!(plan.remaining(|_| true, Route::Straight), plan);
    assert_eq!(from(3), [1, 2, 3, 4]);
    assert_eq!(from(3 + 81 * 2), [1, 2, 3, 4]);
    assert_eq!(from(3 + 81 * 2 + 1), [1, 2, 3, 4]);
    assert_eq!(from(3 + 81 * 4 - 1), [2, 3, 4]);
    assert_eq!(from(3 + 81 * 5 - 1), [3, 4]);
}

#[test]
fn nothing_is_left_of_a_campaign_whose_question_is_decided() {
    let plan = with("stop: {target: 1 mm}").unwrap().compile();
    let look = Look {
        number: 1,
        declared: 4,
        repetition: RepetitionId::from_index(1),
        presses: 81,
        attempted: Some(81),
        metric: StopMetric::Rmse,
        question: StopQuestion::Target(1.0),
        alpha: 0.0125,
        value_mm: 0.5,
        low_mm: Some(0.4),
        high_mm: Some(0.6),
        answer: Some(StopAnswer::Below),
    };
    let histories = |end: RunEnd| -> Vec<PressHistory> {
        let of = |i: usize| {
            let verdict = if i < 3 + 81 * 2 {
                PressVerdict::Valid
            } else {
                PressVerdict::Missed(MissedReason::RunEnded(end.clone()))
            };
            PressHistory {
                attempts: 1,
                verdict: Some(verdict),
                ..PressHistory::default()
            }
        };
        (0..plan.presses.len()).map(of).collect()
    };
    let left = |reason| {
        let pending = plan.pending(&histories(RunEnd::Stopped(reason)));
        pending.into_iter().filter(|p| *p).count()
    };
    assert_eq!(left(StopReason::Decided(Box::new(look))), 0);
    assert_eq!(left(StopReason::Stop), 3 + 81 * 3);
}

#[track_caller]
fn refused(stop: &str, parts: &[&str]) {
    let error = with(stop).expect_err(stop).render(false);
    for part in parts {
        assert!(error.contains(part), "{stop}: {part} is missing\n{error}");
    }
}

#[test]
fn a_wrong_stop_is_explained_at_its_place() {
    refused("stop: {alpha: 5 %}", &["stop", "narrower_than", "target"]);
    refused(
        "stop: {narrower_than: 1 mm, target: 1 mm}",
        &["narrower_than", "target"],
    );
    refused("stop: {target: 0 mm}", &["stop.target", "more than 0 mm"]);
    refused(
        "stop: {target: 1 mm, looks: []}",
        &["stop.looks", "no look is declared", "remove `looks`"],
    );
    refused(
        "stop: {target: 1 mm, looks: [0]}",
        &["stop.looks", "counting starts at 1"],
    );
    refused(
        "stop: {target: 1 mm, alpha: 50 %}",
        &["stop.alpha", "at most 49"],
    );
    refused(
        "stop: {target: 1 mm, metric: bias}",
        &["stop.metric", "rmse"],
    );
    for looks in ["[1]", "[2, 6]", "[3, 2]", "[2, 2]"] {
        refused(
            &format!("stop: {{target: 1 mm, looks: {looks}}}"),
            &["stop.looks", "in ascending order, each once"],
        );
    }
    let text = format!("{}\nstop: {{target: 1 mm}}\n", shipped("demo.yaml"));
    let many = ["repetitions.count=102", "evaluation.score=[2-102]"];
    let error = parse(&text, &many).unwrap_err().to_string();
    assert!(error.contains("too many looks"), "{error}");
    let late = [
        "repetitions.count=5",
        "evaluation.calibrate=[1, 4]",
        "evaluation.score=[2, 3, 5]",
    ];
    let error = parse(&text, &late).unwrap_err().to_string();
    assert!(error.contains("calibrates after the first look"), "{error}");
    assert!(error.contains("evaluation.calibrate"), "{error}");
}
