//! Two Gaussian processes over the columns of both cameras, one for each coordinate, with one kernel.
//!
//! Kernel: squared exponential with a length scale per column. Noise: a fixed variance, and one that grows with the
//! position's sensitivity to the columns and with few cluster events ([`Sample::variance`]). One kernel for both
//! coordinates makes the result independent of the direction of the axes.
//!
//! Hyperparameters maximise the marginal likelihood with weak priors, from several starts on a subset, then on up to
//! [`LEARNING`] observations. Observations beyond what the others predict get less weight (Student's t with 4 degrees of
//! freedom); none is dropped.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SVector};

use super::base::{LEAST_MM, robust_sigma, weight};
use super::precision::Precision;
use super::quasi_newton::{Slope, minimise};
use super::samples::{Sample, thinned};
use crate::result::{FieldModel, FieldPoint};

/// Unit of length scales, px.
const UNIT_PX: f64 = 100.0;
/// Observations that choose among the starts, and that determine the hyperparameters.
const STARTING: usize = 60;
const LEARNING: usize = 120;
/// Logarithms of amplitude, two length scales, fixed scatter and column scatter.
const LOGS: usize = 5;
pub(super) type Logs = SVector<f64, LOGS>;
/// Length scales of the starts, in [`UNIT_PX`].
const STARTS: [[f64; 2]; 4] = [[0.7, 0.7], [2.0, 2.0], [0.7, 3.0], [3.0, 0.7]];
/// Centre and standard deviation of the prior of a logarithmic length scale: 150 px within a factor of 2.7.
const LENGTH_PRIOR: (f64, f64) = (0.405, 1.0);
/// Standard deviation of the priors of the other logarithms.
const LOOSE: f64 = 2.0;
/// Steps of a descent, and the gain in log likelihood that ends it.
const STEPS: usize = 40;
const TOLERANCE: f64 = 1e-4;
/// Rounds of weights, and updates of the weights within a round.
const ROUNDS: usize = 2;
const UPDATES: usize = 3;

/// What the likelihood depends on besides the hyperparameters.
struct Likelihood<'a> {
    samples: &'a [Sample],
    weights: &'a [f64],
    centre: Logs,
}

impl Likelihood<'_> {
    /// Centre of the priors: amplitude and scatter of the size of the residuals.
    fn centre(samples: &[Sample]) -> Logs {
        let squares: Vec<f64> = samples.iter().map(Sample::square).collect();
        let sigma = robust_sigma(&squares);
        let mut magnifications: Vec<f64> = samples.iter().map(|s| s.magnification).collect();
        magnifications.sort_unstable_by(f64::total_cmp);
        let typical = magnifications.get(samples.len() / 2).copied().unwrap_or(1.0);
        let column = sigma / typical.sqrt().max(1e-6);
        Logs::from([
            libm::log(sigma),
            LENGTH_PRIOR.0,
            LENGTH_PRIOR.0,
            libm::log(0.7 * sigma),
            libm::log(0.5 * column),
        ])
    }

    /// Variance of an observation under these logarithms, mm².
    fn variance(&self, i: usize, logs: &Logs) -> f64 {
        let [fixed, column] = [logs[3], logs[4]].map(|l| libm::exp(2.0 * l));
        self.samples[i].variance(fixed, column) / self.weights[i] + LEAST_MM * LEAST_MM
    }

    /// Negative logarithm of the prior.
    fn prior(&self, logs: &Logs) -> Slope<LOGS> {
        let spread = Logs::from([LOOSE, LENGTH_PRIOR.1, LENGTH_PRIOR.1, LOOSE, LOOSE]);
        let off = (logs - self.centre).component_div(&spread);
        (0.5 * off.norm_squared(), off.component_div(&spread))
    }

    /// Negative logarithm of the posterior density, up to a constant; `None` where the kernel is not positive definite.
    fn evaluate(&self, logs: &Logs) -> Option<Slope<LOGS>> {
        let n = self.samples.len();
        let kernel = Kernel::new(logs);
        let mut matrix = DMatrix::zeros(n, n);
        for j in 0..n {
            for i in j + 1..n {
                let value = kernel.of(self.samples[i].columns, self.samples[j].columns);
                matrix[(i, j)] = value;
                matrix[(j, i)] = value;
            }
            matrix[(j, j)] = kernel.variance;
        }
        let mut noisy = matrix.clone();
        for i in 0..n {
            noisy[(i, i)] += self.variance(i, logs);
        }
        let precision = Precision::of(noisy)?;
        let sides = [0, 1].map(|k| DVector::from_fn(n, |i, _| self.samples[i].residual[k]));
        let weights = [0, 1].map(|k| precision.times(&sides[k]));
        let (mut value, mut by) = self.prior(logs);
        value += 2.0 * precision.log_root_determinant() + 0.5 * (sides[0].dot(&weights[0]) + sides[1].dot(&weights[1]));
        let slope = |i: usize, j: usize| {
            2.0 * precision.element(i, j) - weights[0][i] * weights[0][j] - weights[1][i] * weights[1][j]
        };
        for j in 0..n {
            let b = self.samples[j].columns;
            for i in j + 1..n {
                let a = self.samples[i].columns;
                let part = slope(i, j) * matrix[(i, j)];
                by[0] += 2.0 * part;
                for k in 0..2 {
                    let off = (a[k] - b[k]) * kernel.per_length[k];
                    by[1 + k] += part * off * off;
                }
            }
            let own = 0.5 * slope(j, j);
            by[0] += 2.0 * own * kernel.variance;
            let [fixed, column] = [logs[3], logs[4]].map(|l| libm::exp(2.0 * l));
            by[3] += 2.0 * own * self.samples[j].variance(fixed, 0.0) / self.weights[j];
            by[4] += 2.0 * own * self.samples[j].variance(0.0, column) / self.weights[j];
        }
        let finite = value.is_finite() && by.iter().all(|v| v.is_finite());
        finite.then_some((value, by))
    }

    /// The same without a field: the last two logarithms alone.
    fn evaluate_scatter(&self, logs: &SVector<f64, 2>) -> Option<Slope<2>> {
        let mut all = self.centre;
        (all[3], all[4]) = (logs[0], logs[1]);
        let (mut value, prior) = self.prior(&all);
        let mut by = SVector::from([prior[3], prior[4]]);
        let [fixed, column] = [logs[0], logs[1]].map(|l| libm::exp(2.0 * l));
        for (i, sample) in self.samples.iter().enumerate() {
            let variance = self.variance(i, &all);
            let square = sample.square() / variance;
            value += libm::log(variance) + 0.5 * square;
            let own = (2.0 - square) / variance / self.weights[i];
            by[0] += own * sample.variance(fixed, 0.0);
            by[1] += own * sample.variance(0.0, column);
        }
        let finite = value.is_finite() && by.iter().all(|v| v.is_finite());
        finite.then_some((value, by))
    }
}

/// The covariance of the field between two pairs of columns.
#[derive(Debug, Clone, Copy)]
struct Kernel {
    variance: f64,
    /// 1 / length scale, 1/px.
    per_length: [f64; 2],
}

impl Kernel {
    fn new(logs: &Logs) -> Self {
        Self {
            variance: libm::exp(2.0 * logs[0]),
            per_length: [1, 2].map(|k| libm::exp(-logs[k]) / UNIT_PX),
        }
    }

    fn of(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        let square = |k: usize| {
            let off = (a[k] - b[k]) * self.per_length[k];
            off * off
        };
        self.variance * libm::exp(-0.5 * (square(0) + square(1)))
    }
}

/// Weights of the samples before anything is known: by the size of the residual alone.
fn first_weights(samples: &[Sample]) -> Vec<f64> {
    let squares: Vec<f64> = samples.iter().map(Sample::square).collect();
    let variance = robust_sigma(&squares).powi(2);
    squares.iter().map(|s| weight(s / variance)).collect()
}

/// A fitted field before it is solved: model, scatter (fixed mm, column px) and hyperparameters.
pub(super) struct Learnt {
    pub model: FieldModel,
    pub scatter: [f64; 2],
    pub logs: Logs,
}

/// Learns a field from the samples; `from`: hyperparameters of a fit to almost the same samples. `None` if no start gives a
/// positive definite kernel.
pub(super) fn learn(samples: &[Sample], from: Option<&Logs>) -> Option<Learnt> {
    let mut weights = first_weights(samples);
    let centre = Likelihood::centre(samples);
    let rows: Vec<usize> = (0..samples.len()).collect();
    let descend = |most: usize, weights: &[f64], start: Logs| {
        let rows = thinned(&rows, most);
        let part: Vec<Sample> = rows.iter().map(|i| samples[*i]).collect();
        let weights: Vec<f64> = rows.iter().map(|i| weights[*i]).collect();
        let likelihood = Likelihood {
            samples: &part,
            weights: &weights,
            centre,
        };
        minimise(start, STEPS, TOLERANCE, |logs| likelihood.evaluate(logs))
    };
    let mut logs = match from {
        Some(logs) => *logs,
        None => {
            let starts = STARTS.map(|[a, b]| {
                let mut start = centre;
                (start[1], start[2]) = (libm::log(a), libm::log(b));
                descend(STARTING, &weights, start)
            });
            let best = starts.into_iter().flatten();
            best.min_by(|a, b| a.1.total_cmp(&b.1))?.0
        }
    };
    for _ in 0..ROUNDS {
        logs = descend(LEARNING, &weights, logs)?.0;
        for _ in 0..UPDATES {
            weights = new_weights(samples, &weights, centre, &logs)?;
        }
    }
    let kernel = Kernel::new(&logs);
    let likelihood = Likelihood {
        samples,
        weights: &weights,
        centre,
    };
    Some(Learnt {
        model: FieldModel {
            amplitude_mm: kernel.variance.sqrt(),
            length_px: kernel.per_length.map(|l| 1.0 / l),
            points: samples
                .iter()
                .enumerate()
                .map(|(i, s)| FieldPoint {
                    columns: s.columns,
                    residual_mm: s.residual,
                    variance_mm2: likelihood.variance(i, &logs),
                })
                .collect(),
        },
        scatter: [libm::exp(logs[3]), libm::exp(logs[4])],
        logs,
    })
}

/// Weights by how far each observation is from what the others predict.
fn new_weights(
    samples: &[Sample],
    weights: &[f64],
    centre: Logs,
    logs: &Logs,
) -> Option<Vec<f64>> {
    let likelihood = Likelihood {
        samples,
        weights,
        centre,
    };
    let kernel = Kernel::new(logs);
    let n = samples.len();
    let noisy = DMatrix::from_fn(n, n, |i, j| {
        let noise = if i == j { likelihood.variance(i, logs) } else { 0.0 };
        kernel.of(samples[i].columns, samples[j].columns) + noise
    });
    let precision = Precision::of(noisy)?;
    let alpha = [0, 1].map(|k| precision.times(&DVector::from_fn(n, |i, _| samples[i].residual[k])));
    let [fixed, column] = [logs[3], logs[4]].map(|l| libm::exp(2.0 * l));
    let each = (0..n).map(|i| {
        // Leave-one-out prediction: residual `alpha / q`, variance `1 / q`, with q the diagonal of the inverse.
        let q = precision.element(i, i);
        let alpha = [alpha[0][i], alpha[1][i]];
        let full = samples[i].variance(fixed, column) + LEAST_MM * LEAST_MM;
        let predicted = (1.0 / q - likelihood.variance(i, logs)).max(0.0) + full;
        weight((alpha[0] * alpha[0] + alpha[1] * alpha[1]) / (q * q) / predicted)
    });
    Some(each.collect())
}

/// Fixed scatter (mm) and column scatter (px) without a field; `None` without samples.
pub(super) fn scatter(samples: &[Sample]) -> Option<[f64; 2]> {
    if samples.is_empty() {
        return None;
    }
    let mut weights = first_weights(samples);
    let centre = Likelihood::centre(samples);
    let mut logs = SVector::from([centre[3], centre[4]]);
    for _ in 0..ROUNDS {
        let likelihood = Likelihood {
            samples,
            weights: &weights,
            centre,
        };
        logs = minimise(logs, STEPS, TOLERANCE, |l| likelihood.evaluate_scatter(l))?.0;
        let [fixed, column] = [logs[0], logs[1]].map(|l| libm::exp(2.0 * l));
        let each = samples.iter();
        weights = each
            .map(|s| weight(s.square() / (s.variance(fixed, column) + LEAST_MM * LEAST_MM)))
            .collect();
    }
    Some([libm::exp(logs[0]), libm::exp(logs[1])])
}

/// A field that predicts.
#[derive(Debug, Clone)]
pub(super) struct Field {
    kernel: Kernel,
    columns: Vec<[f64; 2]>,
    factor: Cholesky<f64, Dyn>,
    /// Weights of the observations, x and y.
    weights: [DVector<f64>; 2],
    /// Largest correction at an observation, mm.
    largest_mm: f64,
    /// Share of the field's variance that the observations explain where they are: the lowest tenth of them.
    explained: f64,
}

/// Prediction of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Correction {
    /// To add to the base position, mm.
    pub by: [f64; 2],
    /// Variance of the field, either coordinate, mm².
    pub variance_mm2: f64,
    /// Share of the field's variance that is not explained, 0..=1.
    pub open: f64,
    /// True beyond the columns of the calibration presses.
    pub extrapolated: bool,
}

impl Field {
    /// `None` if the observations do not make a positive definite kernel.
    pub(super) fn new(model: &FieldModel) -> Option<Self> {
        let points = &model.points;
        let n = points.len();
        let kernel = Kernel {
            variance: model.amplitude_mm * model.amplitude_mm,
            per_length: model.length_px.map(|l| 1.0 / l),
        };
        let noisy = DMatrix::from_fn(n, n, |i, j| {
            let noise = if i == j { points[i].variance_mm2 } else { 0.0 };
            kernel.of(points[i].columns, points[j].columns) + noise
        });
        let factor = Cholesky::new(noisy)?;
        let weights =
            [0, 1].map(|k| factor.solve(&DVector::from_fn(n, |i, _| points[i].residual_mm[k])));
        let mut field = Self {
            kernel,
            columns: points.iter().map(|p| p.columns).collect(),
            factor,
            weights,
            largest_mm: 0.0,
            explained: 0.0,
        };
        let own: Vec<([f64; 2], f64)> = points.iter().map(|p| field.raw(p.columns)).collect();
        let lengths = own.iter().map(|(by, _)| libm::hypot(by[0], by[1]));
        let largest_mm = lengths.fold(0.0, f64::max);
        let mut explained: Vec<f64> = own.iter().map(|(_, open)| 1.0 - open).collect();
        explained.sort_unstable_by(f64::total_cmp);
        (field.largest_mm, field.explained) = (largest_mm, *explained.get(n / 10)?);
        let finite = field.largest_mm.is_finite() && field.explained > 0.0;
        finite.then_some(field)
    }

    /// Posterior mean and unexplained share of the variance.
    fn raw(&self, columns: [f64; 2]) -> ([f64; 2], f64) {
        let near = DVector::from_iterator(
            self.columns.len(),
            self.columns.iter().map(|c| self.kernel.of(columns, *c)),
        );
        let by = [0, 1].map(|k| near.dot(&self.weights[k]));
        let explained = match self.factor.l_dirty().solve_lower_triangular(&near) {
            Some(solved) => solved.norm_squared() / self.kernel.variance,
            None => 0.0,
        };
        (by, (1.0 - explained).clamp(0.0, 1.0))
    }

    /// The correction here. Beyond the observations it fades as they explain less, and it never exceeds the largest
    /// correction among them.
    pub(super) fn correction(&self, columns: [f64; 2]) -> Correction {
        let (by, open) = self.raw(columns);
        let fade = ((1.0 - open) / self.explained).min(1.0);
        let length = libm::hypot(by[0], by[1]);
        let bound = if length > self.largest_mm {
            self.largest_mm / length
        } else {
            1.0
        };
        Correction {
            by: by.map(|b| b * fade * bound),
            variance_mm2: open * self.kernel.variance,
            open,
            extrapolated: fade < 0.5,
        }
    }
}
