//! A Gaussian process over positions: how far the columns of one camera are from those expected.
//!
//! Noise: a fixed variance, and one that is inversely proportional to the cluster events.
//! Hyperparameters maximise the marginal likelihood with weak priors, from several starts on a subset, then on up to
//! [`LEARNING`] observations. Observations beyond what the others predict get less weight (Student's t with 4 degrees of
//! freedom); none is dropped.

use skinrig_simd::InstructionSet;

use super::likelihood::{
    Kernel, Likelihood, Logs, centre, first_weights, scatter, smooth, squares,
};
use super::quasi_newton::minimise;
use super::samples::{Sample, thinned};
use crate::lanes::{Factor, Group, LANES, total};
use crate::result::{FieldModel, FieldPoint};

/// Observations that choose among the starts, and that determine the hyperparameters.
const STARTING: usize = 60;
const LEARNING: usize = 120;
/// Length scales of the starts, mm.
const STARTS_MM: [f64; 3] = [8.0, 20.0, 50.0];
/// Steps of a descent, and the gain in log likelihood that ends it.
const STEPS: usize = 40;
const TOLERANCE: f64 = 1e-3;
/// Rounds of weights, and updates of the weights within a round.
const ROUNDS: usize = 2;
const UPDATES: usize = 3;
/// Weights that change less than this are settled.
const SETTLED: f64 = 0.01;

/// Learns a field from the samples; `from`: hyperparameters of a fit to almost the same samples. `None` if no start gives a
/// positive definite kernel.
pub(super) fn learn(samples: &[Sample], from: Option<&Logs>) -> Option<(FieldModel, Logs)> {
    let mut weights = first_weights(samples);
    let centre = centre(samples);
    let rows: Vec<usize> = (0..samples.len()).collect();
    let positions = |samples: &[Sample]| samples.iter().map(|s| s.at).collect::<Vec<_>>();
    let descend = |most: usize, weights: &[f64], start: Logs| {
        let rows = thinned(&rows, most);
        let part: Vec<Sample> = rows.iter().map(|i| samples[*i]).collect();
        let weights: Vec<f64> = rows.iter().map(|i| weights[*i]).collect();
        let squares = squares(&positions(&part));
        let likelihood = Likelihood::new(&part, &weights, centre, &squares);
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
    let all = squares(&positions(samples));
    for _ in 0..ROUNDS {
        logs = descend(LEARNING, &weights, logs)?.0;
        let smooth = smooth(InstructionSet::best(), &Kernel::new(&logs), &all);
        for _ in 0..UPDATES {
            let likelihood = Likelihood::new(samples, &weights, centre, &all);
            let new = likelihood.new_weights(&logs, &smooth)?;
            let moved = weights.iter().zip(&new).map(|(old, new)| (old - new).abs());
            let settled = moved.fold(0.0, f64::max) < SETTLED;
            weights = new;
            if settled {
                break;
            }
        }
    }
    let kernel = Kernel::new(&logs);
    let likelihood = Likelihood::new(samples, &weights, centre, &all);
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
    observations: Vec<Observations>,
    factor: Factor,
    /// Position of each observation, and the share of the field's variance that they leave open there, 0..=1.
    open: Vec<([f64; 2], f64)>,
    /// Share of the field's variance that the observations explain where they are: the lowest tenth of them.
    explained: f64,
}

/// Observations side by side: positions, mm, and weights. The last group is filled up with weights of 0.
#[derive(Debug, Clone, Copy)]
struct Observations {
    x: Group,
    y: Group,
    alpha: Group,
}

impl Observations {
    fn new(points: &[FieldPoint], alpha: &Group) -> Self {
        let fill = |of: &dyn Fn(&FieldPoint) -> f64| {
            std::array::from_fn(|i| points.get(i).map_or(0.0, of))
        };
        Self {
            x: fill(&|p| p.at_mm[0]),
            y: fill(&|p| p.at_mm[1]),
            alpha: *alpha,
        }
    }

    /// Distances to a position along x and y, mm, and covariances with it.
    #[inline(always)]
    fn near(&self, at: [f64; 2], kernel: &Kernel) -> [Group; 3] {
        let (mut dx, mut dy, mut squares) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            dx[i] = at[0] - self.x[i];
            dy[i] = at[1] - self.y[i];
            squares[i] = dx[i] * dx[i] + dy[i] * dy[i];
        }
        [dx, dy, kernel.of(&squares)]
    }
}

impl Field {
    /// `None` if the observations do not make a positive definite kernel.
    pub(super) fn new(model: &FieldModel) -> Option<Self> {
        let points = &model.points;
        let n = points.len();
        let instructions = InstructionSet::best();
        let kernel = Kernel {
            variance: model.amplitude_px * model.amplitude_px,
            per_length: 1.0 / model.length_mm,
        };
        let positions: Vec<[f64; 2]> = points.iter().map(|p| p.at_mm).collect();
        let mut noisy = smooth(instructions, &kernel, &squares(&positions));
        noisy.add_to_diagonal(|i| kernel.variance + points[i].variance_px2);
        let factor = Factor::of(noisy)?;
        let alpha = factor.solve(points.iter().map(|p| p.residual_px));
        // What the observations with covariance S and noise N leave open where they are: the diagonal of S - S (S + N)⁻¹ S,
        // which is N - N (S + N)⁻¹ N.
        let diagonal = points.iter().zip(factor.inverse_diagonal());
        let open: Vec<([f64; 2], f64)> = diagonal
            .map(|(point, q)| {
                let noise = point.variance_px2;
                let open = (noise - noise * q * noise) / kernel.variance;
                (point.at_mm, open.clamp(0.0, 1.0))
            })
            .collect();
        let mut explained: Vec<f64> = open.iter().map(|(_, open)| 1.0 - open).collect();
        explained.sort_unstable_by(f64::total_cmp);
        let explained = *explained.get(n / 10)?;
        let groups = points.chunks(LANES).zip(&alpha);
        let observations = groups.map(|(points, alpha)| Observations::new(points, alpha));
        let usable = explained > 0.0 && alpha.as_flattened().iter().all(|a| a.is_finite());
        usable.then(|| Self {
            instructions,
            kernel,
            observations: observations.collect(),
            factor,
            open,
            explained,
        })
    }

    /// Expected residual at a position, px, and its change per mm.
    pub(super) fn value(&self, at: [f64; 2]) -> (f64, [f64; 2]) {
        let sums = self.instructions.run(
            #[inline(always)]
            || self.sums(at),
        );
        let [value, x, y] = sums.map(|lanes| total(&lanes));
        let square = self.kernel.per_length * self.kernel.per_length;
        (value, [-x * square, -y * square])
    }

    /// Sums over the observations, lane by lane: parts of the value, and these times the distances along x and y.
    #[inline(always)]
    fn sums(&self, at: [f64; 2]) -> [Group; 3] {
        let mut sums = [[0.0; LANES]; 3];
        for group in &self.observations {
            let [dx, dy, near] = group.near(at, &self.kernel);
            for i in 0..LANES {
                let part = group.alpha[i] * near[i];
                sums[0][i] += part;
                sums[1][i] += part * dx[i];
                sums[2][i] += part * dy[i];
            }
        }
        sums
    }

    /// Share of the field's variance that the observations leave open at the position of one of them, 0..=1; as
    /// [`Field::open`] where observation `i` is elsewhere.
    pub(super) fn open_at_observation(&self, i: usize, at: [f64; 2]) -> f64 {
        match self.open.get(i) {
            Some((position, open)) if *position == at => *open,
            _ => self.open(at),
        }
    }

    /// Share of the field's variance that the observations leave open at a position, 0..=1.
    pub(super) fn open(&self, at: [f64; 2]) -> f64 {
        let near = self.instructions.run(
            #[inline(always)]
            || {
                let covariances = self.observations.iter();
                covariances
                    .map(|group| group.near(at, &self.kernel)[2])
                    .collect()
            },
        );
        let explained = self.factor.explained(near) / self.kernel.variance;
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
                (value - libm::sin(0.08 * at[0])).abs() < 0.2,
                "{at:?}: {value}"
            );
            let right = field.value([at[0] + 1e-4, at[1]]).0;
            assert!(((right - value) / 1e-4 - by[0]).abs() < 1e-4);
        }
        for (i, point) in model.points.iter().enumerate() {
            let at = point.at_mm;
            assert!((field.open_at_observation(i, at) - field.open(at)).abs() < 1e-9);
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
