//! A comparison and a tradeoff on a terminal and as pages.

use std::collections::{BTreeMap, BTreeSet};

use skinrig_analysis::tradeoff::{Choice, Cost, Predictions, Region, Row, Tradeoff};
use skinrig_compare::{
    Comparison, ComparisonOptions, Metric, Session, SessionFacts, Subject, compare,
};
use skinrig_model::{
    CalibrationModel, CentroidRule, Estimator, Locator, Point2, Precision, PressRole,
};
use skinrig_report::compare as report;
use skinrig_report::tradeoff::{self, Rows};
use skinrig_statistics::AlphaSpending;

use crate::support::{self, studies::estimate};

/// A session of this skin, whose errors are `scale` times as large as drawn.
fn subject(letter: char, scale: f64, values: &[(&str, &str)]) -> Subject {
    let mut analysis = support::analysis(6, 4);
    for press in &mut analysis.presses {
        // Rows do not locate, but tell a recording from another.
        for view in press.views.iter_mut().flatten() {
            view.centroid_v = view.centroid_v.map(|v| v + 1e-9 * scale);
        }
        let truth = press.truth;
        if let (Some(truth), skinrig_analysis::result::LocationOutcome::Located { at, .. }) =
            (truth, &mut press.location_outcome)
        {
            let moved = |t: f64, e: f64| t + scale * (e - t);
            *at = Point2::new(moved(truth.x_mm, at.x_mm), moved(truth.y_mm, at.y_mm));
        }
    }
    assert!(analysis.presses.iter().any(|p| p.role == PressRole::Score));
    let values = values
        .iter()
        .map(|(k, v)| ((*k).to_owned(), (*v).to_owned()));
    let facts = SessionFacts {
        file: format!("{letter}.session.sqlite"),
        session_id: format!("{letter}1234567-89ab"),
        prototype: format!("<skin {letter}>"),
        started: "2026-03-02T14:05:09+01:00".to_owned(),
        rig_kind: "simulated".to_owned(),
        origin: Some("simulated".to_owned()),
        rig_name: "simulated (geometric)".to_owned(),
        values: values.collect::<BTreeMap<_, _>>(),
        docs: BTreeMap::new(),
        chunks: BTreeSet::new(),
    };
    Subject {
        letter,
        name: format!("<skin {letter}>"),
        sessions: vec![Session { facts, analysis }],
    }
}

fn comparison(margin_mm: Option<f64>) -> Comparison {
    compared(margin_mm, None)
}

fn compared(margin_mm: Option<f64>, sequential: Option<AlphaSpending>) -> Comparison {
    let a = [("protocol.motion.hold", "0.5 s"), ("camera1.serial", "1")];
    let b = [("protocol.motion.hold", "0.7 s"), ("camera1.serial", "2")];
    let subjects = [subject('A', 1.0, &a), subject('B', 1.6, &b)];
    let options = ComparisonOptions {
        margins: margin_mm.map(|mm| (Metric::Rmse, mm)).into_iter().collect(),
        limits: margin_mm.map(|_| "lab.limits.yaml".to_owned()),
        overrides: vec!["hold".to_owned(), "protocol.motion.hold".to_owned()],
        sequential,
        ..ComparisonOptions::default()
    };
    compare(&subjects, &vec![None], &options)
}

fn row(estimator: Estimator, window_ms: Option<f64>, rmse: f64, fronts: &[Cost]) -> Row {
    Row {
        choice: Choice {
            estimator,
            centroid: CentroidRule::LargestCluster,
            precision: Precision::F64,
            thinning: 1,
            bin_px: 1,
            window_ms,
            region: Region::Full,
        },
        rows: [(0, 479); 2],
        overrides: window_ms
            .map(|ms| ("analysis.window_end".to_owned(), format!("{ms} ms")))
            .into_iter()
            .collect(),
        rmse_mm: estimate(rmse, 0.2, 240),
        penalised_rmse_mm: estimate(rmse + 0.5, 0.3, 250),
        located_rate: estimate(0.96, 0.01, 250),
        within_rate: estimate(0.81, 0.02, 250),
        events_per_press: 9000.0,
        bytes_per_s: 75_300.0 / rmse,
        delay_ms: window_ms.unwrap_or(550.0),
        pixels: 640 * 480,
        cpu_us: 1234.0 / rmse,
        cpu_range_us: (1100.0 / rmse, 1500.0 / rmse),
        competes: !fronts.is_empty() || window_ms.is_none(),
        fronts: fronts.to_vec(),
    }
}

fn measured() -> Tradeoff {
    Tradeoff {
        is_interrupted: false,
        predictions: Predictions {
            combinations: 6930,
            ..Predictions::default()
        },
        settings: support::analysis(2, 2).settings,
        model: CalibrationModel::Auto,
        locator: Locator::Geometry,
        calibrating: (100, 120),
        scored: (240, 250),
        least_located: 0.95,
        timed_presses: 50,
        repeats: 3,
        press_s: 0.9,
        rows: vec![
            row(Estimator::Dbscan, None, 4.6, &[]),
            row(
                Estimator::ColumnMedian,
                Some(20.0),
                5.2,
                &[Cost::Cpu, Cost::Delay],
            ),
            row(Estimator::HistogramPeak, Some(5.0), 9.5, &[]),
            row(
                Estimator::Streaming,
                Some(100.0),
                4.1,
                &[Cost::Cpu, Cost::Bytes, Cost::Delay],
            ),
        ],
    }
}

/// Keeps a page for a look, in the folder that the variable names.
fn keep(name: &str, page: &str) -> std::io::Result<()> {
    match std::env::var_os("SKINRIG_REPORT_OUT") {
        Some(folder) => std::fs::write(std::path::Path::new(&folder).join(name), page),
        None => Ok(()),
    }
}

#[test]
fn a_comparison_on_a_terminal() {
    let plain = report::terminal_table(&comparison(Some(8.0)), false);
    for line in plain.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    insta::assert_snapshot!("comparison", plain);
    insta::assert_snapshot!(
        "comparison_without_margins",
        report::terminal_table(&comparison(None), false)
    );
}

#[test]
fn the_looks_of_a_sequential_comparison_on_a_terminal() {
    let planned = AlphaSpending {
        planned_looks: Some(3),
    };
    let text = report::terminal_table(&compared(None, Some(planned)), false);
    assert!(text.lines().all(|l| l.chars().count() <= 80), "{text}");
    insta::assert_snapshot!("sequential", text);
    let page = report::html(&compared(None, Some(planned)));
    assert!(page.contains("repetition 1"));
}

#[test]
fn the_page_of_a_comparison_has_the_verdict_first_and_names_as_text() {
    let page = report::html(&comparison(Some(8.0)));
    keep("comparison.html", &page).unwrap();
    assert!(!page.contains("<skin"));
    let at = |text: &str| page.find(text).unwrap_or_else(|| panic!("no {text}"));
    assert!(at("data-testid=\"verdict-B\"") < at("data-testid=\"comparability\""));
    assert!(at("data-testid=\"comparability\"") < at("data-testid=\"metrics-B\""));
    assert!(at("<tr data-metric=\"rmse\"") < at("data-testid=\"figure-maps-1\""));
    // Equal values are shown with a few digits.
    let fault = page.split("found the same difference (").nth(1).unwrap();
    let values = fault.split(')').next().unwrap();
    assert!(values.len() <= "25896.6457 - 25896.6457".len(), "{values}");
    keep("comparison-bare.html", &report::html(&comparison(None))).unwrap();
}

#[test]
fn a_tradeoff_on_a_terminal() {
    let table = |rows| tradeoff::terminal_table(&measured(), rows, "Rig: a\nb.", false);
    for line in table(Rows::All).lines() {
        assert!(line.chars().count() <= 100, "{line}");
    }
    insta::assert_snapshot!("tradeoff", table(Rows::All));
    assert_eq!(table(Rows::Front).matches("peak").count(), 0);
}

#[test]
fn the_page_of_a_tradeoff_has_every_choice_and_its_data() {
    let page = tradeoff::page(&measured(), "<session>", "Rig: r.");
    keep("tradeoff.html", &page).unwrap();
    assert!(!page.contains("<session>"));
    for part in [
        "data-testid=\"choices\"",
        "data-save=\"csv\"",
        "CPU, bytes, delay",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert_eq!(page.matches("<tr class=\"front\">").count(), 2);
    assert_eq!(page.matches("<tr class=\"out\">").count(), 1);
}
