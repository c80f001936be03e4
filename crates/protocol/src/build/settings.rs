//! The keys of `analysis` as settings of the analysis.

use skinrig_model::{AnalysisSettings, CalibrationModel, CentroidRule};

use crate::diagnostic::Collector;
use crate::shape::Field;

/// The settings that `f`, a mapping of the table `analysis`, stands for.
pub(crate) fn analysis(f: &Field, out: &mut Collector) -> Option<AnalysisSettings> {
    let crop = f.get("crop")?;
    let mut rows = |key: &str| {
        let field = crop.get(key)?;
        let [first, last] = field.pair()?;
        for v in [first, last] {
            if v.fract() != 0.0 {
                out.error(field.span, field.path.as_str(), "not a whole row")
                    .expected("whole rows from 0 px to 479 px")
                    .found(format!("{v} px"));
                return None;
            }
        }
        if first > last {
            out.error(field.span, field.path.as_str(), "no rows are left")
                .expected("the first row at or above the last")
                .found(format!("{first} px to {last} px"));
            return None;
        }
        Some((first as u16, last as u16))
    };
    let crop_v = [rows("camera1"), rows("camera2")];
    let [Some(one), Some(two)] = crop_v else {
        return None;
    };
    Some(AnalysisSettings {
        crop_v: [one, two],
        window_before_ms: milliseconds(f.quantity("window_before")?),
        window_after_ms: milliseconds(f.quantity("window_after")?),
        eps_px: f.quantity("eps")?,
        min_samples: f.count("min_samples")?,
        centroid: match f.word("centroid")? {
            "all_clusters" => CentroidRule::AllClusters,
            _ => CentroidRule::LargestCluster,
        },
        min_cluster_events: f.count("min_cluster_events")?,
        min_response_sigma: f.number("min_response_sigma")?,
        min_ray_sine: f.number("min_ray_sine")?,
        exclude_outside: f.flag("exclude_outside")?,
        calibration: match f.word("calibration")? {
            "none" => CalibrationModel::None,
            "positions" => CalibrationModel::Positions,
            "positions_skews" => CalibrationModel::PositionsSkews,
            "full" => CalibrationModel::Full,
            "full_scale" => CalibrationModel::FullScale,
            _ => CalibrationModel::Auto,
        },
        bootstrap_resamples: f.count("bootstrap_resamples")?,
        seed: f.whole("seed")?.unsigned_abs(),
        rate_bin_ms: milliseconds(f.quantity("rate_bin")?),
        ..AnalysisSettings::default()
    })
}

/// Seconds as milliseconds, without the last-bit noise of a factor (1 ns is far below what matters).
fn milliseconds(s: f64) -> f64 {
    (s * 1e9).round() / 1e6
}
