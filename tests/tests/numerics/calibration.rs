//! Calibrating presses that cannot tell the parameters: too few, all at one place, all on one line.

use skinrig_analysis::analyze;
use skinrig_analysis::result::CalibrationResult;
use skinrig_model::{CalibrationModel, Point2, PressRole};

use crate::support::session;
use crate::wild::holds_only_numbers;

/// The planted session with `calibrate` deciding which calibrating presses stay; the full model is asked for.
fn calibrated(calibrate: impl Fn(Point2, usize) -> bool) -> (Option<CalibrationResult>, String) {
    let (mut input, source) = session();
    input.settings.calibration = CalibrationModel::Full;
    input.settings.bootstrap_resamples = 20;
    input.settings.study_presses = 0;
    let mut kept = 0;
    for planned in &mut input.planned {
        if planned.role == PressRole::Calibrate {
            if calibrate(planned.at, kept) {
                kept += 1;
            } else {
                planned.role = PressRole::Score;
            }
        }
    }
    let a = analyze(&input, &source).unwrap();
    holds_only_numbers(&a);
    (a.calibration, a.warnings.join("; "))
}

#[test]
fn enough_places_give_the_model_that_was_asked_for() {
    let (found, said) = calibrated(|_, _| true);
    assert_eq!(found.unwrap().model, CalibrationModel::Full, "{said}");
}

#[test]
fn presses_that_cannot_tell_the_parameters_are_reported_and_not_guessed_from() {
    let centre = Point2::new(8.0, 2.0);
    let one_place = |at: Point2, _: usize| at == centre;
    let two_places = |at: Point2, kept: usize| at.x_mm < -13.0 && kept < 2;
    for (name, (found, said)) in [
        ("one press", calibrated(one_place)),
        ("two presses", calibrated(two_places)),
    ] {
        assert!(!said.is_empty(), "{name}: nothing is said: {found:?}");
        let smaller = found.is_none_or(|f| f.model != CalibrationModel::Full);
        assert!(smaller, "{name}: {said}");
    }
}

#[test]
fn presses_on_one_line_or_repeated_at_two_places_are_reported() {
    // Five places on the line x = -14.
    let (on_a_line, said) = calibrated(|at, _| at.x_mm < -13.0);
    let found = format!("{on_a_line:?} {said}");
    assert!(
        said.contains("calibrat") || on_a_line.is_none_or(|c| c.model != CalibrationModel::Full),
        "{found}"
    );
}
