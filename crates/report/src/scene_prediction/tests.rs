//! Texts and page of a session whose scene is partly wrong.

use skinrig_compare::scene::{Predicted, SessionFigure};

use super::*;

fn row(
    figure: SessionFigure,
    session: Option<f64>,
    predicted: Option<[f64; 5]>,
) -> FigurePrediction {
    FigurePrediction {
        figure,
        session,
        replicates: 20,
        predicted: predicted.map(|[middle, low, high, p, deviations]| Predicted {
            middle,
            low,
            high,
            p: session.map(|_| p),
            deviations: session.map(|_| deviations),
        }),
    }
}

fn found() -> ScenePrediction {
    ScenePrediction {
        session: "here.session.sqlite".to_owned(),
        origin: "simulated (optical)".to_owned(),
        scene: "optical".to_owned(),
        changed: vec!["analysis.min_samples=5".to_owned()],
        seeds: (1..=20).collect(),
        failed: vec![(21, "no presses".to_owned())],
        figures: vec![
            row(
                SessionFigure::PressRate,
                Some(41_234.0),
                Some([40_000.0, 38_000.0, 42_000.0, 0.8, 1.2]),
            ),
            row(
                SessionFigure::Fading,
                Some(0.099),
                Some([0.258, 0.249, 0.267, 0.000_2, -39.5]),
            ),
            row(
                SessionFigure::Rmse,
                Some(0.41),
                Some([0.5, 0.45, 0.56, 0.04, -3.1]),
            ),
            row(
                SessionFigure::Width,
                None,
                Some([31.0, 30.0, 32.0, 1.0, 0.0]),
            ),
            row(SessionFigure::RepeatStd, Some(0.2), None),
        ],
    }
}

#[test]
fn the_answer_comes_first_and_the_least_probable_figure_leads() {
    let found = found();
    assert_eq!(found.compared(), 3);
    let text = terminal_text(&found, false);
    insta::assert_snapshot!(text);
    assert!(text.lines().all(|l| l.chars().count() <= 120), "{text}");
}

#[test]
fn all_figures_have_a_row() {
    insta::assert_snapshot!(terminal_text(&found(), true));
}

#[test]
fn a_session_like_its_scene_says_so() {
    let mut found = found();
    found.figures.truncate(1);
    found.failed.clear();
    assert_eq!(
        found.verdict(),
        "as predicted: 1 figure agrees with 20 simulated sessions"
    );
    assert!(found.differing().is_empty());
    found.figures.clear();
    assert!(found.verdict().starts_with("nothing could be compared"));
}

#[test]
fn the_page_names_what_differs() {
    let mut found = found();
    found.session = "<b>".to_owned();
    let html = page(&found);
    for part in [
        "&lt;b&gt;",
        "2 of 3 figures are not as 20 simulated sessions predict",
        "Relaxes slower or less than modelled",
        "figure-deviations",
        "Figures of the session and of the simulated sessions",
        "could not be analysed",
    ] {
        assert!(html.contains(part), "{part}");
    }
    assert!(!html.contains("<b>\""));
}
