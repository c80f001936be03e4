//! Posterior of a map: the average over all smoothnesses, weighted by their restricted likelihood.

use super::band::{Band, dot};
use super::grid::Grid;
use super::smoothness::{Candidate, Data, FREE};

/// Minimum average number of points per step of the spline.
const POINTS_PER_STEP: usize = 4;
/// Maximum number of steps; longer sessions have longer steps.
const MAX_STEPS: usize = 4000;
/// Prior probability that rates change evenly. If larger, weak wander is taken for none and coverage is too low; if smaller,
/// intervals of steady rates are too wide.
const EVEN_SHARE: f64 = 0.125;
/// Fewer points give a straight line.
const LINE_BELOW: usize = 8;

/// Posterior of the coefficients, averaged over all smoothnesses.
pub(crate) struct Posterior {
    pub grid: Grid,
    pub span_us: (f64, f64),
    pub mean: Vec<f64>,
    pub covariances: Band,
    pub variance: f64,
    pub free: f64,
    pub rate: f64,
    pub rate_variance: f64,
}

impl Posterior {
    /// From (time, deviation, spread) in time order, with the mean rate between two times, by default the first and the last
    /// point's, µs.
    pub(super) fn new(
        points: &[(f64, f64, f64)],
        step_us: f64,
        between_us: Option<(f64, f64)>,
    ) -> Option<Self> {
        let n = points.len();
        let (first, last) = (points.first()?.0, points.last()?.0);
        let span = last - first;
        let free = if n < LINE_BELOW { 2 } else { FREE };
        if n <= free || span <= 0.0 {
            return None;
        }
        let most = if free < FREE {
            1
        } else {
            (n / POINTS_PER_STEP).clamp(1, MAX_STEPS)
        };
        let steps = ((span / step_us) as usize).clamp(1, most);
        let grid = Grid {
            start_us: first,
            step_us: span / steps as f64,
            steps,
        };
        // Relative to the chord through the first and last point, so that the values are small.
        let y0 = points[0].1;
        let slope = (points[n - 1].1 - y0) / span;
        let rest = points
            .iter()
            .map(|(x, y, spread)| (*x, y - y0 - slope * (x - first), *spread));
        let rest: Vec<(f64, f64, f64)> = rest.collect();
        let between_us = between_us.unwrap_or((first, last));
        let mut data = Data::new(&rest, &grid, free, between_us);
        // Relative to the parabola, which no penalty affects: otherwise rounding errors of large penalties would swamp it.
        let parabola = data.parabola()?.coefficients;
        let rest = rest
            .iter()
            .map(|(x, y, spread)| (*x, y - grid.value(&parabola, *x), *spread));
        let rest: Vec<(f64, f64, f64)> = rest.collect();
        data.take(&rest, &grid);
        let size = grid.size();
        let mut candidates: Vec<Candidate> = data.parabola().into_iter().collect();
        let mean = data.information.iter().map(|r| r[0]).sum::<f64>() / size as f64;
        let wandering = data.wandering(mean);
        // Undisturbed crystals change their rate evenly, hence the prior share.
        let odds = EVEN_SHARE / (1.0 - EVEN_SHARE) * wandering.len().max(1) as f64;
        for candidate in &mut candidates {
            candidate.log_likelihood += libm::log(odds);
        }
        candidates.extend(wandering);
        let best = candidates
            .iter()
            .map(|c| c.log_likelihood)
            .fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = candidates
            .iter()
            .map(|c| libm::exp(c.log_likelihood - best))
            .collect();
        let all: f64 = weights.iter().sum();
        if all.is_nan() || all <= 0.0 {
            return None;
        }
        let (mut mean, mut variance) = (vec![0.0; size], 0.0);
        for (c, w) in candidates.iter().zip(&weights) {
            for (m, v) in mean.iter_mut().zip(&c.coefficients) {
                *m += w / all * v;
            }
            variance += w / all * c.variance;
        }
        let along = |c: &[f64]| dot(c, &data.chord);
        let rate = along(&mean);
        let whole_rate = rate + along(&parabola) + slope;
        let (mut covariances, mut rate_variance) = (vec![[0.0; 4]; size], 0.0);
        for (c, w) in candidates.iter().zip(&weights) {
            let off: Vec<f64> = c
                .coefficients
                .iter()
                .zip(&mean)
                .map(|(a, b)| a - b)
                .collect();
            for i in 0..size {
                for k in 0..4.min(size - i) {
                    covariances[i][k] += w / all * (c.covariances[i][k] + off[i] * off[i + k]);
                }
            }
            let apart = along(&c.coefficients) - rate;
            rate_variance += w / all * (c.rate_variance + apart * apart);
        }
        // Greville: the coefficients of a straight line are its values at the middle of each spline.
        for (i, (m, p)) in mean.iter_mut().zip(&parabola).enumerate() {
            *m += p + y0 + slope * (i as f64 - 1.0) * grid.step_us;
        }
        Some(Self {
            grid,
            span_us: (first, last),
            mean,
            covariances,
            variance,
            free: (n - free) as f64,
            rate: whole_rate,
            rate_variance,
        })
    }
}
