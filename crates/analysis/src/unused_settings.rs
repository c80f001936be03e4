//! Owns the settings that change no estimate, because others make them useless.

use skinrig_model::{AnalysisSettings, CalibrationModel, Estimator, Precision, WindowAnchor};
use skinrig_settings::Choice as _;

use crate::result::{Warning, WarningCause};

/// A warning for each setting that was changed from its default and changes no estimate with the others.
pub(crate) fn unused_settings(settings: &AnalysisSettings) -> impl Iterator<Item = Warning> {
    let usual = AnalysisSettings::default();
    let s = settings;
    let clusters = s.estimator == Estimator::Dbscan;
    let smooths = clusters || s.estimator == Estimator::HistogramPeak;
    let counts = matches!(s.estimator, Estimator::Dbscan | Estimator::ColumnMedian);
    let estimator = ("analysis.estimator", s.estimator.word());
    let anchor = ("analysis.window_anchor", s.window_anchor.word());
    let calibration = ("analysis.calibration", s.calibration.word());
    let rules = [
        ("eps", s.eps_px != usual.eps_px && !smooths, estimator),
        (
            "min_samples",
            s.min_samples != usual.min_samples && !clusters,
            estimator,
        ),
        (
            "background_margin",
            s.background_margin != usual.background_margin && !clusters,
            estimator,
        ),
        (
            "centroid",
            s.centroid != usual.centroid && !clusters,
            estimator,
        ),
        (
            "precision",
            s.precision != Precision::default() && counts,
            estimator,
        ),
        (
            "forget",
            s.forget_ms != usual.forget_ms && s.estimator != Estimator::Streaming,
            estimator,
        ),
        (
            "window_after_depth",
            s.window_after_depth_ms != usual.window_after_depth_ms
                && s.window_anchor == WindowAnchor::Middle,
            anchor,
        ),
        (
            "lens",
            s.lens != usual.lens && s.calibration == CalibrationModel::None,
            calibration,
        ),
    ];
    let unused = rules.into_iter().filter(|(_, is_unused, _)| *is_unused);
    unused.map(|(key, _, (other, value))| {
        WarningCause::UnusedSetting {
            key: format!("analysis.{key}"),
            because: format!("{other}={value}"),
        }
        .into()
    })
}
