//! The likelihood of a field's hyperparameters, and the weights of its observations.

use nalgebra::{DMatrix, DVector, SVector};

use super::precision::Precision;
use super::quasi_newton::ValueAndGradient;
use super::robust::{LEAST, scale, weight};
use super::samples::Sample;

/// Logarithms of amplitude (px), length scale (mm), fixed scatter and scatter by events (px).
const LOGS: usize = 4;
pub(super) type Logs = SVector<f64, LOGS>;
/// Centre and standard deviation of the prior of a logarithmic length scale: 20 mm within a factor of 2.7, a fifth of the
/// skin's side.
const LENGTH_PRIOR: (f64, f64) = (2.996, 1.0);
/// Standard deviation of the priors of the other logarithms.
const LOOSE: f64 = 2.0;

/// The covariance of a field between two positions: squared exponential, the same in every direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kernel {
    pub variance: f64,
    /// 1 / length scale, 1/mm.
    pub per_length: f64,
}

impl Kernel {
    pub(super) fn new(logs: &Logs) -> Self {
        Self {
            variance: libm::exp(2.0 * logs[0]),
            per_length: libm::exp(-logs[1]),
        }
    }

    /// Squared distance in length scales.
    fn square(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        let (x, y) = (
            (a[0] - b[0]) * self.per_length,
            (a[1] - b[1]) * self.per_length,
        );
        x * x + y * y
    }

    pub(super) fn of(&self, a: [f64; 2], b: [f64; 2]) -> f64 {
        self.variance * libm::exp(-0.5 * self.square(a, b))
    }
}

/// What the likelihood depends on besides the hyperparameters.
pub(super) struct Likelihood<'a> {
    pub samples: &'a [Sample],
    pub weights: &'a [f64],
    /// Centre of the priors.
    pub centre: Logs,
}

/// Centre of the priors: amplitude and scatter of the size of the residuals.
pub(super) fn centre(samples: &[Sample]) -> Logs {
    let sigma = scale(samples.iter().map(|s| s.residual));
    let mut responses: Vec<f64> = samples.iter().map(|s| s.response).collect();
    responses.sort_unstable_by(f64::total_cmp);
    let typical = responses
        .get(samples.len() / 2)
        .copied()
        .unwrap_or(1.0)
        .max(1e-12);
    Logs::from([
        libm::log(sigma),
        LENGTH_PRIOR.0,
        libm::log(0.7 * sigma),
        libm::log(0.5 * sigma / typical.sqrt()),
    ])
}

/// Fixed variance and variance by events, px².
pub(super) fn scatter(logs: &Logs) -> [f64; 2] {
    [2, 3].map(|i| libm::exp(2.0 * logs[i]))
}

impl Likelihood<'_> {
    /// Variance of an observation under these logarithms.
    pub(super) fn variance(&self, i: usize, logs: &Logs) -> f64 {
        let [fixed, column] = scatter(logs);
        self.samples[i].variance(fixed, column) / self.weights[i] + LEAST * LEAST
    }

    /// Negative logarithm of the prior.
    fn prior(&self, logs: &Logs) -> ValueAndGradient<LOGS> {
        let spread = Logs::from([LOOSE, LENGTH_PRIOR.1, LOOSE, LOOSE]);
        let off = (logs - self.centre).component_div(&spread);
        (0.5 * off.norm_squared(), off.component_div(&spread))
    }

    fn residuals(&self) -> DVector<f64> {
        DVector::from_iterator(self.samples.len(), self.samples.iter().map(|s| s.residual))
    }

    /// Covariance of the observations without their scatter.
    fn smooth(&self, kernel: Kernel) -> DMatrix<f64> {
        let n = self.samples.len();
        let mut matrix = DMatrix::zeros(n, n);
        for j in 0..n {
            for i in j + 1..n {
                matrix[(i, j)] = kernel.of(self.samples[i].at, self.samples[j].at);
            }
            matrix[(j, j)] = kernel.variance;
        }
        matrix
    }

    /// Negative logarithm of the posterior density, up to a constant; `None` where the kernel is not positive definite.
    pub(super) fn evaluate(&self, logs: &Logs) -> Option<ValueAndGradient<LOGS>> {
        let n = self.samples.len();
        let kernel = Kernel::new(logs);
        let smooth = self.smooth(kernel);
        let mut noisy = smooth.clone();
        for i in 0..n {
            noisy[(i, i)] += self.variance(i, logs);
        }
        let precision = Precision::of(noisy)?;
        let residuals = self.residuals();
        let alpha = precision.times(&residuals);
        let (mut value, mut by) = self.prior(logs);
        value += precision.log_root_determinant() + 0.5 * residuals.dot(&alpha);
        let slope = |i: usize, j: usize| precision.element(i, j) - alpha[i] * alpha[j];
        let [fixed, column] = scatter(logs);
        for j in 0..n {
            for i in j + 1..n {
                let part = slope(i, j) * smooth[(i, j)];
                by[0] += 2.0 * part;
                by[1] += part * kernel.square(self.samples[i].at, self.samples[j].at);
            }
            let own = slope(j, j);
            by[0] += own * kernel.variance;
            by[2] += own * self.samples[j].variance(fixed, 0.0) / self.weights[j];
            by[3] += own * self.samples[j].variance(0.0, column) / self.weights[j];
        }
        let finite = value.is_finite() && by.iter().all(|v| v.is_finite());
        finite.then_some((value, by))
    }

    /// Weights by how far each observation is from what the others predict.
    pub(super) fn new_weights(&self, logs: &Logs) -> Option<Vec<f64>> {
        let n = self.samples.len();
        let mut noisy = self.smooth(Kernel::new(logs));
        for i in 0..n {
            noisy[(i, i)] += self.variance(i, logs);
        }
        let precision = Precision::of(noisy)?;
        let alpha = precision.times(&self.residuals());
        let [fixed, column] = scatter(logs);
        let each = (0..n).map(|i| {
            // Leave-one-out prediction: residual `alpha / q`, variance `1 / q`, with q the diagonal of the inverse.
            let q = precision.element(i, i);
            let full = self.samples[i].variance(fixed, column) + LEAST * LEAST;
            let predicted = (1.0 / q - self.variance(i, logs)).max(0.0) + full;
            weight(alpha[i] * alpha[i] / (q * q) / predicted, 1.0)
        });
        Some(each.collect())
    }
}

/// Weights of the samples before anything is known: by the size of the residual alone.
pub(super) fn first_weights(samples: &[Sample]) -> Vec<f64> {
    let sigma = scale(samples.iter().map(|s| s.residual));
    samples
        .iter()
        .map(|s| weight((s.residual / sigma).powi(2), 1.0))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::locator::samples::planted;

    #[test]
    fn slopes_are_those_of_the_value() {
        let samples = planted(30);
        let weights = first_weights(&samples);
        let likelihood = Likelihood {
            samples: &samples,
            weights: &weights,
            centre: centre(&samples),
        };
        let at = Logs::from([0.3, 2.5, -1.2, -0.7]);
        let (_, by) = likelihood.evaluate(&at).unwrap();
        for i in 0..LOGS {
            let value = |step: f64| {
                let mut moved = at;
                moved[i] += step;
                likelihood.evaluate(&moved).unwrap().0
            };
            let slope = (value(1e-5) - value(-1e-5)) / 2e-5;
            assert!(
                (slope - by[i]).abs() < 1e-5 * (1.0 + slope.abs()),
                "{i}: {slope} {}",
                by[i]
            );
        }
    }
}
