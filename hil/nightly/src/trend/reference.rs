//! Reference of a series: robust centre and spread of its undisturbed nights.

use serde::Serialize;
use skinrig_model::quantile;

/// Minimum number of nights of a reference.
pub(crate) const MIN_NIGHTS: usize = 12;
/// Maximum number of nights of a reference. Later nights are only compared with it; otherwise the
/// reference would follow a slow drift.
pub(crate) const MAX_NIGHTS: usize = 100;

/// Smallest spread as a share of the centre. Without it, metrics that hardly vary would raise
/// irrelevant alarms.
const MIN_RELATIVE_SPREAD: f64 = 0.005;
/// Quantile used for the spread of the tails, and its value for a standard normal variable.
const TAIL: f64 = 0.95;
const TAIL_AT: f64 = 1.644_853_627;
/// Standard deviation of a normal variable divided by its median absolute deviation.
const PER_MAD: f64 = 1.482_602_218_5;
/// Upper bound of the assumed correlation between consecutive nights.
const MAX_CORRELATION: f64 = 0.7;

/// A value for the reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The value.
    pub value: f64,
    /// Half its 95 % interval, if known.
    pub half_interval: Option<f64>,
    /// Number of trials, if the value is a percentage of successful trials.
    pub trials: Option<u64>,
}

/// Centre and spread of a series in undisturbed nights.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Reference {
    /// Number of nights.
    pub nights: usize,
    /// Median.
    pub centre: f64,
    /// Spread below the centre, as a standard deviation.
    pub below: f64,
    /// Spread above it.
    pub above: f64,
    /// Correlation between consecutive nights.
    pub correlation: f64,
}

impl Reference {
    /// Builds a reference from `samples` in order of the nights; `None` for fewer than `MIN_NIGHTS`. `counts`: the values are counts of
    /// independent events.
    #[must_use]
    pub fn of(samples: &[Sample], counts: bool) -> Option<Self> {
        let nights = samples.len();
        if nights < MIN_NIGHTS {
            return None;
        }
        let mut sorted: Vec<f64> = samples.iter().map(|s| s.value).collect();
        sorted.sort_by(f64::total_cmp);
        let centre = quantile(&sorted, 0.5)?;
        let mut distances: Vec<f64> = sorted.iter().map(|v| (v - centre).abs()).collect();
        distances.sort_by(f64::total_cmp);
        let middle = PER_MAD * quantile(&distances, 0.5)?;
        let floor = spread_floor(samples, centre, counts);
        let side = |tail: f64| middle.max(tail / TAIL_AT).max(floor);
        let below = side(centre - quantile(&sorted, 1.0 - TAIL)?);
        let above = side(quantile(&sorted, TAIL)? - centre);
        let plain = Self {
            nights,
            centre,
            below,
            above,
            correlation: 0.0,
        };
        let correlation = correlation(samples.iter().map(|s| plain.raw(s.value)));
        Some(Self {
            correlation,
            ..plain
        })
    }

    /// Distance of `value` from the centre in standard deviations of a new night, which include the uncertainty of the centre and the
    /// correlation between nights.
    #[must_use]
    pub fn score(&self, value: f64) -> f64 {
        let n = self.nights as f64;
        // The quick rule needs three nights: variance of their mean relative to that of independent nights.
        let r = self.correlation;
        let alike = (3.0 + 4.0 * r + 2.0 * r * r) / 3.0;
        // Centre and spread are estimates, less certain with fewer nights. 1.6/n of a new score's variance comes from the median; the rest
        // compensates for underestimated spreads (simulated: `docs/reference/nightly.md`).
        let estimated = 1.0 + 8.0 / n;
        self.raw(value) / (alike * estimated).sqrt()
    }

    fn raw(&self, value: f64) -> f64 {
        let off = value - self.centre;
        let spread = if off < 0.0 { self.below } else { self.above };
        if off == 0.0 { 0.0 } else { off / spread }
    }
}

/// Lower bound of the spread from prior knowledge.
fn spread_floor(samples: &[Sample], centre: f64, counts: bool) -> f64 {
    let n = samples.len() as f64;
    let mut floor = MIN_RELATIVE_SPREAD * centre.abs();
    if counts {
        // Poisson, at the upper limit of its mean: zero events in n nights allow a mean of 3/n at 95 %.
        let sum: f64 = samples.iter().map(|s| s.value).sum();
        floor = floor.max(((sum + 3.0) / n).sqrt());
    }
    let mut halves: Vec<f64> = samples.iter().filter_map(|s| s.half_interval).collect();
    halves.sort_by(f64::total_cmp);
    if let Some(half) = quantile(&halves, 0.5) {
        floor = floor.max(half / 1.96);
    }
    let share = centre / 100.0;
    let trials = samples.iter().filter_map(|s| s.trials).max();
    if let Some(trials) = trials.filter(|n| *n > 0 && (0.0..=1.0).contains(&share)) {
        // Binomial, shrunk away from 0 and 1 (A. Agresti and B. A. Coull, The American Statistician 52 (1998) 119-126).
        let trials = trials as f64;
        let share = (share * trials + 1.0) / (trials + 2.0);
        floor = floor.max(100.0 * (share * (1.0 - share) / trials).sqrt());
    }
    floor
}

/// Lag-1 correlation of scores, clipped so that one outlier has little effect. Adds 1/n to correct
/// the bias of short series.
fn correlation(scores: impl Iterator<Item = f64>) -> f64 {
    let scores: Vec<f64> = scores.map(|z| z.clamp(-2.5, 2.5)).collect();
    let n = scores.len() as f64;
    let mean = scores.iter().sum::<f64>() / n;
    let square: f64 = scores.iter().map(|z| (z - mean).powi(2)).sum();
    if square == 0.0 {
        return 0.0;
    }
    let pairs = scores.windows(2);
    let product: f64 = pairs.map(|w| (w[0] - mean) * (w[1] - mean)).sum();
    let unbiased = product / square + 1.0 / n;
    unbiased.clamp(0.0, MAX_CORRELATION)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(values: impl IntoIterator<Item = f64>) -> Vec<Sample> {
        let one = |value| Sample {
            value,
            half_interval: None,
            trials: None,
        };
        values.into_iter().map(one).collect()
    }

    #[test]
    fn odd_nights_move_neither_centre_nor_spread_and_constants_have_a_floor() {
        // One outlier on each side of 21: the tail percentiles are the second values from the ends.
        let plain: Vec<f64> = (0..21)
            .map(|i| 98.0 + 0.2 * f64::from(i * 8 % 21))
            .collect();
        let mut odd = plain.clone();
        odd[1] = -1e6;
        odd[2] = 1e6;
        let of = |v: &[f64]| Reference::of(&samples(v.iter().copied()), false).unwrap();
        let (plain, odd) = (of(&plain), of(&odd));
        assert!((plain.centre - odd.centre).abs() < 0.1);
        assert!(odd.above < 1.5 * plain.above);
        assert_eq!(Reference::of(&samples([1.0; 11]), false), None);

        let same = of(&[50.0; 12]);
        assert_eq!((same.below, same.score(50.0)), (0.25, 0.0));
        let none = Reference::of(&samples([0.0; 12]), true).unwrap();
        assert_eq!((none.above, none.score(0.0)), (0.5, 0.0));
        assert!(none.score(1.0) < 2.0 && none.score(4.0) > 6.0);
        // For a metric that was always zero, any other value is far off; no division by zero occurs.
        assert_eq!(of(&[0.0; 12]).score(4096.0), f64::INFINITY);
    }

    #[test]
    fn nights_that_resemble_their_neighbours_count_for_less() {
        let slow: Vec<f64> = (0..24).map(|i| f64::from(i / 4 % 2)).collect();
        let fast: Vec<f64> = (0..24).map(|i| f64::from(i % 2)).collect();
        let of = |v: Vec<f64>| Reference::of(&samples(v), false).unwrap();
        let (slow, fast) = (of(slow), of(fast));
        assert!(slow.correlation > 0.4, "{}", slow.correlation);
        assert_eq!(fast.correlation, 0.0);
        assert!(slow.score(3.0) < fast.score(3.0));
    }
}
