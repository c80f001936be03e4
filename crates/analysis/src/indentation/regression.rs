//! Gaussian process from the features of a press to the logarithm of a positive quantity: depth or force.
//!
//! A linear part, a part that varies smoothly with the place, and a smooth part of all features; noise is fixed or grows as
//! events become fewer. Presses beyond what the others predict lose weight.

use super::features::{FEATURES, Observation};
use super::kernel::{Input, Kernel, Likelihood, Logs, centre};
use crate::lanes::{Factor, Group};
use crate::locator::{minimise, thinned};

/// Maximum number of presses of a fit, and of those that determine the hyperparameters.
const MOST: usize = 300;
const LEARNING: usize = 150;
/// Steps of a descent; fewer from hyperparameters of almost the same presses.
const STEPS: usize = 40;
const NEAR_STEPS: usize = 8;
/// Gain in log likelihood that ends a descent.
const TOLERANCE: f64 = 1e-3;
/// Rounds of weights.
const ROUNDS: usize = 2;

/// A fitted regression.
#[derive(Debug, Clone)]
pub(super) struct Regression {
    logs: Logs,
    /// Mean and standard deviation of each feature.
    scales: [(f64, f64); FEATURES],
    /// Mean logarithm of the quantity.
    level: f64,
    /// Median events.
    reference: f64,
    inputs: Vec<Input>,
    alpha: Vec<Group>,
    factor: Factor,
}

/// Logarithm of the quantity of a press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prediction {
    /// Mean.
    pub mean: f64,
    /// Variance from what the model does not know, and from noise.
    pub model: f64,
    pub noise: f64,
}

impl Regression {
    /// Learns from observations with positive quantities; `None` if they make no positive definite covariance.
    pub(super) fn fit(pairs: &[(Observation, f64)], near: Option<&Logs>) -> Option<Self> {
        let pairs = thinned(pairs, MOST);
        let n = pairs.len() as f64;
        let scales = std::array::from_fn(|j| {
            let mean = pairs.iter().map(|(o, _)| o.features[j]).sum::<f64>() / n;
            let square = |o: &Observation| (o.features[j] - mean) * (o.features[j] - mean);
            let sd = (pairs.iter().map(|(o, _)| square(o)).sum::<f64>() / n).sqrt();
            // A feature that never changes says nothing.
            (mean, if sd > 1e-9 { sd } else { f64::INFINITY })
        });
        let logarithms: Vec<f64> = pairs.iter().map(|(_, v)| libm::log(*v)).collect();
        let level = logarithms.iter().sum::<f64>() / n;
        let targets: Vec<f64> = logarithms.iter().map(|v| v - level).collect();
        let mut events: Vec<f64> = pairs.iter().map(|(o, _)| o.events).collect();
        events.sort_unstable_by(f64::total_cmp);
        let reference = *events.get(events.len() / 2)?;
        let standard = |(o, _): &(Observation, f64)| standardised(o, &scales, reference);
        let inputs: Vec<Input> = pairs.iter().map(standard).collect();
        let (logs, factor, alpha) = {
            let all = Likelihood::new(&inputs, &targets);
            let (logs, weights) = learn(&all, &inputs, &targets, near)?;
            let (factor, alpha) = all.solved(&logs, &weights)?;
            (logs, factor, alpha)
        };
        let finite = alpha.as_flattened().iter().all(|a| a.is_finite());
        finite.then_some(Self {
            logs,
            scales,
            level,
            reference,
            inputs,
            alpha,
            factor,
        })
    }

    /// Hyperparameters.
    pub(super) const fn logs(&self) -> &Logs {
        &self.logs
    }

    pub(super) fn predict(&self, observation: &Observation) -> Option<Prediction> {
        let input = standardised(observation, &self.scales, self.reference);
        let kernel = Kernel::new(&self.logs);
        let near = kernel.covariances(&input, &self.inputs);
        // The weights are zero beyond the last press.
        let products = near.as_flattened().iter().zip(self.alpha.as_flattened());
        let mean: f64 = products.map(|(near, alpha)| near * alpha).sum();
        let explained = self.factor.explained(near);
        let prediction = Prediction {
            mean: self.level + mean,
            model: (kernel.variance(&input) - explained).max(0.0),
            noise: kernel.noise(&input),
        };
        prediction.mean.is_finite().then_some(prediction)
    }
}

fn standardised(o: &Observation, scales: &[(f64, f64); FEATURES], reference: f64) -> Input {
    Input {
        features: std::array::from_fn(|j| (o.features[j] - scales[j].0) / scales[j].1),
        place: o.place,
        response: reference / o.events,
    }
}

/// Hyperparameters and weights. `all`: of the same inputs and targets.
fn learn(
    all: &Likelihood<'_>,
    inputs: &[Input],
    targets: &[f64],
    near: Option<&Logs>,
) -> Option<(Logs, Vec<f64>)> {
    let mut weights = vec![1.0; inputs.len()];
    let mut logs = near.copied().unwrap_or_else(centre);
    let steps = if near.is_some() { NEAR_STEPS } else { STEPS };
    let rows: Vec<usize> = (0..inputs.len()).collect();
    let rows = thinned(&rows, LEARNING);
    let part: Vec<Input> = rows.iter().map(|i| inputs[*i]).collect();
    let values: Vec<f64> = rows.iter().map(|i| targets[*i]).collect();
    let likelihood = Likelihood::new(&part, &values);
    for _ in 0..ROUNDS {
        let shares: Vec<f64> = rows.iter().map(|i| weights[*i]).collect();
        logs = minimise(logs, steps, TOLERANCE, |at| {
            likelihood.evaluate(at, &shares)
        })?
        .0;
        weights = all.new_weights(&logs, &weights)?;
    }
    Some((logs, weights))
}
