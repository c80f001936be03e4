//! The choice of the threshold.

use rayon::prelude::*;

use super::trial::{Detector, Trial};
use crate::metrics::quantile;
use crate::result::ThresholdRow;

/// Evenly spaced thresholds, both ends included; the first alone when one is asked for.
#[must_use]
pub fn thresholds((first, last): (f64, f64), count: u32) -> Vec<f64> {
    let steps = f64::from(count.max(2) - 1);
    let at = |i: u32| first + (last - first) * f64::from(i) / steps;
    (0..count).map(at).collect()
}

/// Onsets about their median.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hits {
    /// Onsets at all.
    pub onsets: u32,
    /// Their median, ms.
    pub median_ms: Option<f64>,
    /// Those within the window of the median, both ends included: the ones that count.
    pub count: u32,
    /// 95th minus 5th percentile of those that count, ms; `None` when none does, as when two onsets lie further apart
    /// than two windows.
    pub width_ms: Option<f64>,
}

impl Hits {
    /// Of these onsets, in any order.
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

/// Bins of a cool-down of one width; none without a width.
#[must_use]
pub fn cool_down(width_ms: Option<f64>, bin_ms: f64) -> usize {
    width_ms.map_or(0, |w| (w / bin_ms).round() as usize)
}

/// One row per threshold of `detector`; none without trials.
#[must_use]
pub fn sweep(trials: &[Trial], detector: &Detector, window_ms: f64) -> Vec<ThresholdRow> {
    if trials.is_empty() {
        return Vec::new();
    }
    let background_s: f64 = trials.iter().map(|t| t.background_s).sum();
    let rows = detector.thresholds.par_iter().enumerate();
    rows.map(|(i, &threshold)| {
        let onsets = trials.iter().filter_map(|t| t.onsets_ms[i]).collect();
        let hits = Hits::of(onsets, window_ms);
        let cool_down = cool_down(hits.width_ms, detector.bin_ms);
        let alarms: u64 = trials
            .iter()
            .map(|t| u64::from(t.alarms(i, threshold, cool_down)))
            .sum();
        ThresholdRow {
            threshold,
            onsets: hits.onsets,
            detected_rate: f64::from(hits.count) / trials.len() as f64,
            median_ms: hits.median_ms,
            width_ms: hits.width_ms,
            false_alarms_per_s: alarms as f64 / background_s,
        }
    })
    .collect()
}

/// The row with the fewest false alarms among those that detect at least `target_rate`; when none does, among those
/// that detect most. The lowest threshold of equals; `None` when nothing counts at any.
///
/// A row whose median onset is earlier than `earliest_ms` cannot be chosen: at a low threshold every trial trips over
/// its background soon after its start, and those onsets agree well with their own median.
#[must_use]
pub fn choose(rows: &[ThresholdRow], target_rate: f64, earliest_ms: f64) -> Option<usize> {
    let touches = |r: &ThresholdRow| {
        r.detected_rate > 0.0 && r.median_ms.is_some_and(|median| median >= earliest_ms)
    };
    let candidates = || rows.iter().enumerate().filter(|(_, r)| touches(r));
    let best = candidates().map(|(_, r)| r.detected_rate);
    let wanted = target_rate.min(best.fold(0.0, f64::max));
    candidates()
        .filter(|(_, r)| r.detected_rate >= wanted)
        .min_by(|(_, a), (_, b)| a.false_alarms_per_s.total_cmp(&b.false_alarms_per_s))
        .map(|(i, _)| i)
}
