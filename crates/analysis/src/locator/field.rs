//! A Gaussian process over positions: how far the columns of one camera are from those expected.
//!
//! Noise: a fixed variance, and one that is inversely proportional to the cluster events.
//! Hyperparameters maximise the marginal likelihood with weak priors, from several starts on a subset, then on up to
//! [`LEARNING`] observations. Observations beyond what the others predict get less weight (Student's t with 4 degrees of
//! freedom); none is dropped.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use skinrig_simd::InstructionSet;

use super::exponential::{LANES, of_negatives};
use super::likelihood::{Kernel, Likelihood, Logs, centre, first_weights, scatter};
use super::quasi_newton::minimise;
use super::samples::{Sample, thinned};
use crate::result::{FieldModel, FieldPoint};

/// Observations that choose among the starts, and that determine the hyperparameters.
const STARTING: usize = 60;
const LEARNING: usize = 120;
/// Length scales of the starts, mm.
const STARTS_MM: [f64; 3] = [8.0, 20.0, 50.0];
/// Steps of a descent, and the gain in log likelihood that ends it.
const STEPS: usize = 40;
const TOLERANCE: f64 = 1e-5;
/// Rounds of weights, and updates of the weights within a round.
const ROUNDS: usize = 2;
const UPDATES: usize = 3;

/// Learns a field from the samples; `from`: hyperparameters of a fit to almost the same samples. `None` if no start gives a
/// positive definite kernel.
pub(super) fn learn(samples: &[Sample], from: Option<&Logs>) -> Option<(FieldModel, Logs)> {
    let mut weights = first_weights(samples);
    let centre = centre(samples);
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
            let starts = STARTS_MM.map(|length| {
                let mut start = centre;
                start[1] = libm::log(length);
                descend(STARTING, &weights, start)
            });
            let best = starts.into_iter().flatten();
            best.min_by(|a, b| a.1.total_cmp(&b.1))?.0
        }
    };
    for _ in 0..ROUNDS {
        logs = descend(LEARNING, &weights, logs)?.0;
        for _ in 0..UPDATES {
            let likelihood = Likelihood {
                samples,
                weights: &weights,
                centre,
            };
            weights = likelihood.new_weights(&logs)?;
        }
    }
    let kernel = Kernel::new(&logs);
    let likelihood = Likelihood {
        samples,
        weights: &weights,
        centre,
    };
    let [fixed, column] = scatter(&logs).map(f64::sqrt);
    let points = samples.iter().enumerate().map(|(i, s)| FieldPoint {
        at_mm: s.at,
        residual_px: s.residual,
        variance_px2: likelihood.variance(i, &logs),
    });
    let model = FieldModel {
        amplitude_px: kernel.variance.sqrt(),
        length_mm: 1.0 / kernel.per_length,
        fixed_px: fixed,
        column_px: column,
        points: points.collect(),
    };
    Some((model, logs))
}

/// A field that predicts.
#[derive(Debug, Clone)]
pub(super) struct Field {
    instructions: InstructionSet,
    kernel: Kernel,
    /// Number of observations.
    n: usize,
    observations: Vec<Group>,
    factor: Cholesky<f64, Dyn>,
    /// Share of the field's variance that the observations explain where they are: the lowest tenth of them.
    explained: f64,
}

/// Observations side by side: positions, mm, and weights. The last group is filled up with weights of 0.
#[derive(Debug, Clone, Copy)]
struct Group {
    x: [f64; LANES],
    y: [f64; LANES],
    alpha: [f64; LANES],
}

impl Group {
    fn new(points: &[FieldPoint], alpha: &[f64]) -> Self {
        let fill = |of: &dyn Fn(usize) -> f64| {
            std::array::from_fn(|i| if i < points.len() { of(i) } else { 0.0 })
        };
        Self {
            x: fill(&|i| points[i].at_mm[0]),
            y: fill(&|i| points[i].at_mm[1]),
            alpha: fill(&|i| alpha[i]),
        }
    }

    /// Distances to a position along x and y, mm, and exp(-d² / (2 l²)) for the distance d and the length scale l.
    #[inline(always)]
    fn near(&self, at: [f64; 2], per_length: f64) -> [[f64; LANES]; 3] {
        let half = -0.5 * per_length * per_length;
        let (mut dx, mut dy, mut exponents) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            dx[i] = at[0] - self.x[i];
            dy[i] = at[1] - self.y[i];
            exponents[i] = half * (dx[i] * dx[i] + dy[i] * dy[i]);
        }
        [dx, dy, of_negatives(&exponents)]
    }
}

impl Field {
    /// `None` if the observations do not make a positive definite kernel.
    pub(super) fn new(model: &FieldModel) -> Option<Self> {
        let points = &model.points;
        let n = points.len();
        let kernel = Kernel {
            variance: model.amplitude_px * model.amplitude_px,
            per_length: 1.0 / model.length_mm,
        };
        let noisy = DMatrix::from_fn(n, n, |i, j| {
            let noise = if i == j { points[i].variance_px2 } else { 0.0 };
            kernel.of(points[i].at_mm, points[j].at_mm) + noise
        });
        let factor = Cholesky::new(noisy)?;
        let residuals = DVector::from_iterator(n, points.iter().map(|p| p.residual_px));
        let alpha = factor.solve(&residuals);
        let groups = points
            .chunks(LANES)
            .zip(alpha.as_slice().chunks(LANES))
            .map(|(points, alpha)| Group::new(points, alpha));
        let mut field = Self {
            instructions: InstructionSet::best(),
            kernel,
            n,
            observations: groups.collect(),
            factor,
            explained: 0.0,
        };
        let mut explained: Vec<f64> = points.iter().map(|p| 1.0 - field.open(p.at_mm)).collect();
        explained.sort_unstable_by(f64::total_cmp);
        field.explained = *explained.get(n / 10)?;
        let usable = field.explained > 0.0 && alpha.iter().all(|a| a.is_finite());
        usable.then_some(field)
    }

    /// Expected residual at a position, px, and its change per mm.
    pub(super) fn value(&self, at: [f64; 2]) -> (f64, [f64; 2]) {
        let sums = self.instructions.run(
            #[inline(always)]
            || self.sums(at),
        );
        let [value, x, y] = sums.map(|lanes| lanes.iter().sum::<f64>() * self.kernel.variance);
        let square = self.kernel.per_length * self.kernel.per_length;
        (value, [-x * square, -y * square])
    }

    /// Sums over the observations, lane by lane: shares of the value, and these times the distances along x and y.
    #[inline(always)]
    fn sums(&self, at: [f64; 2]) -> [[f64; LANES]; 3] {
        let mut sums = [[0.0; LANES]; 3];
        for group in &self.observations {
            let [dx, dy, near] = group.near(at, self.kernel.per_length);
            for i in 0..LANES {
                let part = group.alpha[i] * near[i];
                sums[0][i] += part;
                sums[1][i] += part * dx[i];
                sums[2][i] += part * dy[i];
            }
        }
        sums
    }

    /// Share of the field's variance that the observations leave open at a position, 0..=1.
    pub(super) fn open(&self, at: [f64; 2]) -> f64 {
        let mut near = DVector::zeros(self.observations.len() * LANES);
        self.instructions.run(
            #[inline(always)]
            || {
                let places = near.as_mut_slice().as_chunks_mut::<LANES>().0;
                for (place, group) in places.iter_mut().zip(&self.observations) {
                    let shares = group.near(at, self.kernel.per_length)[2];
                    *place = shares.map(|share| share * self.kernel.variance);
                }
            },
        );
        let near = near.resize_vertically(self.n, 0.0);
        let explained = match self.factor.l_dirty().solve_lower_triangular(&near) {
            Some(solved) => solved.norm_squared() / self.kernel.variance,
            None => 0.0,
        };
        (1.0 - explained).clamp(0.0, 1.0)
    }

    /// Variance of the field with this open share, px².
    pub(super) fn variance(&self, open: f64) -> f64 {
        open * self.kernel.variance
    }

    /// True where the observations explain less than half of what they explain at their own positions.
    pub(super) fn is_beyond(&self, open: f64) -> bool {
        1.0 - open < 0.5 * self.explained
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::locator::samples::planted;

    #[test]
    fn a_field_follows_what_is_smooth_and_not_an_outlier() {
        let samples = planted(36);
        let (model, _) = learn(&samples, None).unwrap();
        let field = Field::new(&model).unwrap();
        for at in [[-10.0, 0.0], [3.0, 8.0], [10.0, -6.0]] {
            let (value, by) = field.value(at);
            assert!(
                (value - (0.08 * at[0]).sin()).abs() < 0.2,
                "{at:?}: {value}"
            );
            let right = field.value([at[0] + 1e-4, at[1]]).0;
            assert!(((right - value) / 1e-4 - by[0]).abs() < 1e-4);
        }
        let (near, far) = (field.open([0.0, 0.0]), field.open([300.0, 0.0]));
        assert!(near < 0.2 && far > 0.999, "{near} {far}");
        assert!(!field.is_beyond(near) && field.is_beyond(far));
        for instructions in InstructionSet::available() {
            let other = Field {
                instructions,
                ..field.clone()
            };
            for at in [[-10.0, 0.0], [3.0, 8.0], [0.3, 0.1], [300.0, 0.0]] {
                assert_eq!(other.value(at), field.value(at), "{instructions:?}");
                assert_eq!(other.open(at), field.open(at), "{instructions:?}");
            }
        }
        assert!(field.value([300.0, 0.0]).0.abs() < 1e-9);
        let outlier = &model.points[7];
        assert!(outlier.variance_px2 > 10.0 * model.points[8].variance_px2);
    }
}
