//! The likelihood of a field's hyperparameters, and the weights of its observations.

use nalgebra::SVector;
use skinrig_simd::InstructionSet;

use super::quasi_newton::ValueAndGradient;
use super::robust::{LEAST, scale, weight};
use super::samples::Sample;
use crate::lanes::{Factor, Group, LANES, Lower, of_negatives};

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

    /// Covariances for squared distances, mm².
    #[inline(always)]
    pub(super) fn of(&self, squares: &Group) -> Group {
        let half = -0.5 * self.per_length * self.per_length;
        of_negatives(&squares.map(|square| half * square)).map(|share| share * self.variance)
    }
}

/// Squared distances between positions, mm²; zeros on the diagonal.
pub(super) fn squares(at: &[[f64; 2]]) -> Lower {
    Lower::from_fn(at.len(), |i, j| {
        let [x, y] = [0, 1].map(|axis| at[i][axis] - at[j][axis]);
        x * x + y * y
    })
}

/// The covariances of a field between positions with these squared distances, below the diagonal; zeros on the diagonal.
pub(super) fn smooth(instructions: InstructionSet, kernel: &Kernel, squares: &Lower) -> Lower {
    instructions.run(
        #[inline(always)]
        || {
            Lower::combine(
                [squares],
                #[inline(always)]
                |[squares]| kernel.of(squares),
            )
        },
    )
}

/// Data of the likelihood, besides the hyperparameters.
pub(super) struct Likelihood<'a> {
    samples: &'a [Sample],
    weights: &'a [f64],
    /// Centre of the priors.
    centre: Logs,
    squares: &'a Lower,
    instructions: InstructionSet,
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

impl<'a> Likelihood<'a> {
    /// Of weighted samples, with the squared distances of their positions.
    pub(super) fn new(
        samples: &'a [Sample],
        weights: &'a [f64],
        centre: Logs,
        squares: &'a Lower,
    ) -> Self {
        Self {
            samples,
            weights,
            centre,
            squares,
            instructions: InstructionSet::best(),
        }
    }

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

    fn residuals(&self) -> impl Iterator<Item = f64> {
        self.samples.iter().map(|s| s.residual)
    }

    /// Negative logarithm of the posterior density, up to a constant; `None` where the kernel is not positive definite.
    pub(super) fn evaluate(&self, logs: &Logs) -> Option<ValueAndGradient<LOGS>> {
        let kernel = Kernel::new(logs);
        let smooth = smooth(self.instructions, &kernel, self.squares);
        let mut noisy = smooth.clone();
        noisy.add_to_diagonal(|i| kernel.variance + self.variance(i, logs));
        let factor = Factor::of(noisy)?;
        let alpha = factor.solve(self.residuals());
        let (mut value, mut by) = self.prior(logs);
        let fit: f64 = self
            .residuals()
            .zip(alpha.as_flattened())
            .map(|(r, a)| r * a)
            .sum();
        value += factor.log_root_determinant() + 0.5 * fit;
        let inverse = factor.inverse();
        let parts = [&inverse, &smooth, self.squares];
        let [amplitude, length] = self.instructions.run(
            #[inline(always)]
            || Lower::sums(parts, &alpha, slopes),
        );
        let per_length = kernel.per_length * kernel.per_length;
        by[0] += 2.0 * amplitude;
        by[1] += length * per_length;
        let [fixed, column] = scatter(logs);
        for (j, alpha) in alpha.as_flattened()[..self.samples.len()]
            .iter()
            .enumerate()
        {
            let own = inverse.get(j, j) - alpha * alpha;
            by[0] += own * kernel.variance;
            by[2] += own * self.samples[j].variance(fixed, 0.0) / self.weights[j];
            by[3] += own * self.samples[j].variance(0.0, column) / self.weights[j];
        }
        let finite = value.is_finite() && by.iter().all(|v| v.is_finite());
        finite.then_some((value, by))
    }

    /// Weights by how far each observation is from what the others predict. `smooth`: as from [`smooth`].
    pub(super) fn new_weights(&self, logs: &Logs, smooth: &Lower) -> Option<Vec<f64>> {
        let kernel = Kernel::new(logs);
        let mut noisy = smooth.clone();
        noisy.add_to_diagonal(|i| kernel.variance + self.variance(i, logs));
        let factor = Factor::of(noisy)?;
        let alpha = factor.solve(self.residuals());
        let [fixed, column] = scatter(logs);
        let each = factor.inverse_diagonal().into_iter().enumerate();
        let each = each.zip(alpha.as_flattened()).map(|((i, q), alpha)| {
            // Leave-one-out prediction: residual `alpha / q`, variance `1 / q`, with q the diagonal of the inverse.
            let full = self.samples[i].variance(fixed, column) + LEAST * LEAST;
            let predicted = (1.0 / q - self.variance(i, logs)).max(0.0) + full;
            weight(alpha * alpha / (q * q) / predicted, 1.0)
        });
        Some(each.collect())
    }
}

/// Change of the likelihood with the covariance, times the covariance; and that times the squared distance. Of the groups of the
/// inverse of the noisy covariance, of the covariance and of the squared distances, and of the weighted residuals.
#[inline(always)]
fn slopes([inverse, smooth, squares]: [&Group; 3], alpha: &Group, by_column: f64) -> [Group; 2] {
    let mut parts = [[0.0; LANES]; 2];
    for i in 0..LANES {
        parts[0][i] = (inverse[i] - alpha[i] * by_column) * smooth[i];
        parts[1][i] = parts[0][i] * squares[i];
    }
    parts
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
        let at: Vec<[f64; 2]> = samples.iter().map(|s| s.at).collect();
        let squares = squares(&at);
        let likelihood = Likelihood::new(&samples, &weights, centre(&samples), &squares);
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
