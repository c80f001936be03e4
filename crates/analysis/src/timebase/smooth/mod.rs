//! A smooth map between two clocks, fitted robustly, with the uncertainty of every value and of the mean rate.
//!
//! The fit uses the small deviation `y = to - from` over `x = from`, both relative to exact references, so that days in µs
//! lose no digits. The map is a smoothing spline: cubic B-splines on equal steps, with a penalty on third differences
//! (Eilers and Marx, "Flexible smoothing with B-splines and penalties", Statistical Science 11, 1996), so that an evenly
//! changing rate costs nothing. The amount of wander beyond that is not chosen but averaged over: each smoothness is
//! weighted by its restricted likelihood (Patterson and Thompson 1971), including the limit without any wander. Intervals
//! are posterior intervals (Wahba, "Bayesian confidence intervals for the cross-validated smoothing spline", JRSS B 45,
//! 1983).

mod band;
mod grid;
mod point;
mod posterior;
mod smoothness;

pub(crate) use self::point::{Figure, Point};

use self::band::{Band, quadratic};
use self::grid::Grid;
use self::posterior::Posterior;
use crate::clock::line::{self, Pair, median};

/// Minimum step of maps, µs: a rate that changes by 6 ppm per hour bends a clock by 0.02 µs in it.
pub(crate) const STEP_US: f64 = 10e6;
/// Lower bound of the scale of train instants, µs.
pub(crate) const FLOOR_US: f64 = 0.5;
/// Residuals beyond this many robust standard deviations are outliers.
const OUTLIER_SIGMAS: f64 = 5.0;
/// Standard deviation of a normal distribution over its median absolute deviation.
const MAD_TO_SIGMA: f64 = 1.482_602_218_505_602;
/// Maximum number of iterations of fit and inlier selection.
const ROUNDS: usize = 8;
/// Maximum wander of rate differences over a session: 20 ppm, a cheap crystal over tens of kelvins.
pub(crate) const WANDER: f64 = 20e-6;

/// A smooth map between two clocks.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SmoothMap {
    grid: Grid,
    coefficients: Vec<f64>,
    /// Posterior covariances of each coefficient with itself and the next three, µs².
    covariances: Band,
    /// First and last point used, µs.
    span_us: (f64, f64),
    /// Standard deviation of a point about the map, µs, and its degrees of freedom.
    pub sigma_us: f64,
    pub free: f64,
    /// RMS and largest absolute residual of the used points, µs.
    pub rms_us: f64,
    pub max_us: f64,
    /// For each point, whether it was used.
    pub used: Vec<bool>,
    /// For each point, its time on the first clock and its residual, µs.
    pub residuals: Vec<(f64, f64)>,
    /// Mean rate difference between two times, by default the first and the last used point.
    pub drift: Figure,
}

impl SmoothMap {
    /// Fits `points`, which are in order of `from_us`, with steps of at least `step_us`. `floor_us` is the lower bound of
    /// the residual scale. `None` below 3 points or without spread in time.
    pub(crate) fn fit(points: &[Point], step_us: f64, floor_us: f64) -> Option<Self> {
        Self::fit_with_drift(points, step_us, floor_us, None)
    }

    /// As [`Self::fit`], with the drift between two given times on the first clock, µs.
    pub(crate) fn fit_with_drift(
        points: &[Point],
        step_us: f64,
        floor_us: f64,
        between_us: Option<(f64, f64)>,
    ) -> Option<Self> {
        let pairs: Vec<Pair> = points
            .iter()
            .map(|p| Pair {
                host_us: p.from_us,
                camera_us: p.to_us,
            })
            .collect();
        let line = line::fit(&pairs, floor_us).ok()?;
        let span = points.last()?.from_us - points.first()?.from_us;
        // A wandering clock deviates from a line by more than the outlier bound: start with all points, except those further
        // from it than any plausible clock.
        let off = |p: &Point| p.to_us - line.offset_us - p.from_us - line.drift * p.from_us;
        let wander_us = 1_000.0 + WANDER * span;
        let mut used: Vec<bool> = points.iter().map(|p| off(p).abs() <= wander_us).collect();
        let deviations: Vec<(f64, f64, f64)> = points
            .iter()
            .map(|p| (p.from_us, p.to_us - p.from_us, p.spread))
            .collect();
        let mut found = None;
        for _ in 0..ROUNDS {
            let chosen: Vec<(f64, f64, f64)> = picked(&deviations, &used).collect();
            let posterior = Posterior::new(&chosen, step_us, between_us)?;
            let residuals: Vec<f64> = deviations
                .iter()
                .map(|(x, y, _)| y - posterior.grid.value(&posterior.mean, *x))
                .collect();
            let size = |(r, p): (&f64, &Point)| r.abs() / p.spread;
            let sizes: Vec<f64> = residuals.iter().zip(points).map(size).collect();
            let mut inliers: Vec<f64> = picked(&sizes, &used).collect();
            let sigma = (MAD_TO_SIGMA * median(&mut inliers)?).max(floor_us);
            let now: Vec<bool> = sizes
                .iter()
                .map(|size| *size <= OUTLIER_SIGMAS * sigma)
                .collect();
            let settled = now == used;
            found = Some((posterior, residuals, used));
            if settled {
                break;
            }
            used = now;
        }
        let (posterior, residuals, used) = found?;
        let inliers: Vec<f64> = picked(&residuals, &used).collect();
        let squares: f64 = inliers.iter().map(|r| r * r).sum();
        let n = inliers.len() as f64;
        Some(Self {
            grid: posterior.grid,
            span_us: posterior.span_us,
            coefficients: posterior.mean,
            covariances: posterior.covariances,
            sigma_us: posterior.variance.sqrt(),
            free: posterior.free,
            rms_us: (squares / n).sqrt(),
            max_us: inliers.iter().fold(0.0, |m, r| r.abs().max(m)),
            used,
            residuals: points.iter().map(|p| p.from_us).zip(residuals).collect(),
            drift: Figure {
                value: posterior.rate,
                se: posterior.rate_variance.max(0.0).sqrt(),
                free: posterior.free,
            },
        })
    }

    /// Time on the other clock, µs.
    pub(crate) fn value(&self, from_us: f64) -> f64 {
        from_us + self.grid.value(&self.coefficients, from_us)
    }

    /// Standard error of [`Self::value`], µs; grows outside the range of the points.
    pub(crate) fn standard_error(&self, from_us: f64) -> f64 {
        let (first, weights) = self.grid.weights(from_us);
        quadratic(&self.covariances, first, &weights)
            .max(0.0)
            .sqrt()
    }

    /// Ends of the spline's steps, ascending: between them the map is nearly straight.
    pub(crate) fn knots(&self) -> Vec<f64> {
        let g = self.grid;
        let steps = 0..=g.steps;
        steps.map(|k| g.start_us + k as f64 * g.step_us).collect()
    }

    /// First and last point used, µs.
    pub(crate) fn span_us(&self) -> (f64, f64) {
        self.span_us
    }

    /// Number of used points.
    pub(crate) fn n(&self) -> usize {
        self.used.iter().filter(|u| **u).count()
    }
}

fn picked<'a, T: Copy>(all: &'a [T], used: &'a [bool]) -> impl Iterator<Item = T> + 'a {
    let chosen = all.iter().zip(used).filter(|(_, used)| **used);
    chosen.map(|(value, _)| *value)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One point per second with deviation `y` of its time in µs, and alternating noise of 1 µs.
    fn points(n: u32, y: impl Fn(f64) -> f64) -> Vec<Point> {
        let point = |k: u32| {
            let x = f64::from(k) * 1e6;
            let noise = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            Point::new(x, x + y(x) + noise)
        };
        (0..n).map(point).collect()
    }

    #[test]
    fn a_rate_that_changes_evenly_is_followed_to_the_noise_and_outliers_are_left_out() {
        // 40 ppm, changing by 5 ppm in an hour.
        let bend = |x: f64| 40e-6 * x + 5e-6 / 3.6e9 * 0.5 * x * x;
        let mut all = points(3600, bend);
        for p in all.iter_mut().step_by(50) {
            p.to_us += 700.0;
        }
        let map = SmoothMap::fit(&all, 10e6, 0.5).unwrap();
        assert_eq!(map.n(), 3600 - 72);
        assert!((0.8..1.3).contains(&map.rms_us), "{}", map.rms_us);
        for x in [1e6, 1e9, 1.7777e9, 3.5e9, 3.6e9] {
            let off = map.value(x) - x - bend(x);
            let se = map.standard_error(x);
            assert!(off.abs() < 4.0 * se && se < 0.1, "{x}: {off} ± {se}");
        }
        let (from, to) = map.span_us();
        let mean = (bend(to) - bend(from)) / (to - from);
        assert!((map.drift.value - mean).abs() < 4.0 * map.drift.se);
        // Half an hour beyond the end the uncertainty is much larger.
        assert!(map.standard_error(5.4e9) > 5.0 * map.standard_error(3.6e9));
    }

    #[test]
    fn few_points_give_the_line_of_least_squares() {
        let all = points(6, |x| 3e-6 * x);
        let map = SmoothMap::fit(&all, 1e9, 0.1).unwrap();
        assert_eq!(map.free, 4.0);
        let sigma2 = map.sigma_us * map.sigma_us;
        let sxx: f64 = (0..6).map(|k| (f64::from(k) - 2.5).powi(2)).sum();
        for at in [0.0, 2.0, 9.0] {
            let wanted = (sigma2 * (1.0 / 6.0 + (at - 2.5f64).powi(2) / sxx)).sqrt();
            let found = map.standard_error(at * 1e6);
            assert!((found - wanted).abs() < 1e-6, "{at}: {found}, {wanted}");
        }
        assert!((map.drift.se * 1e6 - (sigma2 / sxx).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn too_little_gives_no_map() {
        assert_eq!(SmoothMap::fit(&points(2, |_| 0.0), 10e6, 1.0), None);
        let same = vec![Point::new(1.0, 2.0); 9];
        assert_eq!(SmoothMap::fit(&same, 10e6, 1.0), None);
    }
}
