//! The keys of `analysis` as settings of the analysis.

use skinrig_model::{
    AlignmentSettings, AnalysisSettings, Background, CalibrationModel, CentroidRule, CmreSettings,
    Estimator, LatencySettings, LensKind, Precision, PressId, ReducedLatencySettings,
    ReductionSettings, ThresholdRule, WindowAnchor,
};

use crate::shape::{Field, Keys, Value};
use skinrig_settings::Collector;

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
    let bin = f.get("bin")?;
    let bin_px = f.quantity("bin")?;
    if ![1.0, 2.0, 4.0, 8.0, 16.0].contains(&bin_px) {
        out.error(
            bin.span,
            bin.path.as_str(),
            "bins that do not divide the sensor",
        )
        .expected("1, 2, 4, 8 or 16 px")
        .found(format!("{bin_px} px"));
        return None;
    }
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
        window_anchor: match f.word("window_anchor")? {
            "middle" => WindowAnchor::Middle,
            _ => WindowAnchor::Touch,
        },
        cluster_threshold: match f.word("cluster_threshold")? {
            "fixed" => ThresholdRule::Fixed,
            _ => ThresholdRule::Calibrated,
        },
        estimator: match f.word("estimator")? {
            "column_median" => Estimator::ColumnMedian,
            "histogram_peak" => Estimator::HistogramPeak,
            "streaming" => Estimator::Streaming,
            _ => Estimator::Dbscan,
        },
        precision: match f.word("precision")? {
            "f32" => Precision::F32,
            _ => Precision::F64,
        },
        forget_ms: milliseconds(f.quantity("forget")?),
        thinning: f.count("thinning")?,
        bin_px: bin_px as u16,
        window_after_contact_ms: f.quantity("window_after_contact").map(milliseconds),
        min_cluster_events: f.count("min_cluster_events")?,
        min_response_sigma: f.number("min_response_sigma")?,
        min_ray_sine: f.number("min_ray_sine")?,
        exclude_outside: f.flag("exclude_outside")?,
        exclude_press_numbers: excluded(f, out)?,
        calibration: match f.word("calibration")? {
            "none" => CalibrationModel::None,
            "positions" => CalibrationModel::Positions,
            "positions_skews" => CalibrationModel::PositionsSkews,
            "full" => CalibrationModel::Full,
            "full_scale" => CalibrationModel::FullScale,
            _ => CalibrationModel::Auto,
        },
        lens: match f.word("lens")? {
            "equidistant" => LensKind::Equidistant,
            "rectilinear" => LensKind::Rectilinear,
            "stereographic" => LensKind::Stereographic,
            "equisolid" => LensKind::Equisolid,
            _ => LensKind::Exponential,
        },
        failure_penalty_mm: f.quantity("failure_penalty"),
        within_mm: f.quantity("within")?,
        bits_per_event: f.number("bits_per_event")?,
        study_presses: f.count("study_presses")?,
        reduction: reduction(f.get("reduction")?)?,
        latency: latency(f.get("latency")?, out)?,
        cmre: cmre(f.get("cmre")?)?,
        alignment: alignment(f.get("alignment")?)?,
        bootstrap_resamples: f.count("bootstrap_resamples")?,
        seed: f.whole("seed")?.unsigned_abs(),
        rate_bin_ms: milliseconds(f.quantity("rate_bin")?),
    })
}

/// Presses left out by hand: by number, counted from 1; in recordings of earlier versions by index, counted from 0.
fn excluded(f: &Field, out: &mut Collector) -> Option<Vec<PressId>> {
    let given = numbers(f.get("exclude_press_numbers")?)?.into_iter();
    let mut presses: Vec<PressId> = given.map(PressId::from_number).collect::<Option<_>>()?;
    let Some(list) = f.get("exclude_presses") else {
        return Some(presses);
    };
    let indices = numbers(list)?.into_iter();
    let recorded: Vec<PressId> = indices.map(PressId::from_index).collect();
    if !out.recorded {
        let same: Vec<String> = recorded.iter().map(|p| p.number().to_string()).collect();
        out.error(
            list.span,
            list.path.as_str(),
            "this key counts presses from 0",
        )
        .expected("`exclude_press_numbers`, which counts them from 1 as everything else does")
        .found("`exclude_presses` of earlier versions")
        .help(format!(
            "write `exclude_press_numbers: [{}]`",
            same.join(", ")
        ));
        return None;
    }
    presses.extend(recorded);
    Some(presses)
}

fn numbers(f: &Field) -> Option<Vec<u32>> {
    let number = |item: &Field| match item.value {
        Value::Whole(n) => u32::try_from(n).ok(),
        _ => None,
    };
    f.items().iter().map(number).collect()
}

fn reduction(f: &Field) -> Option<ReductionSettings> {
    Some(ReductionSettings {
        max_power: f.count("max_power")?,
        seeds: f.count("seeds")?,
        min_samples: f.count("min_samples")?,
    })
}

fn latency(f: &Field, out: &mut Collector) -> Option<LatencySettings> {
    let grid = f.get("thresholds")?;
    let reduced = f.get("reduced")?;
    let few = reduced.get("thresholds")?;
    let ranges = [threshold_range(grid, out), threshold_range(few, out)];
    let [Some(threshold_range), Some(few_range)] = ranges else {
        return None;
    };
    Some(LatencySettings {
        bin_ms: milliseconds(f.quantity("bin")?),
        sigma_ms: milliseconds(f.quantity("sigma")?),
        alpha: f.number("alpha")?,
        consecutive: f.count("consecutive")?,
        threshold_range,
        thresholds: grid.count("count")?,
        target_rate: f.number("target_rate")?,
        window_ms: milliseconds(f.quantity("window")?),
        background: match f.word("background")? {
            "after" => Background::After,
            _ => Background::Before,
        },
        reduced: ReducedLatencySettings {
            factor: reduced.count("factor")?,
            threshold_range: few_range,
            thresholds: few.count("count")?,
            target_rate: reduced.number("target_rate")?,
        },
    })
}

/// The ends of a grid of thresholds.
fn threshold_range(grid: &Field, out: &mut Collector) -> Option<(f64, f64)> {
    let (from, to) = (grid.number("from")?, grid.number("to")?);
    if from > to {
        out.error(grid.span, grid.path.as_str(), "no thresholds are left")
            .expected("the first threshold at or below the last")
            .found(format!("{from} to {to}"));
        return None;
    }
    Some((from, to))
}

fn cmre(f: &Field) -> Option<CmreSettings> {
    Some(CmreSettings {
        cell_mm: f.quantity("cell")?,
        sigma_mm: f.quantity("sigma")?,
        sr_mm: f.quantity("sr")?,
    })
}

fn alignment(f: &Field) -> Option<AlignmentSettings> {
    let microseconds = |key: &str| f.quantity(key).map(|s| (s * 1e9).round() / 1e3);
    Some(AlignmentSettings {
        max_residual_us: microseconds("max_residual")?,
        max_camera_interval_us: microseconds("max_camera_interval")?,
        max_host_interval_us: microseconds("max_host_interval")?,
        max_drift_ppm: f.number("max_drift")?,
        max_lost: f.number("max_lost")?,
        max_spurious: f.number("max_spurious")?,
        min_coverage: f.number("min_coverage")?,
        max_tie_distance_us: microseconds("max_tie_distance")?,
        robot_delay_us: microseconds("robot_delay")?,
        min_explained: f.number("min_explained")?,
        min_log_odds: f.number("min_log_odds")?,
    })
}

/// Seconds as milliseconds, without the last-bit noise of a factor (1 ns is far below what matters).
fn milliseconds(s: f64) -> f64 {
    (s * 1e9).round() / 1e6
}
