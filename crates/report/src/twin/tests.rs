//! Texts and page of a twin, and of a session without one.

use skinrig_compare::twin::{PlaceErrors, TwinConstant};
use skinrig_model::{LocationId, Point2};

use super::*;

const fn interval(middle: f64, low: f64, high: f64) -> Interval {
    Interval { middle, low, high }
}

fn fit(figure: CalibrationFigure, session: f64, expected: Interval, deviations: f64) -> FigureFit {
    FigureFit {
        figure,
        session,
        expected,
        deviations,
    }
}

fn place(location: u32, scored_mm: Option<f64>) -> PlaceErrors {
    PlaceErrors {
        location: LocationId::from_index(location),
        at: Point2::new(f64::from(location), 2.0),
        calibration_mm: Some(0.5),
        response_per_s: Some(1e4),
        region_mm: Some(1.2),
        scored_mm,
    }
}

fn found(farther: u32) -> SessionTwin {
    let constant = |constant, middle, explained| ConstantFit {
        constant,
        value: interval(middle, 0.5 * middle, 1.5 * middle),
        explained,
        draws: (1..100).map(|k| f64::from(k) / 100.0).collect(),
    };
    let mut found = SessionTwin {
        session: "here.session.sqlite".to_owned(),
        origin: "bench".to_owned(),
        protocol: None,
        changed: vec!["depth=3mm".to_owned()],
        seeds: (1..=98).collect(),
        failed: vec![(7, "its analysis is INVALID".to_owned())],
        twin: Twin {
            skins: 97,
            left_out: 1,
            farther,
            figures: vec![
                fit(
                    CalibrationFigure::Events(SessionFigure::PressRate),
                    21_000.0,
                    interval(23_000.0, 11_000.0, 47_000.0),
                    -0.2,
                ),
                fit(CalibrationFigure::Weak, 0.4, interval(0.1, 0.02, 0.2), 4.2),
                fit(
                    CalibrationFigure::LeftOut,
                    1.345,
                    interval(1.3, 1.2, 1.4),
                    0.7,
                ),
            ],
            constants: vec![
                constant(TwinConstant::LightLoss, 0.8, 0.76),
                constant(TwinConstant::PressScatter, 0.6, 0.52),
                constant(TwinConstant::DepthScatter, 15.0, 0.02),
            ],
            outcomes: vec![
                OutcomePrediction {
                    figure: SessionFigure::Rmse,
                    predicted: Some(interval(1.4, 0.8, 2.6)),
                    recorded: Some(1.36),
                    changed: Some(interval(1.1, 0.6, 2.0)),
                },
                OutcomePrediction {
                    figure: SessionFigure::RepeatStd,
                    predicted: Some(interval(0.8, 0.2, 1.5)),
                    recorded: Some(1.7),
                    changed: None,
                },
                OutcomePrediction {
                    figure: SessionFigure::Located,
                    predicted: None,
                    recorded: None,
                    changed: None,
                },
            ],
            places: Some(PlacePrediction {
                places: vec![place(1, Some(0.4)), place(2, Some(0.9)), place(3, None)],
                predicted_mm: vec![Some(0.5), Some(0.8), Some(0.6)],
                correlation: Some(0.62),
                usual: Some(interval(0.55, 0.1, 0.8)),
            }),
        },
    };
    if farther == 0 {
        // Nothing is predicted of a session unlike the skins.
        found.twin.constants.clear();
        found.twin.outcomes.clear();
        found.twin.places = None;
    }
    found
}

#[test]
fn predictions_come_first_and_the_rest_on_request() {
    let found = found(12);
    assert_eq!(found.held(), (1, 2));
    let text = terminal_text(&found, false);
    insta::assert_snapshot!(text);
    assert!(text.lines().count() <= 9, "{text}");
    assert!(text.lines().all(|l| l.chars().count() <= 130), "{text}");
    insta::assert_snapshot!(terminal_text(&found, true));
}

#[test]
fn a_session_without_a_twin_says_why_before_any_number() {
    let text = terminal_text(&found(0), false);
    insta::assert_snapshot!(text);
    let page = page(&found(0));
    assert!(page.contains("No twin") && page.contains("Nothing is predicted"));
    assert!(!page.contains("Scored presses, recorded and predicted"));
    assert!(!super::page(&found(1)).contains("Nothing is predicted"));
}

#[test]
fn the_page_holds_tables_figures_and_data() {
    let page = page(&found(12));
    for expected in [
        "Scored presses, recorded and predicted",
        "Constants of the twin",
        "Errors by place",
        "depth=3mm",
        "scene.skin.press_scatter (mm)",
        "not shown",
        "\"predicted_mm\"",
    ] {
        assert!(page.contains(expected), "{expected}");
    }
}

#[test]
fn a_session_without_scored_presses_is_not_compared() {
    let mut found = found(3);
    for row in &mut found.twin.outcomes {
        row.recorded = None;
    }
    found.twin.places.as_mut().unwrap().correlation = None;
    let text = terminal_text(&found, false);
    assert!(
        text.contains("without scored presses to compare with"),
        "{text}"
    );
}
