//! A continuous piecewise-affine map between two clocks, fitted robustly, with the uncertainty of every value.
//!
//! What is fitted is the small deviation `y = to - from` over `x = from`, both relative to exact references, so that
//! days in µs lose no digits. The map is a linear spline: knots with a value each, hats between them, least squares on
//! the points that are no outliers. Two clocks differ by a rate that itself wanders with temperature; between knots a
//! minute apart a crystal of 1 ppm per hour bends by 0.5 µs.

use crate::clock::line::{self, Pair, median};

/// Residuals beyond this many robust standard deviations are outliers.
const OUTLIER_SIGMAS: f64 = 5.0;
/// Standard deviation of a normal distribution over its median absolute deviation.
const MAD_TO_SIGMA: f64 = 1.482_602_218_505_602;
/// Rounds of "fit, then choose the inliers anew".
const ROUNDS: usize = 8;
/// Points that a segment needs at least.
const POINTS_PER_SEGMENT: usize = 8;

/// Simultaneous times on two clocks, µs, relative to their references.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    pub from_us: f64,
    pub to_us: f64,
}

/// The map.
#[derive(Debug, Clone, PartialEq)]
pub struct Piecewise {
    /// Knots, at least two, ascending, µs.
    knots: Vec<f64>,
    /// `to - from` at the knots, µs.
    values: Vec<f64>,
    /// For each segment the (co)variances of the values at its ends: (left, both, right), µs².
    covariances: Vec<(f64, f64, f64)>,
    /// Standard deviation of a point about the map, µs.
    pub sigma_us: f64,
    /// RMS and largest absolute residual of the points used, µs.
    pub rms_us: f64,
    pub max_us: f64,
    /// For each point, whether it was used.
    pub used: Vec<bool>,
    /// For each point, when it was on the first clock and its residual, µs.
    pub residuals: Vec<(f64, f64)>,
    /// Rate difference over all, and its standard error.
    pub drift: f64,
    pub drift_se: f64,
}

impl Piecewise {
    /// Fits `points`, which are in order of `from_us`, with knots at least `spacing_us` apart. Residuals are never judged
    /// finer than `floor_us`. `None` below 3 points or without spread in time.
    pub fn fit(points: &[Point], spacing_us: f64, floor_us: f64) -> Option<Self> {
        let pairs: Vec<Pair> = points
            .iter()
            .map(|p| Pair {
                host_us: p.from_us,
                camera_us: p.to_us,
            })
            .collect();
        let line = line::fit(&pairs, floor_us)?;
        let span = points.last()?.from_us - points.first()?.from_us;
        // What wanders bends away from the line by more than the outlier bound: the points start over together, but for those
        // that lie further from it than any wandering clock.
        let off = |p: &Point| p.to_us - line.offset_us - p.from_us - line.drift * p.from_us;
        let wander_us = 1_000.0 + WANDER * span;
        let mut used: Vec<bool> = points.iter().map(|p| off(p).abs() <= wander_us).collect();
        let deviations: Vec<(f64, f64)> = points
            .iter()
            .map(|p| (p.from_us, p.to_us - p.from_us))
            .collect();
        let most = (points.len() / POINTS_PER_SEGMENT).max(1);
        let segments = ((span / spacing_us).floor() as usize).clamp(1, most);
        let mut spline = None;
        for _ in 0..ROUNDS {
            let knots = knots(&deviations, &used, segments)?;
            let found = Spline::fit(&deviations, &used, knots)?;
            let residuals: Vec<f64> = deviations
                .iter()
                .map(|(x, y)| y - found.value(*x))
                .collect();
            let mut sizes: Vec<f64> = residuals
                .iter()
                .zip(&used)
                .filter(|(_, u)| **u)
                .map(|(r, _)| r.abs())
                .collect();
            let sigma = (MAD_TO_SIGMA * median(&mut sizes)?).max(floor_us);
            let now: Vec<bool> = residuals
                .iter()
                .map(|r| r.abs() <= OUTLIER_SIGMAS * sigma)
                .collect();
            let settled = now == used;
            spline = Some((found, residuals, used));
            if settled {
                break;
            }
            used = now;
        }
        let (spline, residuals, used) = spline?;
        let inliers: Vec<f64> = residuals
            .iter()
            .zip(&used)
            .filter(|(_, u)| **u)
            .map(|(r, _)| *r)
            .collect();
        let n = inliers.len() as f64;
        let free = n - spline.knots.len() as f64;
        if free < 1.0 {
            return None;
        }
        let squares: f64 = inliers.iter().map(|r| r * r).sum();
        let sigma_us = (squares / free).sqrt();
        Some(Self {
            covariances: spline.covariances(sigma_us * sigma_us)?,
            knots: spline.knots,
            values: spline.values,
            sigma_us,
            rms_us: (squares / n).sqrt(),
            max_us: inliers.iter().fold(0.0, |m, r| r.abs().max(m)),
            used,
            residuals: points.iter().map(|p| p.from_us).zip(residuals).collect(),
            drift: line.drift,
            drift_se: line.drift_se,
        })
    }

    /// The time on the other clock, µs.
    pub fn value(&self, from_us: f64) -> f64 {
        from_us + value(&self.knots, &self.values, from_us)
    }

    /// Standard error of [`Self::value`], µs; grows beyond the first and the last knot.
    pub fn standard_error(&self, from_us: f64) -> f64 {
        let (k, right) = place(&self.knots, from_us);
        let left = 1.0 - right;
        let (ll, lr, rr) = self.covariances[k];
        (left * left * ll + 2.0 * left * right * lr + right * right * rr)
            .max(0.0)
            .sqrt()
    }

    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Points used.
    pub fn n(&self) -> usize {
        self.used.iter().filter(|u| **u).count()
    }
}

/// Rate differences wander by no more than this over a session: 20 ppm, a cheap crystal over tens of kelvins.
pub const WANDER: f64 = 20e-6;

/// Segment and the weight of its right end; beyond the ends the outer segments go on.
fn place(knots: &[f64], x: f64) -> (usize, f64) {
    let k = knots[1..knots.len() - 1].partition_point(|knot| *knot <= x);
    (k, (x - knots[k]) / (knots[k + 1] - knots[k]))
}

fn value(knots: &[f64], values: &[f64], x: f64) -> f64 {
    let (k, right) = place(knots, x);
    values[k] + right * (values[k + 1] - values[k])
}

/// Knots with equally many of the points used between them; `None` without spread.
fn knots(points: &[(f64, f64)], used: &[bool], segments: usize) -> Option<Vec<f64>> {
    let xs: Vec<f64> = points
        .iter()
        .zip(used)
        .filter(|(_, u)| **u)
        .map(|(p, _)| p.0)
        .collect();
    let (first, last) = (*xs.first()?, *xs.last()?);
    let segments = segments.min(xs.len() / POINTS_PER_SEGMENT).max(1);
    let mut knots = vec![first];
    for k in 1..segments {
        let at = xs[k * (xs.len() - 1) / segments];
        if at > knots[knots.len() - 1] && at < last {
            knots.push(at);
        }
    }
    (last > first).then(|| {
        knots.push(last);
        knots
    })
}

/// Least squares on hats: normal equations with three diagonals.
struct Spline {
    knots: Vec<f64>,
    values: Vec<f64>,
    diagonal: Vec<f64>,
    beside: Vec<f64>,
}

impl Spline {
    fn fit(points: &[(f64, f64)], used: &[bool], knots: Vec<f64>) -> Option<Self> {
        let n = knots.len();
        let (mut diagonal, mut beside, mut right_side) =
            (vec![0.0; n], vec![0.0; n - 1], vec![0.0; n]);
        for ((x, y), _) in points.iter().zip(used).filter(|(_, u)| **u) {
            let (k, right) = place(&knots, *x);
            let left = 1.0 - right;
            diagonal[k] += left * left;
            diagonal[k + 1] += right * right;
            beside[k] += left * right;
            right_side[k] += left * y;
            right_side[k + 1] += right * y;
        }
        let values = solve(&diagonal, &beside, &right_side)?;
        Some(Self {
            knots,
            values,
            diagonal,
            beside,
        })
    }

    fn value(&self, x: f64) -> f64 {
        value(&self.knots, &self.values, x)
    }

    /// See [`Piecewise::covariances`], with this variance of a point.
    fn covariances(&self, variance: f64) -> Option<Vec<(f64, f64, f64)>> {
        let n = self.knots.len();
        let column = |k: usize| {
            let mut unit = vec![0.0; n];
            unit[k] = 1.0;
            solve(&self.diagonal, &self.beside, &unit)
        };
        let mut out = Vec::with_capacity(n - 1);
        let mut left = column(0)?;
        for k in 0..n - 1 {
            let right = column(k + 1)?;
            out.push((
                variance * left[k],
                variance * left[k + 1],
                variance * right[k + 1],
            ));
            left = right;
        }
        Some(out)
    }
}

/// Solves a symmetric system with three diagonals (Thomas); `None` when it is singular.
fn solve(diagonal: &[f64], beside: &[f64], right_side: &[f64]) -> Option<Vec<f64>> {
    let n = diagonal.len();
    let (mut pivots, mut out) = (diagonal.to_vec(), right_side.to_vec());
    for k in 1..n {
        if pivots[k - 1] <= 1e-12 * diagonal[k - 1] {
            return None;
        }
        let factor = beside[k - 1] / pivots[k - 1];
        pivots[k] -= factor * beside[k - 1];
        out[k] -= factor * out[k - 1];
    }
    if pivots[n - 1] <= 1e-12 * diagonal[n - 1] {
        return None;
    }
    out[n - 1] /= pivots[n - 1];
    for k in (0..n - 1).rev() {
        out[k] = (out[k] - beside[k] * out[k + 1]) / pivots[k];
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(n: usize, f: impl Fn(f64) -> f64) -> Vec<Point> {
        (0..n)
            .map(|k| {
                let from_us = k as f64 * 1e6;
                Point {
                    from_us,
                    to_us: from_us + f(from_us),
                }
            })
            .collect()
    }

    #[test]
    fn a_clock_that_bends_is_followed_and_outliers_are_not() {
        // 300 ppm, and a rate that goes up by 2 ppm over the hour; noise of 1 µs, alternating.
        let bend = |x: f64| 5e5 + 300e-6 * x + 2e-6 * x * x / (2.0 * 3.6e9);
        let mut all = points(3600, |x| {
            bend(x)
                + if ((x * 1e-6) as u64).is_multiple_of(2) {
                    1.0
                } else {
                    -1.0
                }
        });
        for p in all.iter_mut().step_by(50) {
            p.to_us += 700.0;
        }
        let map = Piecewise::fit(&all, 60e6, 0.5).unwrap();
        assert_eq!(map.n(), 3600 - 72);
        assert!((0.8..1.3).contains(&map.rms_us), "{}", map.rms_us);
        for x in [0.0, 1e9, 1.7777e9, 3.5e9] {
            let off = map.value(x) - x - bend(x);
            let se = map.standard_error(x);
            assert!(off.abs() < 0.2 + 3.0 * se && se < 0.6, "{x}: {off} ± {se}");
        }
        // Half an hour beyond the end nothing is known to a µs any more.
        assert!(map.standard_error(5.4e9) > 5.0);
    }

    #[test]
    fn standard_errors_are_those_of_the_line_through_one_segment() {
        let all = points(20, |x| {
            if ((x * 1e-6) as u64).is_multiple_of(2) {
                1.0
            } else {
                -1.0
            }
        });
        let map = Piecewise::fit(&all, 1e9, 0.1).unwrap();
        assert_eq!(map.knots().len(), 2);
        let sigma2 = map.sigma_us * map.sigma_us;
        let sxx: f64 = (0..20).map(|k| (f64::from(k) - 9.5).powi(2)).sum();
        for at in [0.0, 7.0, 25.0] {
            let wanted = (sigma2 * (1.0 / 20.0 + (at - 9.5f64).powi(2) / sxx)).sqrt();
            assert!((map.standard_error(at * 1e6) - wanted).abs() < 1e-9);
        }
    }

    #[test]
    fn too_little_gives_no_map() {
        assert_eq!(Piecewise::fit(&points(2, |_| 0.0), 60e6, 1.0), None);
        let same = vec![
            Point {
                from_us: 1.0,
                to_us: 2.0
            };
            9
        ];
        assert_eq!(Piecewise::fit(&same, 60e6, 1.0), None);
    }
}
