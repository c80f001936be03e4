//! Choice of the threshold.

use rayon::prelude::*;

use skinrig_model::ThresholdGrid;

use super::trial::{Detector, Trial};
use crate::metrics::quantile;
use crate::result::ThresholdRow;

/// Evenly spaced thresholds, both ends included; only the first if one is requested.
#[must_use]
pub fn thresholds(grid: ThresholdGrid) -> Vec<f64> {
    let ThresholdGrid {
        from: first,
        to: last,
        count,
    } = grid;
    let steps = f64::from(count.max(2) - 1);
    let at = |i: u32| first + (last - first) * f64::from(i) / steps;
    (0..count).map(at).collect()
}

/// Statistics of the onsets around their median.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnsetStatistics {
    /// Number of onsets, none of them before contact.
    pub onsets: u32,
    /// Median onset, ms.
    pub median_ms: Option<f64>,
    /// Number of counting onsets: within the window around the median, both ends included.
    pub count: u32,
    /// 95th minus 5th percentile of the counting onsets, ms; `None` if there are none, for instance if two onsets are
    /// further apart than two windows.
    pub width_ms: Option<f64>,
}

impl OnsetStatistics {
    /// Computes the statistics; the onsets may be in any order.
    #[must_use]
    pub fn of(mut onsets_ms: Vec<f64>, window_ms: f64) -> Self {
        let onsets = onsets_ms.len() as u32;
        let median_ms = quantile(&mut onsets_ms, 0.5);
        if let Some(median) = median_ms {
            onsets_ms.retain(|t| (t - median).abs() <= window_ms);
        }
        let mut at = |q| quantile(&mut onsets_ms, q);
        let width_ms = at(0.95).zip(at(0.05)).map(|(high, low)| high - low);
        Self {
            onsets,
            median_ms,
            count: onsets_ms.len() as u32,
            width_ms,
        }
    }
}

/// False alarms of all trials at the threshold with this index, and the time at risk, s.
#[must_use]
pub fn false_alarms(trials: &[Trial], index: usize) -> (u32, f64) {
    let searches = || trials.iter().map(|t| t.searches[index]);
    let alarms = searches().filter(|s| s.false_alarm_ms().is_some()).count();
    (alarms as u32, searches().map(|s| s.at_risk_s).sum())
}

/// One row per threshold of `detector`; none without trials.
#[must_use]
pub fn sweep(trials: &[Trial], detector: &Detector, window_ms: f64) -> Vec<ThresholdRow> {
    if trials.is_empty() {
        return Vec::new();
    }
    let rows = detector.thresholds.par_iter().enumerate();
    rows.map(|(i, &threshold)| {
        let onsets = trials.iter().filter_map(|t| t.searches[i].onset_ms());
        let hits = OnsetStatistics::of(onsets.collect(), window_ms);
        let (false_alarms, at_risk_s) = false_alarms(trials, i);
        ThresholdRow {
            threshold,
            onsets: hits.onsets,
            detected_rate: f64::from(hits.count) / trials.len() as f64,
            median_ms: hits.median_ms,
            width_ms: hits.width_ms,
            false_alarms,
            at_risk_s,
            // Without time at risk there are no alarms.
            false_alarms_per_s: if at_risk_s > 0.0 {
                f64::from(false_alarms) / at_risk_s
            } else {
                0.0
            },
        }
    })
    .collect()
}

/// The row with the fewest false alarms per second among those that detect at least `target_rate`; if none does, among those
/// that detect most. Ties go to the lowest threshold; `None` if nothing is detected at any.
#[must_use]
pub fn choose(rows: &[ThresholdRow], target_rate: f64) -> Option<usize> {
    let candidates = || {
        rows.iter()
            .enumerate()
            .filter(|(_, r)| r.detected_rate > 0.0)
    };
    let best = candidates().map(|(_, r)| r.detected_rate);
    let required = target_rate.min(best.fold(0.0, f64::max));
    candidates()
        .filter(|(_, r)| r.detected_rate >= required)
        .min_by(|(_, a), (_, b)| a.false_alarms_per_s.total_cmp(&b.false_alarms_per_s))
        .map(|(i, _)| i)
}
