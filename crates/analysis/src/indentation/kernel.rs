//! The covariance of two presses in the regression of depth, and the likelihood of its hyperparameters.

use nalgebra::SVector;
use skinrig_simd::InstructionSet;

use super::features::FEATURES;
use crate::lanes::{Factor, Group, LANES, Lower, of_negatives};
use crate::locator::{ValueAndGradient, student_weight};

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

/// Variances and squared length scales under these logarithms.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kernel([f64; LOGS]);

impl Kernel {
    pub(super) fn new(logs: &Logs) -> Self {
        Self(std::array::from_fn(|i| libm::exp(2.0 * logs[i])))
    }

    #[inline(always)]
    fn linear(&self, product: &Group) -> Group {
        product.map(|product| self.0[LINEAR] * product)
    }

    #[inline(always)]
    fn by_place(&self, squares: &Group) -> Group {
        self.smooth(squares, PLACE, PLACE_LENGTH)
    }

    #[inline(always)]
    fn free(&self, squares: &Group) -> Group {
        self.smooth(squares, FREE, FREE_LENGTH)
    }

    #[inline(always)]
    fn smooth(&self, squares: &Group, amplitude: usize, length: usize) -> Group {
        let half = -0.5 / self.0[length];
        of_negatives(&squares.map(|square| half * square)).map(|share| self.0[amplitude] * share)
    }

    /// Covariances without noise of one press with others, in whole groups.
    pub(super) fn covariances(&self, one: &Input, others: &[Input]) -> Vec<Group> {
        let groups = others.chunks(LANES).map(|others| {
            let mut related_to = [[0.0; LANES]; 3];
            for (i, other) in others.iter().enumerate() {
                for (group, value) in related_to.iter_mut().zip(related(one, other)) {
                    group[i] = value;
                }
            }
            let [product, features, places] = related_to;
            let linear = self.linear(&product);
            let (place, free) = (self.by_place(&places), self.free(&features));
            std::array::from_fn(|i| LEVEL + linear[i] + place[i] + free[i])
        });
        groups.collect()
    }

    /// Variance of a press without noise.
    pub(super) fn variance(&self, one: &Input) -> f64 {
        let [product, ..] = related(one, one);
        LEVEL + self.0[LINEAR] * product + self.0[PLACE] + self.0[FREE]
    }

    /// Noise variance of a press.
    pub(super) fn noise(&self, input: &Input) -> f64 {
        LEAST + self.0[FIXED] + self.0[RESPONSE] * input.response
    }
}

/// Parts of the covariances of presses below the diagonal.
struct Parts {
    linear: Lower,
    place: Lower,
    free: Lower,
}

/// Presses with targets, and how each is related to each.
pub(super) struct Likelihood<'a> {
    inputs: &'a [Input],
    targets: &'a [f64],
    /// Linear products, squared distances of features, and of places.
    related: [Lower; 3],
    instructions: InstructionSet,
}

impl<'a> Likelihood<'a> {
    pub(super) fn new(inputs: &'a [Input], targets: &'a [f64]) -> Self {
        let mut all = [(); 3].map(|()| Lower::zeros(inputs.len()));
        for j in 0..inputs.len() {
            for i in j + 1..inputs.len() {
                for (lower, value) in all.iter_mut().zip(related(&inputs[i], &inputs[j])) {
                    lower.set(i, j, value);
                }
            }
        }
        Self {
            inputs,
            targets,
            related: all,
            instructions: InstructionSet::best(),
        }
    }

    fn parts(&self, kernel: &Kernel) -> Parts {
        let [product, features, places] = self.related.each_ref();
        self.instructions.run(
            #[inline(always)]
            || Parts {
                linear: Lower::combine(
                    [product],
                    #[inline(always)]
                    |[product]| kernel.linear(product),
                ),
                place: Lower::combine(
                    [places],
                    #[inline(always)]
                    |[squares]| kernel.by_place(squares),
                ),
                free: Lower::combine(
                    [features],
                    #[inline(always)]
                    |[squares]| kernel.free(squares),
                ),
            },
        )
    }

    /// Covariances with noise, factorised; `None` if they are not positive definite.
    fn factor_of(&self, kernel: &Kernel, parts: &Parts, weights: &[f64]) -> Option<Factor> {
        let mut noisy = Lower::combine(
            [&parts.linear, &parts.place, &parts.free],
            |[linear, place, free]| std::array::from_fn(|i| LEVEL + linear[i] + place[i] + free[i]),
        );
        noisy.add_to_diagonal(|i| {
            let one = &self.inputs[i];
            kernel.variance(one) + kernel.noise(one) / weights[i]
        });
        Factor::of(noisy)
    }

    /// The factorised covariances with noise, and their inverse times the targets.
    pub(super) fn solved(&self, logs: &Logs, weights: &[f64]) -> Option<(Factor, Vec<Group>)> {
        let kernel = Kernel::new(logs);
        let factor = self.factor_of(&kernel, &self.parts(&kernel), weights)?;
        let alpha = factor.solve(self.targets.iter().copied());
        Some((factor, alpha))
    }

    /// Negative logarithm of the posterior density, up to a constant; `None` where the covariance is not positive definite.
    pub(super) fn evaluate(&self, logs: &Logs, weights: &[f64]) -> Option<ValueAndGradient<LOGS>> {
        let kernel = Kernel::new(logs);
        let parts = self.parts(&kernel);
        let factor = self.factor_of(&kernel, &parts, weights)?;
        let alpha = factor.solve(self.targets.iter().copied());
        let inverse = factor.inverse();
        let off = (logs - centre()) / LOOSE;
        let products = self.targets.iter().zip(alpha.as_flattened());
        let fit: f64 = products.map(|(target, alpha)| target * alpha).sum();
        let value = 0.5 * off.norm_squared() + factor.log_root_determinant() + 0.5 * fit;
        let mut by = off / LOOSE;
        let [_, features, places] = self.related.each_ref();
        let sums = self.instructions.run(
            #[inline(always)]
            || {
                Lower::sums(
                    [
                        &inverse,
                        &parts.linear,
                        &parts.place,
                        &parts.free,
                        places,
                        features,
                    ],
                    &alpha,
                    slopes,
                )
            },
        );
        // Half of the trace of both triangles.
        by[LINEAR] += 2.0 * sums[0];
        by[PLACE] += 2.0 * sums[1];
        by[FREE] += 2.0 * sums[2];
        by[PLACE_LENGTH] += sums[3] / kernel.0[PLACE_LENGTH];
        by[FREE_LENGTH] += sums[4] / kernel.0[FREE_LENGTH];
        for (j, alpha) in alpha.as_flattened()[..self.inputs.len()].iter().enumerate() {
            let slope = inverse.get(j, j) - alpha * alpha;
            let one = &self.inputs[j];
            let [product, ..] = related(one, one);
            by[LINEAR] += slope * kernel.0[LINEAR] * product;
            by[PLACE] += slope * kernel.0[PLACE];
            by[FREE] += slope * kernel.0[FREE];
            by[FIXED] += slope * kernel.0[FIXED] / weights[j];
            by[RESPONSE] += slope * kernel.0[RESPONSE] * one.response / weights[j];
        }
        let finite = value.is_finite() && by.iter().all(|v| v.is_finite());
        finite.then_some((value, by))
    }

    /// Weights by how far each press is from what the others predict, as for Student's t.
    pub(super) fn new_weights(&self, logs: &Logs, weights: &[f64]) -> Option<Vec<f64>> {
        let kernel = Kernel::new(logs);
        let (factor, alpha) = self.solved(logs, weights)?;
        let each = factor
            .inverse_diagonal()
            .into_iter()
            .zip(alpha.as_flattened());
        let each = each.enumerate().map(|(i, (q, alpha))| {
            let own = kernel.noise(&self.inputs[i]);
            let predicted = (1.0 / q - own / weights[i]).max(0.0) + own;
            student_weight(alpha * alpha / (q * q) / predicted, 1.0).min(1.0)
        });
        Some(each.collect())
    }
}

/// Changes of the likelihood with the parts of the covariance, times these parts: linear, by place, free; and the last two times the
/// squared distances. Of the groups of the inverse of the noisy covariance, of the parts and of the squared distances, and of the
/// weighted targets.
#[inline(always)]
fn slopes(
    [inverse, linear, place, free, places, features]: [&Group; 6],
    alpha: &Group,
    by_column: f64,
) -> [Group; 5] {
    let mut parts = [[0.0; LANES]; 5];
    for i in 0..LANES {
        let slope = inverse[i] - alpha[i] * by_column;
        parts[0][i] = slope * linear[i];
        parts[1][i] = slope * place[i];
        parts[2][i] = slope * free[i];
        parts[3][i] = parts[1][i] * places[i];
        parts[4][i] = parts[2][i] * features[i];
    }
    parts
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
        let likelihood = Likelihood::new(&inputs, &targets);
        let at = Logs::from([0.2, -0.8, -0.6, -1.2, -1.5, 0.3, 0.1]);
        let (_, by) = likelihood.evaluate(&at, &weights).unwrap();
        for i in 0..LOGS {
            let value = |step: f64| {
                let mut moved = at;
                moved[i] += step;
                likelihood.evaluate(&moved, &weights).unwrap().0
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
