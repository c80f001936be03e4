//! The covariance of two presses in the regression of depth, and the likelihood of its hyperparameters.

use nalgebra::{DMatrix, DVector, SVector};

use super::features::FEATURES;
use crate::locator::{Precision, ValueAndGradient, student_weight};

/// Logarithms of the standard deviations of the linear part, of the part by place and of the free part, of fixed noise and of
/// noise by response, and of the length scales of place (units of 20 mm) and of the free part (standardised features).
const LOGS: usize = 7;
pub(super) type Logs = SVector<f64, LOGS>;
const LINEAR: usize = 0;
const PLACE: usize = 1;
const FREE: usize = 2;
const FIXED: usize = 3;
const RESPONSE: usize = 4;
const PLACE_LENGTH: usize = 5;
const FREE_LENGTH: usize = 6;
/// Centre and standard deviation of the priors: relative depths of the order of 1, noise of 5 %.
const CENTRE: [f64; LOGS] = [0.0, -1.5, -1.5, -3.0, -3.0, 0.0, 0.5];
const LOOSE: f64 = 1.5;
/// Variance of the level.
const LEVEL: f64 = 4.0;
/// Smallest noise variance.
const LEAST: f64 = 1e-6;

pub(super) fn centre() -> Logs {
    Logs::from(CENTRE)
}

/// A press on standardised scales.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Input {
    pub features: [f64; FEATURES],
    pub place: [f64; 2],
    /// Noise variance relative to a press of median response.
    pub response: f64,
}

/// Linear product, and squared distances of features and of places.
fn related(a: &Input, b: &Input) -> [f64; 3] {
    let (mut product, mut square) = (0.0, 0.0);
    for (x, y) in a.features.iter().zip(&b.features) {
        product += x * y;
        square += (x - y) * (x - y);
    }
    let [u, v] = [0, 1].map(|k| a.place[k] - b.place[k]);
    let n = FEATURES as f64;
    [product / n, square / n, u * u + v * v]
}

/// The parts of the covariance of two presses: linear, by place, free; with the exponents' squares.
fn parts(a: &Input, b: &Input, logs: &Logs) -> ([f64; 3], [f64; 2]) {
    let [product, features, places] = related(a, b);
    let variance = |i: usize| libm::exp(2.0 * logs[i]);
    let squares = [
        places / variance(PLACE_LENGTH),
        features / variance(FREE_LENGTH),
    ];
    let smooth = squares.map(|s| libm::exp(-0.5 * s));
    (
        [
            variance(LINEAR) * product,
            variance(PLACE) * smooth[0],
            variance(FREE) * smooth[1],
        ],
        squares,
    )
}

/// Covariance of two presses without noise.
pub(super) fn covariance(a: &Input, b: &Input, logs: &Logs) -> f64 {
    let ([linear, place, free], _) = parts(a, b, logs);
    LEVEL + linear + place + free
}

/// Noise variance of a press.
pub(super) fn noise(input: &Input, logs: &Logs) -> f64 {
    let variance = |i: usize| libm::exp(2.0 * logs[i]);
    LEAST + variance(FIXED) + variance(RESPONSE) * input.response
}

/// Presses with targets and weights.
pub(super) struct Likelihood<'a> {
    pub inputs: &'a [Input],
    pub targets: &'a [f64],
    pub weights: &'a [f64],
}

impl Likelihood<'_> {
    pub(super) fn noisy(&self, logs: &Logs) -> DMatrix<f64> {
        let n = self.inputs.len();
        let mut matrix = DMatrix::zeros(n, n);
        for j in 0..n {
            for i in j..n {
                matrix[(i, j)] = covariance(&self.inputs[i], &self.inputs[j], logs);
            }
            matrix[(j, j)] += noise(&self.inputs[j], logs) / self.weights[j];
        }
        matrix
    }

    pub(super) fn targets(&self) -> DVector<f64> {
        DVector::from_column_slice(self.targets)
    }

    /// Negative logarithm of the posterior density, up to a constant; `None` where the covariance is not positive definite.
    pub(super) fn evaluate(&self, logs: &Logs) -> Option<ValueAndGradient<LOGS>> {
        let precision = Precision::of(self.noisy(logs))?;
        let targets = self.targets();
        let alpha = precision.times(&targets);
        let off = (logs - centre()) / LOOSE;
        let mut value = 0.5 * off.norm_squared();
        value += precision.log_root_determinant() + 0.5 * targets.dot(&alpha);
        let mut by = off / LOOSE;
        let n = self.inputs.len();
        for j in 0..n {
            for i in j..n {
                // Half of the trace: the other triangle doubles all but the diagonal.
                let share = if i == j { 1.0 } else { 2.0 };
                let slope = share * (precision.element(i, j) - alpha[i] * alpha[j]);
                let (parts, squares) = parts(&self.inputs[i], &self.inputs[j], logs);
                by[LINEAR] += slope * parts[0];
                by[PLACE] += slope * parts[1];
                by[FREE] += slope * parts[2];
                by[PLACE_LENGTH] += 0.5 * slope * parts[1] * squares[0];
                by[FREE_LENGTH] += 0.5 * slope * parts[2] * squares[1];
            }
            let slope = (precision.element(j, j) - alpha[j] * alpha[j]) / self.weights[j];
            by[FIXED] += slope * libm::exp(2.0 * logs[FIXED]);
            by[RESPONSE] += slope * libm::exp(2.0 * logs[RESPONSE]) * self.inputs[j].response;
        }
        let finite = value.is_finite() && by.iter().all(|v| v.is_finite());
        finite.then_some((value, by))
    }

    /// Weights by how far each press is from what the others predict, as for Student's t.
    pub(super) fn new_weights(&self, logs: &Logs) -> Option<Vec<f64>> {
        let precision = Precision::of(self.noisy(logs))?;
        let alpha = precision.times(&self.targets());
        let each = (0..self.inputs.len()).map(|i| {
            let q = precision.element(i, i);
            let own = noise(&self.inputs[i], logs);
            let predicted = (1.0 / q - own / self.weights[i]).max(0.0) + own;
            student_weight(alpha[i] * alpha[i] / (q * q) / predicted, 1.0).min(1.0)
        });
        Some(each.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_value() {
        let number = |i: usize| ((i * 7919) % 101) as f64 / 50.0 - 1.0;
        let inputs: Vec<Input> = (0..14)
            .map(|i| Input {
                features: std::array::from_fn(|j| number(31 * i + j)),
                place: [number(i), number(3 * i + 1)],
                response: 1.0 + 0.3 * number(i + 5),
            })
            .collect();
        let targets: Vec<f64> = (0..14).map(|i| number(5 * i + 2)).collect();
        let weights: Vec<f64> = (0..14).map(|i| 1.0 - 0.04 * i as f64).collect();
        let likelihood = Likelihood {
            inputs: &inputs,
            targets: &targets,
            weights: &weights,
        };
        let at = Logs::from([0.2, -0.8, -0.6, -1.2, -1.5, 0.3, 0.1]);
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
