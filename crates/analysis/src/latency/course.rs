//! Event rate around the contact, for drawing.

use rayon::prelude::*;

use super::bins::Grid;
use super::trial::Trial;
use crate::metrics::quantile;
use crate::result::LatencyCourse;

/// Approximate width of a drawn bin, ms: 850 for a whole trial.
const DRAWN_MS: f64 = 2.0;
/// Drawn percentiles.
const QUANTILES: [f64; 3] = [0.05, 0.5, 0.95];

/// Rate of one trial, averaged over drawn bins; one of them begins at the contact.
#[derive(Debug, Clone, PartialEq)]
pub struct PlottedRates {
    /// Number of the first drawn bin; negative before the contact.
    pub first: i64,
    /// Events per second in each bin.
    pub per_s: Vec<f64>,
}

impl PlottedRates {
    /// The whole drawn bins of the (smoothed) counts on a grid.
    #[must_use]
    pub fn new(grid: Grid, counts: &[f64], bin_ms: f64) -> Self {
        let fine = bins_drawn_as_one(bin_ms);
        let first = -(-grid.first).div_euclid(fine as i64);
        let skipped = (first * fine as i64 - grid.first) as usize;
        let whole = counts.get(skipped..).unwrap_or_default();
        Self {
            first,
            per_s: rates(whole, bin_ms).collect(),
        }
    }

    fn at(&self, bin: i64) -> Option<f64> {
        let index = usize::try_from(bin - self.first).ok()?;
        self.per_s.get(index).copied()
    }
}

/// Percentiles of the trials around the contact, and of all their backgrounds.
#[must_use]
pub fn course(trials: &[Trial], bin_ms: f64) -> LatencyCourse {
    let fine = bins_drawn_as_one(bin_ms);
    let from = trials.iter().map(|t| t.course.first).min().unwrap_or(0);
    let end = |d: &PlottedRates| d.first + d.per_s.len() as i64;
    let to = trials.iter().map(|t| end(&t.course)).max().unwrap_or(0);
    let bins: Vec<(i64, [f32; 3])> = (from..to)
        .into_par_iter()
        .filter_map(|bin| {
            let mut bin_rates: Vec<f64> = trials.iter().filter_map(|t| t.course.at(bin)).collect();
            (2 * bin_rates.len() >= trials.len()).then(|| (bin, percentiles(&mut bin_rates)))
        })
        .collect();
    let mut background: Vec<f64> = trials
        .iter()
        .flat_map(|t| rates(&t.background, bin_ms))
        .collect();
    LatencyCourse {
        start_ms: bins.first().map_or(0.0, |b| (b.0 * fine as i64) as f64) * bin_ms,
        bin_ms: fine as f64 * bin_ms,
        press_per_s: [0, 1, 2].map(|q| bins.iter().map(|(_, rates)| rates[q]).collect()),
        background_per_s: percentiles(&mut background),
    }
}

fn bins_drawn_as_one(bin_ms: f64) -> usize {
    (DRAWN_MS / bin_ms).round().max(1.0) as usize
}

/// Mean rate of each whole drawn bin, events per second.
fn rates(counts: &[f64], bin_ms: f64) -> impl Iterator<Item = f64> {
    let fine = bins_drawn_as_one(bin_ms);
    let length_s = fine as f64 * bin_ms * 1e-3;
    counts
        .chunks_exact(fine)
        .map(move |c| c.iter().sum::<f64>() / length_s)
}

fn percentiles(values: &mut [f64]) -> [f32; 3] {
    QUANTILES.map(|q| quantile(values, q).unwrap_or(0.0) as f32)
}
