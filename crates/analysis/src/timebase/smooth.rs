//! A smooth map between two clocks, fitted robustly, with the uncertainty of every value and of the mean rate.
//!
//! What is fitted is the small deviation `y = to - from` over `x = from`, both relative to exact references, so that days in µs
//! lose no digits. The map is a smoothing spline: cubic B-splines on equal steps, with a penalty on third differences
//! (Eilers and Marx, "Flexible smoothing with B-splines and penalties", Statistical Science 11, 1996), so that a rate that changes
//! evenly costs nothing. How much a rate wanders beyond that is not chosen but averaged over: each smoothness counts by its
//! restricted likelihood (Patterson and Thompson 1971), the limit without any wander included. Intervals are those of the
//! posterior (Wahba, "Bayesian confidence intervals for the cross-validated smoothing spline", JRSS B 45, 1983).

use crate::clock::line::{self, Pair, median};
use crate::distributions::student_quantile;

/// Residuals beyond this many robust standard deviations are outliers.
const OUTLIER_SIGMAS: f64 = 5.0;
/// Standard deviation of a normal distribution over its median absolute deviation.
const MAD_TO_SIGMA: f64 = 1.482_602_218_505_602;
/// Rounds of "fit, then choose the inliers anew".
const ROUNDS: usize = 8;
/// Points for each step of the spline, on average at least.
const POINTS_PER_STEP: usize = 4;
/// Most steps: of a longer session they are longer.
const MOST_STEPS: usize = 4000;
/// Rate differences wander by no more than this over a session: 20 ppm, a cheap crystal over tens of kelvins.
pub const WANDER: f64 = 20e-6;
/// Smoothnesses that are tried, as powers of ten of the mean information on a coefficient: below the first a map follows the
/// noise, above the last nothing is left in 64 bits of what the points say.
const LOWEST_POWER: f64 = -2.0;
const HIGHEST_POWER: f64 = 12.0;
/// Probability, before anything is known, that rates change evenly: larger, and wander that hardly shows is taken for none and
/// intervals hold too rarely; smaller, and the intervals of rates that do not wander are too wide.
const EVEN_SHARE: f64 = 0.125;
/// Coefficients that no penalty holds: those of a parabola.
const FREE: usize = 3;
/// Of fewer points a straight line is made.
const LINE_BELOW: usize = 8;

/// Simultaneous times on two clocks, µs, relative to their references.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    pub from_us: f64,
    pub to_us: f64,
    /// Standard deviation of its noise, in units of that of a usual point; above 0.
    pub spread: f64,
}

impl Point {
    /// A point as good as any other.
    pub fn new(from_us: f64, to_us: f64) -> Self {
        Self {
            from_us,
            to_us,
            spread: 1.0,
        }
    }
}

/// A figure with its standard error, which has so many degrees of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Figure {
    pub value: f64,
    pub se: f64,
    pub free: f64,
}

impl Figure {
    /// The difference to another that errs by itself: degrees of freedom after Welch (1947).
    pub fn less(self, other: Self) -> Self {
        let (a, b) = (self.se * self.se, other.se * other.se);
        let free = (a + b) * (a + b) / (a * a / self.free + b * b / other.free);
        Self {
            value: self.value - other.value,
            se: (a + b).sqrt(),
            free: if free.is_finite() {
                free
            } else {
                self.free.min(other.free)
            },
        }
    }

    /// The standard error 1.96 of which are half of the 95 % interval, few degrees of freedom included.
    pub fn stated_se(self) -> f64 {
        self.se * student_quantile(0.975, self.free) / 1.96
    }
}

/// The map.
#[derive(Debug, Clone, PartialEq)]
pub struct Smooth {
    grid: Grid,
    coefficients: Vec<f64>,
    /// Posterior covariances of coefficients with themselves and the next three, µs².
    covariances: Vec<[f64; 4]>,
    /// First and last point used, µs.
    span_us: (f64, f64),
    /// Standard deviation of a point about the map, µs, and its degrees of freedom.
    pub sigma_us: f64,
    pub free: f64,
    /// RMS and largest absolute residual of the points used, µs.
    pub rms_us: f64,
    pub max_us: f64,
    /// For each point, whether it was used.
    pub used: Vec<bool>,
    /// For each point, when it was on the first clock and its residual, µs.
    pub residuals: Vec<(f64, f64)>,
    /// Mean rate difference between two times, the first point used and the last unless others are asked for.
    pub drift: Figure,
}

impl Smooth {
    /// Fits `points`, which are in order of `from_us`, in steps of at least `step_us`. Residuals are never judged finer than
    /// `floor_us`. `None` below 3 points or without spread in time.
    pub fn fit(points: &[Point], step_us: f64, floor_us: f64) -> Option<Self> {
        Self::fit_with_drift(points, step_us, floor_us, None)
    }

    /// As [`Self::fit`], with the drift between two times on the first clock, µs, instead of the first and last point used.
    pub fn fit_with_drift(
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
        let line = line::fit(&pairs, floor_us)?;
        let span = points.last()?.from_us - points.first()?.from_us;
        // What wanders bends away from the line by more than the outlier bound: the points start over together, but for those
        // that lie further from it than any wandering clock.
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

    /// The time on the other clock, µs.
    pub fn value(&self, from_us: f64) -> f64 {
        from_us + self.grid.value(&self.coefficients, from_us)
    }

    /// Standard error of [`Self::value`], µs; grows before the first and behind the last point.
    pub fn standard_error(&self, from_us: f64) -> f64 {
        let (first, weights) = self.grid.weights(from_us);
        quadratic(&self.covariances, first, &weights)
            .max(0.0)
            .sqrt()
    }

    /// Ends of the spline's steps, ascending: between them the map is nearly straight.
    pub fn knots(&self) -> Vec<f64> {
        let g = self.grid;
        let steps = 0..=g.steps;
        steps.map(|k| g.start_us + k as f64 * g.step_us).collect()
    }

    /// First and last point used, µs.
    pub fn span_us(&self) -> (f64, f64) {
        self.span_us
    }

    /// Points used.
    pub fn n(&self) -> usize {
        self.used.iter().filter(|u| **u).count()
    }
}

fn picked<'a, T: Copy>(all: &'a [T], used: &'a [bool]) -> impl Iterator<Item = T> + 'a {
    let chosen = all.iter().zip(used).filter(|(_, used)| **used);
    chosen.map(|(value, _)| *value)
}

/// Equal steps of time, and the cubic B-splines on them: one more than steps to the left, two to the right.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Grid {
    start_us: f64,
    step_us: f64,
    steps: usize,
}

impl Grid {
    fn size(&self) -> usize {
        self.steps + 3
    }

    /// Number of the first of the four splines that are not 0 at `x`, and their values there; beyond the ends the outer
    /// polynomials go on.
    fn weights(&self, x: f64) -> (usize, [f64; 4]) {
        let at = (x - self.start_us) / self.step_us;
        let k = (at.floor().max(0.0) as usize).min(self.steps - 1);
        let u = at - k as f64;
        let v = 1.0 - u;
        let weights = [
            v * v * v / 6.0,
            (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0,
            (3.0 * v * v * v - 6.0 * v * v + 4.0) / 6.0,
            u * u * u / 6.0,
        ];
        (k, weights)
    }

    fn value(&self, coefficients: &[f64], x: f64) -> f64 {
        let (first, weights) = self.weights(x);
        let near = coefficients[first..first + 4].iter().zip(weights);
        near.map(|(c, w)| c * w).sum()
    }
}

/// A symmetric matrix with three further diagonals: for each row its diagonal and what follows.
type Band = Vec<[f64; 4]>;

/// `w' C w` for weights of four neighbours.
fn quadratic(c: &Band, first: usize, w: &[f64; 4]) -> f64 {
    let mut sum = 0.0;
    for i in 0..4 {
        sum += w[i] * w[i] * c[first + i][0];
        for j in i + 1..4 {
            sum += 2.0 * w[i] * w[j] * c[first + i][j - i];
        }
    }
    sum
}

/// Cholesky's factor of a positive definite band matrix: `l[i][k]` is entry (i + k, i). `None` when it is not.
fn factor(a: &Band) -> Option<Band> {
    let n = a.len();
    let mut l = a.clone();
    for i in 0..n {
        let pivot = l[i][0];
        if pivot.is_nan() || pivot <= 1e-14 * a[i][0] {
            return None;
        }
        let root = pivot.sqrt();
        for v in &mut l[i] {
            *v /= root;
        }
        l[i][0] = root;
        for k in 1..4.min(n - i) {
            for m in k..4.min(n - i) {
                l[i + k][m - k] -= l[i][k] * l[i][m];
            }
        }
    }
    Some(l)
}

/// Solves `l l' x = b`.
fn solve(l: &Band, b: &[f64]) -> Vec<f64> {
    let n = l.len();
    let mut x = b.to_vec();
    for i in 0..n {
        x[i] /= l[i][0];
        for k in 1..4.min(n - i) {
            x[i + k] -= l[i][k] * x[i];
        }
    }
    for i in (0..n).rev() {
        for k in 1..4.min(n - i) {
            x[i] -= l[i][k] * x[i + k];
        }
        x[i] /= l[i][0];
    }
    x
}

/// The band of the inverse of `l l'` (Takahashi, Fagan and Chin 1973).
fn inverse_band(l: &Band) -> Band {
    let n = l.len();
    let mut z = vec![[0.0; 4]; n];
    for i in (0..n).rev() {
        let last = 4.min(n - i);
        for k in (1..last).rev() {
            let mut sum = 0.0;
            for (m, factor) in l[i].iter().enumerate().take(last).skip(1) {
                let (a, b) = (i + k.min(m), k.abs_diff(m));
                sum += factor * z[a][b];
            }
            z[i][k] = -sum / l[i][0];
        }
        let mut sum = 1.0 / l[i][0];
        for (factor, inverse) in l[i].iter().zip(&z[i]).take(last).skip(1) {
            sum -= factor * inverse;
        }
        z[i][0] = sum / l[i][0];
    }
    z
}

/// How a rate wanders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// As temperature does: its change changes slowly.
    Third,
    /// In small steps of its own.
    Second,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// One smoothness: its maximum and what is left of uncertainty there.
struct Candidate {
    log_likelihood: f64,
    variance: f64,
    coefficients: Vec<f64>,
    covariances: Band,
    rate_variance: f64,
}

/// What the points say of the coefficients, averaged over all smoothnesses.
struct Posterior {
    grid: Grid,
    span_us: (f64, f64),
    mean: Vec<f64>,
    covariances: Band,
    variance: f64,
    free: f64,
    rate: f64,
    rate_variance: f64,
}

impl Posterior {
    fn new(
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
            (n / POINTS_PER_STEP).clamp(1, MOST_STEPS)
        };
        let steps = ((span / step_us) as usize).clamp(1, most);
        let grid = Grid {
            start_us: first,
            step_us: span / steps as f64,
            steps,
        };
        // Relative to the chord through the first and last: what is left is small.
        let y0 = points[0].1;
        let slope = (points[n - 1].1 - y0) / span;
        let rest = |x: f64, y: f64| y - y0 - slope * (x - first);
        let size = grid.size();
        let (mut information, mut right, mut squares) =
            (vec![[0.0; 4]; size], vec![0.0; size], 0.0);
        for (x, y, spread) in points {
            let y = rest(*x, *y);
            let (k, w) = grid.weights(*x);
            let counts = 1.0 / (spread * spread);
            for i in 0..4 {
                right[k + i] += counts * w[i] * y;
                for j in i..4 {
                    information[k + i][j - i] += counts * w[i] * w[j];
                }
            }
            squares += counts * y * y;
        }
        let (from, to) = between_us.unwrap_or((first, last));
        let ends = [grid.weights(from), grid.weights(to)];
        let mut chord = vec![0.0; size];
        for ((k, w), sign) in ends.iter().zip([-1.0, 1.0]) {
            for i in 0..4 {
                chord[k + i] += sign * w[i] / (to - from);
            }
        }
        let mut data = Data {
            free,
            n: n as f64,
            information,
            right,
            squares,
            chord,
        };
        // Relative to the parabola, which no penalty holds: else what is large in it would be lost in the rounding of large penalties.
        let parabola = data.parabola()?.coefficients;
        data.right = vec![0.0; size];
        data.squares = 0.0;
        for (x, y, spread) in points {
            let y = rest(*x, *y) - grid.value(&parabola, *x);
            let (k, w) = grid.weights(*x);
            let counts = 1.0 / (spread * spread);
            for (right, weight) in data.right[k..].iter_mut().zip(w) {
                *right += counts * weight * y;
            }
            data.squares += counts * y * y;
        }
        let mut candidates: Vec<Candidate> = data.parabola().into_iter().collect();
        let mean = data.information.iter().map(|r| r[0]).sum::<f64>() / size as f64;
        let wandering = data.wandering(mean);
        // A rate that changes evenly is what crystals left alone do: it has its share before anything is known.
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

/// Sums over the points.
struct Data {
    /// Coefficients that no penalty holds.
    free: usize,
    n: f64,
    information: Band,
    right: Vec<f64>,
    squares: f64,
    /// Weights of the coefficients in the mean rate.
    chord: Vec<f64>,
}

impl Data {
    /// All smoothnesses but the limit; none of so few points that a line is made of them. `mean`: information on a coefficient.
    fn wandering(&self, mean: f64) -> Vec<Candidate> {
        let mut out = Vec::new();
        for (kind, high) in [
            (Kind::Third, HIGHEST_POWER),
            (Kind::Second, 0.5 * HIGHEST_POWER),
        ] {
            for k in 0..=(2.0 * (high - LOWEST_POWER)) as usize {
                let power = LOWEST_POWER + 0.5 * k as f64;
                if self.free == FREE {
                    out.extend(self.at(mean * libm::pow(10.0, power), kind));
                }
            }
        }
        out
    }

    /// With a penalty of this size, on third differences or on how much second differences scatter about their mean: neither holds
    /// a parabola.
    fn at(&self, penalty: f64, kind: Kind) -> Option<Candidate> {
        let size = self.right.len();
        let differences: &[f64] = match kind {
            Kind::Third => &[-1.0, 3.0, -3.0, 1.0],
            Kind::Second => &[1.0, -2.0, 1.0],
        };
        let rows = size + 1 - differences.len();
        let mut a = self.information.clone();
        for k in 0..rows {
            for (i, d) in differences.iter().enumerate() {
                for (j, e) in differences.iter().enumerate().skip(i) {
                    a[k + i][j - i] += penalty * d * e;
                }
            }
        }
        let l = factor(&a)?;
        let mut determinant: f64 = l.iter().map(|r| 2.0 * libm::log(r[0])).sum();
        let mut covariances = inverse_band(&l);
        // Without their mean: less the square of their sum, which the outermost coefficients alone make up (Sherman and
        // Morrison 1950).
        let mut apart = vec![0.0; size];
        if kind == Kind::Second {
            let share = penalty / rows as f64;
            let mut sum = vec![0.0; size];
            for (at, sign) in [(0, 1.0), (1, -1.0), (size - 2, -1.0), (size - 1, 1.0)] {
                sum[at] += sign;
            }
            let solved = solve(&l, &sum);
            let left = 1.0 - share * dot(&solved, &sum);
            if left.is_nan() || left <= 1e-9 {
                return None;
            }
            // The determinant of these penalties is that of the third differences over their number.
            determinant += libm::log(left) + libm::log(rows as f64);
            let scale = (share / left).sqrt();
            apart = solved.iter().map(|v| scale * v).collect();
        }
        for i in 0..size {
            for k in 0..4.min(size - i) {
                covariances[i][k] += apart[i] * apart[i + k];
            }
        }
        let inverse = |b: &[f64]| -> Vec<f64> {
            let along = dot(&apart, b);
            let solved = solve(&l, b).into_iter().zip(&apart);
            solved.map(|(v, a)| v + along * a).collect()
        };
        let coefficients = inverse(&self.right);
        let variance = self.variance(dot(&coefficients, &self.right));
        for v in covariances.iter_mut().flatten() {
            *v *= variance;
        }
        let free = self.free_of_noise();
        let held = (size - FREE) as f64;
        Some(Candidate {
            log_likelihood: -0.5
                * (free * libm::log(variance) + determinant - held * libm::log(penalty)),
            variance,
            coefficients,
            covariances,
            rate_variance: variance * dot(&inverse(&self.chord), &self.chord),
        })
    }

    /// With an infinite penalty: a parabola is left, or the line.
    fn parabola(&self) -> Option<Candidate> {
        let size = self.right.len();
        let middle = 0.5 * (size - 1) as f64;
        let scale = middle.max(1.0);
        let basis: Vec<[f64; 3]> = (0..size)
            .map(|i| {
                let s = (i as f64 - middle) / scale;
                [1.0, s, if self.free == FREE { s * s } else { 0.0 }]
            })
            .collect();
        let mut m = nalgebra::Matrix3::<f64>::zeros();
        let (mut b, mut c) = (nalgebra::Vector3::zeros(), nalgebra::Vector3::zeros());
        for i in 0..size {
            for k in 0..4.min(size - i) {
                for p in 0..3 {
                    for q in 0..3 {
                        let v = self.information[i][k] * basis[i][p] * basis[i + k][q];
                        m[(p, q)] += v;
                        if k > 0 {
                            m[(q, p)] += v;
                        }
                    }
                }
            }
            for p in 0..3 {
                b[p] += basis[i][p] * self.right[i];
                c[p] += basis[i][p] * self.chord[i];
            }
        }
        if self.free < FREE {
            m[(2, 2)] = 1.0;
        }
        let inverse = m.try_inverse()?;
        let found = inverse * b;
        let variance = self.variance(found.dot(&b));
        let at = |i: usize| nalgebra::Vector3::from(basis[i]);
        let covariances = (0..size)
            .map(|i| {
                let mut row = [0.0; 4];
                for (k, v) in row.iter_mut().enumerate().take(4.min(size - i)) {
                    *v = variance * at(i).dot(&(inverse * at(i + k)));
                }
                row
            })
            .collect();
        // The limit of the determinants: that of the third differences is that of the monomials over 4.
        let determinant = libm::log(m.determinant()) + 6.0 * libm::log(scale) - libm::log(4.0);
        Some(Candidate {
            log_likelihood: -0.5 * (self.free_of_noise() * libm::log(variance) + determinant),
            variance,
            coefficients: (0..size).map(|i| found.dot(&at(i))).collect(),
            covariances,
            rate_variance: variance * c.dot(&(inverse * c)),
        })
    }

    /// Variance of a point, with what cancels in it kept above 0.
    fn variance(&self, explained: f64) -> f64 {
        let left = (self.squares - explained)
            .max(1e-12 * self.squares)
            .max(1e-12);
        left / self.free_of_noise()
    }

    fn free_of_noise(&self) -> f64 {
        self.n - self.free as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point each second whose deviation is `y` of its time in µs, with noise of 1 µs in turn.
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
        let map = Smooth::fit(&all, 10e6, 0.5).unwrap();
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
        // Half an hour beyond the end much less is known.
        assert!(map.standard_error(5.4e9) > 5.0 * map.standard_error(3.6e9));
    }

    #[test]
    fn few_points_give_the_line_of_least_squares() {
        let all = points(6, |x| 3e-6 * x);
        let map = Smooth::fit(&all, 1e9, 0.1).unwrap();
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
    fn the_limit_of_smoothness_is_the_parabola() {
        let all: Vec<(f64, f64, f64)> = points(60, |x| 1e-13 * x * x)
            .iter()
            .map(|p| (p.from_us, p.to_us - p.from_us, 1.0))
            .collect();
        let posterior = Posterior::new(&all, 10e6, None).unwrap();
        let size = posterior.grid.size();
        let mut data = Data {
            free: FREE,
            n: 60.0,
            information: vec![[0.0; 4]; size],
            right: vec![0.0; size],
            squares: 0.0,
            chord: vec![0.0; size],
        };
        for (x, y, _) in &all {
            let (k, w) = posterior.grid.weights(*x);
            for i in 0..4 {
                data.right[k + i] += w[i] * y;
                for j in i..4 {
                    data.information[k + i][j - i] += w[i] * w[j];
                }
            }
            data.squares += y * y;
        }
        let limit = data.parabola().unwrap();
        for (kind, penalty) in [(Kind::Third, 1e9), (Kind::Second, 1e7)] {
            let near = data.at(penalty, kind).unwrap();
            let off = near.log_likelihood - limit.log_likelihood;
            assert!(off.abs() < 0.05, "{kind:?}: {off}");
            for (a, b) in near.covariances.iter().zip(&limit.covariances) {
                assert!((a[0] - b[0]).abs() < 0.02 * b[0]);
            }
        }
    }

    #[test]
    fn too_little_gives_no_map() {
        assert_eq!(Smooth::fit(&points(2, |_| 0.0), 10e6, 1.0), None);
        let same = vec![Point::new(1.0, 2.0); 9];
        assert_eq!(Smooth::fit(&same, 10e6, 1.0), None);
    }
}
