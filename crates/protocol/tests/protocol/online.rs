//! Touch felt while recording: what a plan holds of it, what a further leg keeps, and diagnostics.

use skinrig_model::{PressId, PressRole, Reaction};
use skinrig_protocol::{Diagnostics, Plan, Protocol, React, Route, Step};

use crate::common::{demo, parse, shipped};

fn with(online: &str, overrides: &[&str]) -> Result<Protocol, Diagnostics> {
    parse(&format!("{}\n{online}\n", shipped("demo.yaml")), overrides)
}

/// Presses before the step that learns, and what each role of press does when it is felt.
fn learns(plan: &Plan) -> (Vec<usize>, Vec<(PressRole, Option<React>)>) {
    let (mut presses, mut learns, mut reacts) = (0, Vec::new(), Vec::new());
    for step in &plan.steps {
        match step {
            Step::Learn => learns.push(presses),
            Step::Press(p) => {
                presses += 1;
                reacts.push((plan.presses[p.press.index() as usize].role, p.react));
            }
            _ => {}
        }
    }
    reacts.dedup();
    (learns, reacts)
}

#[test]
fn a_plan_without_it_omits_it() {
    let text = demo(&[]).compile().to_json();
    assert!(!text.contains("online") && !text.contains("learn") && !text.contains("react"));
}

#[test]
fn it_is_learnt_before_the_first_scored_repetition_and_only_scored_presses_react() {
    let plan = with("online: {react: {then: lift, region: 3 mm}}", &[]);
    let plan = plan.unwrap().compile();
    let react = React {
        then: Reaction::Lift,
        region_mm: Some(3.0),
        depth_mm: None,
    };
    use PressRole::{Calibrate, Score, Sync};
    let reacts = vec![(Sync, None), (Calibrate, None), (Score, Some(react))];
    assert_eq!(learns(&plan), (vec![3 + 81], reacts));
    let read: Plan = serde_json::from_str(&plan.to_json()).unwrap();
    assert_eq!(read, plan);
    let plan = with("online: {}", &[]).unwrap().compile();
    assert_eq!(learns(&plan).0, [3 + 81]);
    assert!(
        plan.online
            .is_some_and(|o| o.react.is_none() && o.false_alarms_hz == 0.13)
    );
}

#[test]
fn a_region_that_is_never_known_is_refused() {
    let react = |columns: &str, react: &str| {
        let size = [columns, "path.meander.rows=4"];
        with(&format!("online: {{react: {{{react}}}}}"), &size)
    };
    let few = react("path.meander.columns=5", "then: lift, region: 3 mm").unwrap_err();
    let few = few.to_string();
    for part in [
        "online.react.region",
        "at least 24 calibration presses",
        "= found: 20",
    ] {
        assert!(few.contains(part), "{few}");
    }
    react("path.meander.columns=6", "then: lift, region: 3 mm").unwrap();
    react("path.meander.columns=5", "then: lift").unwrap();
}

#[test]
fn a_depth_that_is_never_felt_is_refused() {
    let react = |columns: &str, overrides: &[&str]| {
        let columns = format!("path.meander.columns={columns}");
        let size = [&[columns.as_str(), "path.meander.rows=3"], overrides].concat();
        with("online: {react: {then: lift, depth: 1.5 mm}}", &size)
    };
    let refused = |found: Result<Protocol, Diagnostics>, parts: [&str; 2]| {
        let text = found.unwrap_err().to_string();
        for part in ["online.react.depth", parts[0], parts[1]] {
            assert!(text.contains(part), "{text}");
        }
    };
    refused(
        react("6", &[]),
        ["at least 19 calibration presses", "= found: 18"],
    );
    react("7", &[]).unwrap();
    refused(
        react("7", &["depth=1.5mm"]),
        [
            "less than the depth of the presses, 1.5 mm",
            "found: 1.5 mm",
        ],
    );
}

#[test]
fn a_further_leg_learns_only_if_it_presses_everything_again() {
    let plan = with("online: {}", &[]).unwrap().compile();
    assert_eq!(plan.remaining(|_| true, Route::Straight), plan);
    let rest = plan.remaining(|id: PressId| id.index() != 7, Route::Straight);
    assert_eq!(learns(&rest).0, Vec::<usize>::new());
}

#[test]
fn calibration_comes_first() {
    let found = |overrides: &[&str]| with("online: {}", overrides).unwrap_err().to_string();
    let late = found(&["evaluation.calibrate=[2]", "evaluation.score=[1, 3]"]);
    assert!(
        late.contains("a repetition calibrates after the first scored one")
            && late.contains("repetition 2 calibrates"),
        "{late}"
    );
    let none = found(&[
        "evaluation.calibrate=[]",
        "evaluation.score=[1, 2, 3]",
        "analysis.calibration=none",
    ]);
    assert!(none.contains("no repetition calibrates"), "{none}");
    let wrong = with("online: {react: {then: jump}, false_alarms: 0 Hz}", &[]);
    let wrong = wrong.unwrap_err().to_string();
    assert!(wrong.contains("jump") && wrong.contains("0.001"), "{wrong}");
}
