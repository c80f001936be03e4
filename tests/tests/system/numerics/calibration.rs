//! Calibration presses that do not determine the parameters: too few, at too few locations, or on a line through a camera.

use skinrig_analysis::analyze;
use skinrig_analysis::calibrate::{ModelChoice, choose};
use skinrig_analysis::result::{CalibrationResult, Warning, WarningCause};
use skinrig_analysis::sets::CalibrationSet;
use skinrig_model::{AnalysisSettings, CalibrationModel, Point2, PressRole, StereoGeometry};

use crate::numerics::hostile::holds_only_numbers;
use skinrig_planted::grid::{PLANTED, session};

/// The planted session; `calibrate` selects its calibration presses, and the full model is requested.
fn calibrated(
    calibrate: impl Fn(Point2, usize) -> bool,
) -> (Option<CalibrationResult>, Vec<Warning>) {
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
    (a.calibration, a.warnings)
}

#[test]
fn enough_places_give_the_model_that_was_asked_for() {
    let (found, warnings) = calibrated(|_, _| true);
    assert_eq!(found.unwrap().model, CalibrationModel::Full, "{warnings:?}");
}

#[test]
fn presses_that_do_not_determine_the_parameters_are_reported() {
    let centre = Point2::new(8.0, 2.0);
    let one_place = |at: Point2, _: usize| at == centre;
    let two_places = |at: Point2, kept: usize| at.x_mm < -13.0 && kept < 2;
    for (name, (found, warnings)) in [
        ("one press", calibrated(one_place)),
        ("two presses", calibrated(two_places)),
    ] {
        assert!(!warnings.is_empty(), "{name}: nothing is said: {found:?}");
        let smaller = found.is_none_or(|f| f.model != CalibrationModel::Full);
        assert!(smaller, "{name}: {warnings:?}");
    }
}

/// Model choice for exact views of `places`, each a separate location of the plan; the full model is requested.
fn chosen(places: &[Point2]) -> ModelChoice {
    let (input, source) = session();
    let mut presses = analyze(&input, &source).unwrap().presses;
    presses.retain(|p| p.role == PressRole::Calibrate);
    presses.truncate(places.len());
    assert_eq!(presses.len(), places.len());
    let planted = StereoGeometry::paper_like(PLANTED);
    for (press, at) in presses.iter_mut().zip(places) {
        press.truth = Some(*at);
        for (view, camera) in press.views.iter_mut().zip(planted.cameras) {
            view.as_mut().unwrap().centroid_u = Some(camera.column_of_point(*at).unwrap());
        }
    }
    let settings = AnalysisSettings {
        calibration: CalibrationModel::Full,
        bootstrap_resamples: 20,
        ..input.settings
    };
    choose(
        &CalibrationSet::from_presses(&presses),
        &StereoGeometry::PAPER,
        &settings,
    )
}

/// `n` equidistant positions, including the ends.
fn along(from: [f64; 2], to: [f64; 2], n: u32) -> Vec<Point2> {
    let at = |t: f64, axis: usize| from[axis] + (to[axis] - from[axis]) * t;
    (0..n)
        .map(|i| f64::from(i) / f64::from(n - 1))
        .map(|t| Point2::new(at(t, 0), at(t, 1)))
        .collect()
}

const TOO_FEW_FOR_FULL: WarningCause = WarningCause::FewLocationsForModel {
    wanted: CalibrationModel::Full,
    used: CalibrationModel::Positions,
};

/// A row of the planted session with too few locations.
#[test]
fn five_places_on_one_line_give_the_positions() {
    let (found, warnings) = calibrated(|at, _| at.x_mm < -13.0);
    let found = found.unwrap();
    assert_eq!(
        (found.model, found.rank, found.n),
        (CalibrationModel::Positions, 4, 5)
    );
    // Scored locations far from the line may be worse, which gives another warning.
    assert_eq!(warnings[0].cause, TOO_FEW_FOR_FULL);
}

/// The angles of eight positions suffice even on one line: the positions are known, and a camera beside their line sees each
/// at another angle.
#[test]
fn eight_places_on_a_line_beside_the_cameras_determine_eight_parameters() {
    for (from, to) in [([-5.0, -20.0], [-5.0, 20.0]), ([-14.0, -5.0], [26.0, -5.0])] {
        let found = chosen(&along(from, to, 8));
        assert_eq!(found.warnings, []);
        let result = found.calibration.unwrap();
        assert_eq!((result.model, result.rank), (CalibrationModel::Full, 8));
        for (value, planted) in result.values.iter().zip(PLANTED) {
            assert!((value - planted).abs() < 1e-6, "{:?}", result.values);
        }
    }
}

/// A camera that looks along the line sees all positions in one column.
#[test]
fn a_line_through_a_camera_leaves_its_parameters_open() {
    let camera = [PLANTED[2], PLANTED[3]];
    let places = along([-14.0, -14.0], camera, 26);
    let found = chosen(&places[..20]);
    let result = found.calibration.unwrap();
    // That column determines one angle and one offset of four parameters.
    assert_eq!((result.model, result.rank), (CalibrationModel::Full, 6));
    assert_eq!(
        found.warnings,
        [WarningCause::OpenParameters {
            determined: 6,
            parameters: 8,
            model: CalibrationModel::Full,
            open: vec![
                "camera 2 x (mm)".to_owned(),
                "camera 2 y (mm)".to_owned(),
                "camera 2 skew (deg)".to_owned(),
                "camera 2 distortion W (1)".to_owned(),
            ],
        }
        .into()]
    );
}

/// Repeated presses determine no more parameters than a single press per location.
#[test]
fn repeated_presses_count_as_one_place() {
    let corners = [[-14.0, -20.0], [30.0, 24.0], [-14.0, 24.0], [30.0, -20.0]];
    let corners = corners.map(|[x, y]| Point2::new(x, y));

    let two = chosen(&corners[..2].repeat(10));
    assert_eq!(two.calibration, None);
    assert_eq!(two.geometry, StereoGeometry::PAPER);
    assert_eq!(
        two.warnings,
        [WarningCause::FewLocationsForAny { locations: 2 }.into()]
    );

    let four = chosen(&corners.repeat(5));
    let result = four.calibration.unwrap();
    assert_eq!(
        (result.model, result.rank, result.n),
        (CalibrationModel::Positions, 4, 20)
    );
    assert_eq!(four.warnings, [TOO_FEW_FOR_FULL.into()]);
}

/// Same via the plan: both repetitions of two locations calibrate, eight residuals for eight parameters.
#[test]
fn two_places_pressed_twice_calibrate_nothing() {
    let (mut input, source) = session();
    input.settings.calibration = CalibrationModel::Full;
    input.settings.bootstrap_resamples = 20;
    input.settings.study_presses = 0;
    for planned in &mut input.planned {
        if planned.role != PressRole::Sync {
            let first = planned.location.index() < 2;
            planned.role = if first {
                PressRole::Calibrate
            } else {
                PressRole::Score
            };
        }
    }
    let a = analyze(&input, &source).unwrap();
    let usable = CalibrationSet::from_presses(&a.presses);
    assert_eq!(usable.sights().len(), 4);
    assert_eq!(a.calibration, None);
    let expected = WarningCause::FewLocationsForAny { locations: 2 }.into();
    assert!(a.warnings.contains(&expected), "{:?}", a.warnings);
}
