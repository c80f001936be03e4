//! The most likely remount: least squares over the columns of a few presses, with the scales of a remount as prior and little
//! weight on outliers.

use nalgebra::DMatrix;
use skinrig_model::StereoGeometry;

use super::motion::{NUMBERS, Numbers, RigidMotion, Spread, geometry_after};
use crate::locator::field::Field;
use crate::locator::reading::Reading;
use crate::locator::robust::{log_density, response, weight};
use crate::result::{LocatorModel, Scatter, Termination};
use crate::sets::CalibrationPress;

/// Steps of a descent, and halvings of a step.
const STEPS: usize = 60;
const HALVINGS: usize = 20;
/// A shorter step ends a descent, in standard deviations of the prior.
const SHORTEST: f64 = 1e-8;
/// Step of derivatives, in the same unit.
const STEP: f64 = 1e-4;
/// Presses that are left out in turn, the least fitting first.
const LEFT_OUT: usize = 12;
/// Readings of a press: one column per camera.
const READINGS: f64 = 2.0;

/// Readings of a press expected by the earlier calibration.
pub(super) struct Expectation<'a> {
    pub geometry: &'a StereoGeometry,
    pub centre: [f64; 2],
    pub model: &'a LocatorModel,
    pub fields: Option<[Field; 2]>,
    /// Scatter of the crossings, without fields.
    pub scatter: Scatter,
    /// Root of the prior's covariance.
    pub root: Spread,
    pub presses: &'a [CalibrationPress],
    /// Factor on all variances that the earlier held-out presses require.
    pub size: f64,
    /// Covariance of the earlier parameters, used where a field has no data.
    pub open: Option<DMatrix<f64>>,
}

/// Column minus the expected one in each camera, px.
type Misses = Vec<[f64; 2]>;

/// A remount that explains the presses.
pub(super) struct Fit {
    /// In standard deviations of the prior.
    at: Numbers,
    /// Weight of each press.
    pub weights: Vec<f64>,
    /// Negative logarithm of the posterior density, up to a constant.
    objective: f64,
    information: Spread,
    termination: Termination,
}

/// How presses count.
#[derive(Clone, Copy)]
enum Weighting {
    /// All but one count in full.
    Without(Option<usize>),
    /// Outliers lose weight.
    Robust,
}

impl Weighting {
    /// (half the loss, weight) of press `i` with this squared distance.
    fn loss(self, i: usize, square: f64) -> (f64, f64) {
        match self {
            Self::Without(left_out) if left_out == Some(i) => (0.0, 0.0),
            Self::Without(_) => (0.5 * square, 1.0),
            Self::Robust => (-log_density(square, READINGS), weight(square, READINGS)),
        }
    }
}

/// The best remount, and how well the presses fit.
pub(super) struct Outcome {
    pub numbers: Numbers,
    /// Covariance of the numbers.
    pub covariance: Spread,
    /// Weight of each press.
    pub weights: Vec<f64>,
    /// Sum of squares of readings and of the remount in units of their variances, without the worst press: chi-squared with two
    /// degrees of freedom per remaining press if the calibration fits.
    pub square: f64,
    /// Descents, and how many of them ended at the best.
    pub starts: [u32; 2],
    pub termination: Termination,
}

impl Expectation<'_> {
    fn numbers(&self, at: &Numbers) -> Numbers {
        self.root * at
    }

    fn misses(&self, at: &Numbers) -> Misses {
        let numbers = self.numbers(at);
        let reading = self.reading(&numbers);
        let motion = RigidMotion::new(self.centre, &numbers);
        let miss = |k: usize, p: &CalibrationPress| {
            let field = self.fields.as_ref().map_or(0.0, |fields| {
                let before = motion.back([p.truth.x_mm, p.truth.y_mm]);
                fields[k].value(before).0
            });
            reading.residual(k, p) - field
        };
        let each = self.presses.iter();
        each.map(|p| [0, 1].map(|k| miss(k, p))).collect()
    }

    fn reading(&self, numbers: &Numbers) -> Reading {
        Reading::Bearing {
            geometry: geometry_after(self.geometry, self.centre, numbers),
            covariance: self.open.clone(),
            remount: None,
        }
    }

    /// Variances of the readings, px².
    fn variances(&self, at: &Numbers) -> Misses {
        let numbers = self.numbers(at);
        let reading = self.reading(&numbers);
        let motion = RigidMotion::new(self.centre, &numbers);
        let of_px = |k: usize, p: &CalibrationPress| {
            let relative = response(p.cluster_events, self.model.reference_events);
            let at = [p.truth.x_mm, p.truth.y_mm];
            let (_, slope) = reading.of_column(k, p.columns[k]);
            match (&self.fields, &self.model.cameras) {
                (Some(fields), Some(cameras)) => {
                    let field = &cameras[k].field;
                    let open = fields[k].open(motion.back(at));
                    let [geometry, _] = reading.parameter_variances(k, at, p.columns[k]);
                    let model = fields[k].variance(open) + open * geometry / (slope * slope);
                    field.fixed_px * field.fixed_px
                        + field.column_px * field.column_px * relative
                        + self.model.inflation * model
                }
                _ => {
                    let [x, y] = reading.expected(k, at).1;
                    let px = self.scatter.fixed_mm * libm::hypot(x, y) / slope;
                    // What no geometry explains.
                    let [geometry, _] = reading.parameter_variances(k, at, p.columns[k]);
                    let misfit = (self.model.inflation - 1.0) * geometry / (slope * slope);
                    let columns = self.scatter.column_px * self.scatter.column_px * relative;
                    px * px + columns + misfit
                }
            }
        };
        let variance = |k: usize, p: &CalibrationPress| self.size * of_px(k, p);
        let each = self.presses.iter();
        each.map(|p| [0, 1].map(|k| variance(k, p))).collect()
    }

    /// Squared distance of each press.
    fn squares(misses: &Misses, variances: &Misses) -> Vec<f64> {
        let pairs = misses.iter().zip(variances);
        pairs
            .map(|(m, v)| m[0] * m[0] / v[0] + m[1] * m[1] / v[1])
            .collect()
    }

    fn objective(at: &Numbers, squares: &[f64], weighting: Weighting) -> f64 {
        let losses = squares.iter().enumerate();
        let losses = losses.map(|(i, s)| weighting.loss(i, *s).0);
        0.5 * at.norm_squared() + losses.sum::<f64>()
    }

    /// Gauss-Newton steps from `at`, halved until they lead down. `None` if a number is not finite.
    fn descend(&self, mut at: Numbers, weighting: Weighting) -> Option<Fit> {
        let mut fit = None;
        let mut termination = Termination::TooManySteps;
        for _ in 0..STEPS {
            let (misses, variances) = (self.misses(&at), self.variances(&at));
            let squares = Self::squares(&misses, &variances);
            let weight = |(i, s): (usize, &f64)| weighting.loss(i, *s).1;
            let weights: Vec<f64> = squares.iter().enumerate().map(weight).collect();
            let slopes = self.slopes(&at);
            let (mut information, mut side) = (Spread::identity(), -at);
            for (i, weight) in weights.iter().enumerate() {
                for k in 0..2 {
                    let known = weight / variances[i][k];
                    let slope = Numbers::from_fn(|j, _| slopes[j][i][k]);
                    information += slope * slope.transpose() * known;
                    side -= slope * (known * misses[i][k]);
                }
            }
            let objective = Self::objective(&at, &squares, weighting);
            let mut step = information.cholesky()?.solve(&side);
            fit = Some(Fit {
                at,
                weights,
                objective,
                information,
                termination,
            });
            if !objective.is_finite() {
                return None;
            }
            let lower = (0..HALVINGS).find_map(|_| {
                let there = at + step;
                let found = Self::squares(&self.misses(&there), &variances);
                step *= 0.5;
                let lower = Self::objective(&there, &found, weighting) < objective;
                lower.then_some(there)
            });
            let Some(there) = lower else {
                termination = Termination::FloatingPoint;
                break;
            };
            let length = (there - at).norm();
            at = there;
            if length < SHORTEST {
                termination = Termination::NoChange;
                break;
            }
        }
        fit.map(|fit: Fit| Fit { termination, ..fit })
    }

    /// Change of all misses by each number.
    fn slopes(&self, at: &Numbers) -> [Misses; NUMBERS] {
        std::array::from_fn(|j| {
            let (mut ahead, mut behind) = (*at, *at);
            ahead[j] += STEP;
            behind[j] -= STEP;
            let (ahead, behind) = (self.misses(&ahead), self.misses(&behind));
            let pairs = ahead.iter().zip(&behind);
            pairs
                .map(|(a, b)| [0, 1].map(|k| (a[k] - b[k]) / (2.0 * STEP)))
                .collect()
        })
    }

    /// The most likely remount. Descents without each of the least fitting presses find where to begin: an outlier cannot hide
    /// itself.
    pub(super) fn fit(&self) -> Option<Outcome> {
        let whole = self.descend(Numbers::zeros(), Weighting::Without(None))?;
        let squares = Self::squares(&self.misses(&whole.at), &self.variances(&whole.at));
        let mut order: Vec<usize> = (0..squares.len()).collect();
        order.sort_by(|a, b| squares[*b].total_cmp(&squares[*a]));
        let without: Vec<Fit> = order
            .into_iter()
            .take(LEFT_OUT)
            .filter_map(|i| self.descend(whole.at, Weighting::Without(Some(i))))
            .collect();
        let least = without.iter().map(|f| f.objective);
        let square = 2.0 * least.fold(whole.objective, f64::min);
        let begins = without.iter().map(|f| f.at).chain([whole.at]);
        let ends: Vec<Fit> = begins
            .filter_map(|at| self.descend(at, Weighting::Robust))
            .collect();
        let best = ends
            .iter()
            .min_by(|a, b| a.objective.total_cmp(&b.objective))?;
        let same = |f: &&Fit| (f.at - best.at).norm() < 1e-3;
        let covariance = best.information.cholesky()?.inverse();
        Some(Outcome {
            numbers: self.numbers(&best.at),
            covariance: self.root * covariance * self.root.transpose(),
            weights: best.weights.clone(),
            termination: best.termination,
            square,
            starts: [ends.len() as u32, ends.iter().filter(same).count() as u32],
        })
    }
}
