//! Slow drift within the reference nights, which the rules for runs cannot see: the reference would follow it.
//!
//! Rank test of H. B. Mann (Econometrica 13 (1945) 245-259) with the variance for ties of M. G. Kendall (Rank Correlation Methods, 1948),
//! for nights that resemble their neighbours inflated as for a first-order autoregressive series of the same correlation; slope of
//! P. K. Sen (Journal of the American Statistical Association 63 (1968) 1379-1389).

use skinrig_model::quantile;

use super::chart::Direction;
use super::reference::{MIN_NIGHTS, Reference, Sample};

/// Nights below which no drift is sought: a shorter reference is not better known than its slope.
const NIGHTS: usize = 2 * MIN_NIGHTS;
/// Limit of the test's normal score. The same nights are tested again with each night that joins (false alarms: `docs/reference/nightly.md`).
const LIMIT: f64 = 4.0;
/// What a slope that is removed takes from the correlation, times the number of nights: (1 + 4r)/n for a first-order autoregressive
/// series (M. G. Kendall, Biometrika 41 (1954) 403-404), 1/n of which the reference adds; 4r is 2 for r = 0.5.
const LOST_CORRELATION: f64 = 2.0;
/// Upper bound of the correlation.
const MAX_CORRELATION: f64 = 0.9;
/// Smallest drift over all nights that counts, in spreads of the nights about their slope: as for the quick rule.
const MIN_DRIFT: f64 = 2.0;

/// Direction in which `samples`, in order of the nights, drift; `None`: they do not, or are too few to tell. `counts` as for [`Reference::of`].
pub(super) fn direction(samples: &[Sample], counts: bool) -> Option<Direction> {
    let n = samples.len() as f64;
    let score = rank_score(samples);
    // Independent nights score highest, and most series do not drift: the slope is dear.
    if samples.len() < NIGHTS || score.abs() <= LIMIT {
        return None;
    }
    let slope = slope(samples)?;
    let level: Vec<Sample> = samples
        .iter()
        .zip(0u32..)
        .map(|(s, night)| Sample {
            value: s.value - slope * f64::from(night),
            ..*s
        })
        .collect();
    let level = Reference::of(&level, counts)?;
    let r = (level.correlation + LOST_CORRELATION / n).min(MAX_CORRELATION);
    let is_certain = score.abs() > LIMIT * ((1.0 + r) / (1.0 - r)).sqrt();
    let is_large = slope.abs() * (n - 1.0) >= MIN_DRIFT * level.below.max(level.above);
    (is_certain && is_large).then_some(if score > 0.0 {
        Direction::Up
    } else {
        Direction::Down
    })
}

/// Median of the slopes of all pairs of nights.
fn slope(samples: &[Sample]) -> Option<f64> {
    let mut slopes: Vec<f64> = pairs(samples)
        .map(|(earlier, later, apart)| (later - earlier) / apart)
        .collect();
    slopes.sort_by(f64::total_cmp);
    quantile(&slopes, 0.5)
}

/// Standardised number of pairs of nights that rise minus those that fall, for independent nights.
fn rank_score(samples: &[Sample]) -> f64 {
    let sign = |(earlier, later, _): (f64, f64, f64)| match later.total_cmp(&earlier) {
        _ if later == earlier => 0.0,
        std::cmp::Ordering::Less => -1.0,
        _ => 1.0,
    };
    let sum: f64 = pairs(samples).map(sign).sum();
    let mut sorted: Vec<f64> = samples.iter().map(|s| s.value).collect();
    sorted.sort_by(f64::total_cmp);
    let variance = |n: usize| (n * (n - 1) * (2 * n + 5)) as f64 / 18.0;
    let ties: f64 = sorted
        .chunk_by(|a, b| a == b)
        .map(|tied| variance(tied.len()))
        .sum();
    let variance = variance(samples.len()) - ties;
    if variance > 0.0 {
        (sum - sum.signum()) / variance.sqrt()
    } else {
        0.0
    }
}

/// Earlier value, later value and distance of all pairs of nights.
fn pairs(samples: &[Sample]) -> impl Iterator<Item = (f64, f64, f64)> {
    samples.iter().enumerate().flat_map(move |(at, earlier)| {
        let later = samples[at + 1..].iter().zip(1u32..);
        later.map(move |(later, apart)| (earlier.value, later.value, f64::from(apart)))
    })
}
