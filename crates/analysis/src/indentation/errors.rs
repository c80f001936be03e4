//! Owns the errors of an estimated quantity: over all presses and by planned depth, with intervals over locations.

use skinrig_model::AnalysisSettings;

use crate::metrics::{mean_over_locations, rms_over_locations, share_over_locations};
use crate::result::{Estimate, Quantity, QuantityAtDepth, QuantityErrors, Ranged};

/// A press with estimate and measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub location: u32,
    /// Planned depth, mm.
    pub depth_mm: f64,
    pub estimate: Ranged,
    pub measured: f64,
}

/// Errors at scored presses and at left-out locations.
pub(super) fn quantity(
    scored: &[Row],
    left_out: &[Row],
    taught_by: u32,
    settings: &AnalysisSettings,
) -> Quantity {
    let mut depths: Vec<f64> = scored.iter().chain(left_out).map(|r| r.depth_mm).collect();
    depths.sort_by(f64::total_cmp);
    depths.dedup();
    let at = |rows: &[Row], depth_mm: f64| {
        let own: Vec<Row> = rows
            .iter()
            .filter(|r| r.depth_mm == depth_mm)
            .copied()
            .collect();
        errors(&own, settings)
    };
    let each = depths.into_iter().map(|depth_mm| QuantityAtDepth {
        depth_mm,
        scored: at(scored, depth_mm),
        left_out: at(left_out, depth_mm),
    });
    Quantity {
        scored: errors(scored, settings),
        left_out: errors(left_out, settings),
        depths: each.collect(),
        taught_by,
    }
}

fn errors(rows: &[Row], settings: &AnalysisSettings) -> QuantityErrors {
    let numbers = |of: &dyn Fn(&Row) -> f64, estimate: fn(&[(u32, f64)], u32, u64) -> Estimate| {
        let values: Vec<(u32, f64)> = rows.iter().map(|r| (r.location, of(r))).collect();
        estimate(&values, settings.bootstrap_resamples, settings.seed)
    };
    let error = |r: &Row| r.estimate.value - r.measured;
    let each = rows.iter();
    let inside: Vec<(u32, bool)> = each
        .filter_map(|r| {
            let [low, high] = r.estimate.interval?;
            Some((r.location, low <= r.measured && r.measured <= high))
        })
        .collect();
    QuantityErrors {
        rmse: numbers(&error, rms_over_locations),
        bias: numbers(&error, mean_over_locations),
        relative_percent: numbers(&|r| 100.0 * error(r) / r.measured, rms_over_locations),
        covered: share_over_locations(&inside, settings.bootstrap_resamples, settings.seed),
    }
}
