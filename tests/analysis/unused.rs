//! Settings that others make useless, against what an analysis does with them.

use serde_json::{Value, json};
use skinrig_analysis::analyze;
use skinrig_analysis::result::{Analysis, WarningCause};
use skinrig_model::{AnalysisSettings, CalibrationModel, Estimator};
use skinrig_planted::grid::session;

/// Settings by field, each with a value that changes much.
fn changes() -> Vec<(&'static str, Value)> {
    vec![
        ("window_before_ms", json!(5.0)),
        ("window_after_ms", json!(5.0)),
        ("window_after_contact_ms", json!(60.0)),
        ("window_after_depth_ms", json!(1.0)),
        ("eps_px", json!(3.0)),
        ("min_samples", json!(60)),
        ("background_margin", json!(60.0)),
        ("centroid", json!("all_clusters")),
        ("precision", json!("f32")),
        ("forget_ms", json!(1.0)),
        ("thinning", json!(2)),
        ("bin_px", json!(16)),
        ("cluster_threshold", json!("fixed")),
        ("min_cluster_events", json!(200)),
        ("lens", json!("rectilinear")),
        ("locator", json!("geometry")),
    ]
}

fn with(settings: &AnalysisSettings, field: &str, value: &Value) -> AnalysisSettings {
    let mut all =
        serde_json::to_value(settings).expect("plain data and a session that can be analysed");
    all[field] = value.clone();
    serde_json::from_value(all).expect("plain data and a session that can be analysed")
}

fn analysis_of(settings: AnalysisSettings) -> Analysis {
    let (mut input, source) = session();
    input.settings = settings;
    analyze(&input, &source).expect("plain data and a session that can be analysed")
}

/// Each estimate and each interval of them, without the studies: the reduction study has a method of its own.
fn results(mut analysis: Analysis) -> Value {
    analysis.settings = AnalysisSettings::default();
    analysis.warnings.clear();
    analysis.reduction = None;
    serde_json::to_value(&analysis).expect("plain data and a session that can be analysed")
}

#[test]
fn a_setting_is_said_to_be_unused_exactly_if_it_changes_no_estimate() {
    let mut usual = session().0.settings;
    usual.reduction.max_power = 0;
    // Several clusters per press.
    usual.background_margin = 0.0;
    usual.min_samples = 3;
    usual.eps_px = 2.0;
    let said = |analysis: &Analysis| -> Vec<String> {
        let causes = analysis.warnings.iter().map(|w| &w.cause);
        causes
            .filter_map(|cause| match cause {
                WarningCause::UnusedSetting { key, .. } => Some(key.clone()),
                _ => None,
            })
            .collect()
    };
    for (field, value) in [
        ("estimator", json!("dbscan")),
        ("estimator", json!("column_median")),
        ("estimator", json!("histogram_peak")),
        ("estimator", json!("streaming")),
        ("calibration", json!("none")),
    ] {
        let mode = with(&usual, field, &value);
        let base = results(analysis_of(mode.clone()));
        for (changed, to) in changes() {
            let other = analysis_of(with(&mode, changed, &to));
            let key = changed.trim_end_matches("_ms").trim_end_matches("_px");
            let key = format!("analysis.{key}");
            let is_said = said(&other).contains(&key);
            assert_eq!(
                results(other) == base,
                is_said,
                "{changed} with {field}={value}"
            );
        }
    }
}

/// Windows about the middle hold few events of these presses: only what ends them is tried.
#[test]
fn a_window_about_the_middle_does_not_end_after_the_depth() {
    let usual = AnalysisSettings::default();
    let depth = with(&usual, "window_after_depth_ms", &json!(1.0));
    assert_ne!(
        results(analysis_of(depth.clone())),
        results(analysis_of(usual.clone()))
    );
    let middle = analysis_of(with(&depth, "window_anchor", &json!("middle")));
    let warned = middle.warnings.iter().map(|w| w.to_string());
    assert!(warned.into_iter().any(|w| w.starts_with(
        "analysis.window_after_depth changes no estimate: analysis.window_anchor=middle"
    )));
    let without = analysis_of(with(&usual, "window_anchor", &json!("middle")));
    assert_eq!(results(middle), results(without));
}

#[test]
fn unchanged_settings_are_not_said_to_be_unused() {
    let settings = AnalysisSettings {
        estimator: Estimator::ColumnMedian,
        calibration: CalibrationModel::None,
        ..AnalysisSettings::default()
    };
    let warnings = analysis_of(settings).warnings;
    let unused = |w: &&skinrig_analysis::result::Warning| {
        matches!(w.cause, WarningCause::UnusedSetting { .. })
    };
    assert_eq!(warnings.iter().filter(unused).count(), 0, "{warnings:?}");
}
