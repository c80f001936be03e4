//! Calibration of the camera geometry by damped least squares on the error vectors of the calibration presses.
//!
//! Residuals are (dx, dy) per press, not the distance, which has a kink at 0. They are bounded: an error vector of length e
//! counts as `e / sqrt(1 + (e / c)²)`, which is e for small errors and never more than c. So every press with two centroids
//! stays in the fit: one far outside the skin pulls no more than c, and one whose rays meet behind a camera or not at all
//! counts c. c is 25 mm (a quarter of the skin) while the starts compete, then ten robust standard deviations of the best
//! solution's errors, so that the last fit is ordinary least squares for all but outliers. Each start first descends on a
//! smooth surrogate of the error (`problem`).
//!
//! [`calibrate`] fits one model; `choose` fits the nested ones, and `paired` selects the smallest whose held-out errors
//! (`crossval`) no larger one lowers; `threshold` finds how many cluster events a press needs to be useful.

mod choose;
mod crossval;
mod paired;
mod parameters;
mod problem;
mod refit;
mod solver;
mod standard;
mod threshold;
mod uncertainty;

use rayon::prelude::*;
use skinrig_model::{CalibrationModel, StereoGeometry};

use crate::distinct::distinct;
use crate::result::CalibrationResult;
use crate::sets::{CalibrationPress, CalibrationSet};
pub use choose::{ModelChoice, choose};
pub(crate) use choose::{SessionCalibration, calibrate_session, reject_presses};
pub(crate) use crossval::Folds;
pub(crate) use paired::{Losses, select_model};
pub(crate) use parameters::PARAMETERS;
pub use parameters::parameter_count;
use parameters::{MODELS, NAMES, Parameters, is_plausible};
pub(crate) use parameters::{SPREAD, parameters_of, with_parameters};
pub(crate) use problem::StereoModel;
use problem::{Measure, Problem};
pub(crate) use refit::{Refit, covariance};
use skinrig_statistics::seeded;
use solver::{Descent, minimise, polish};
pub(crate) use standard::standard_fit;

/// Bound on an error vector while the starts compete, mm: a quarter of the skin's side.
const COARSE_BOUND_MM: f64 = 25.0;
/// Convergence thresholds, see [`Problem::tolerance`]. Along the arcs, which only lead into the valley (with 1e-4 many
/// starts found another one); along the errors while starts compete, whose results then differ by about a millionth of their
/// standard errors; in the last fit, about the rounding error of the sum.
const TOLERANCE_ARCS: f64 = 1e-9;
const TOLERANCE_COARSE: f64 = 1e-12;
const TOLERANCE_FINE: f64 = 1e-15;
/// Bound of the last fit in robust standard deviations of one coordinate.
const FINE_BOUND_SIGMAS: f64 = 10.0;
/// Smallest bound of the last fit, mm.
const MIN_BOUND_MM: f64 = 1.0;
/// Median of the length of a standard normal 2-vector, `sqrt(2 ln 2)`.
const RAYLEIGH_MEDIAN: f64 = 1.177_410_022_515_474_7;
/// Starts: the nominal geometry, the same grown model by model, and perturbed ones.
const STARTS: u32 = 10;
/// Starts with RMSEs within this found the same optimum, mm.
const SAME_OPTIMUM_MM: f64 = 1e-6;
/// Error assigned to a press whose rays do not meet in front of both cameras, and the maximum for any press, mm: the skin's
/// diagonal (100 x 100 mm).
pub(crate) const NO_FIX_ERROR_MM: f64 = 141.421_356_237_309_5;
/// Positions closer than this are one location, mm.
const SAME_PLACE_MM: f64 = 0.1;

/// The largest model, up to `requested`, that the data support: at least as many distinct locations as parameters, which is two
/// residuals per parameter.
#[must_use]
pub fn largest_supported_model(
    set: &CalibrationSet,
    requested: CalibrationModel,
) -> CalibrationModel {
    largest_supported(different_places(set.sights()), requested)
}

fn largest_supported(places: usize, requested: CalibrationModel) -> CalibrationModel {
    let most = parameter_count(requested).min(places);
    let mut largest_first = MODELS.into_iter().rev();
    largest_first
        .find(|m| parameter_count(*m) <= most)
        .unwrap_or(CalibrationModel::None)
}

/// Number of distinct locations of the plan, or of distinct measured positions if there are fewer.
fn different_places(sights: &[CalibrationPress]) -> usize {
    let cell = |mm: f64| (mm / SAME_PLACE_MM).round() as i64;
    let places = distinct(
        sights
            .iter()
            .map(|s| (cell(s.truth.x_mm), cell(s.truth.y_mm))),
    );
    let locations = distinct(sights.iter().map(|s| s.location));
    places.len().min(locations.len())
}

/// Fits `model` (for `Auto`, all parameters) to the set, from `start` and from seeded perturbations of it.
///
/// `None` if the model has no parameters, there are fewer residuals than parameters, or no start led to a plausible geometry
/// (positions within 60 mm of the start, |skew| < 45 degrees, lenses monotone). If the data do not determine all parameters,
/// `rank` shows it and the solution is one of many: the one reached from the unperturbed start.
#[must_use]
pub fn calibrate(
    set: &CalibrationSet,
    start: &StereoGeometry,
    model: CalibrationModel,
    seed: u64,
) -> Option<(StereoGeometry, CalibrationResult)> {
    let fit = Fit::search(set.sights(), start, model, seed)?;
    Some((fit.geometry, fit.result))
}

/// A fitted model.
struct Fit {
    geometry: StereoGeometry,
    parameters: Parameters,
    result: CalibrationResult,
}

impl Fit {
    fn search(
        sights: &[CalibrationPress],
        start: &StereoGeometry,
        model: CalibrationModel,
        seed: u64,
    ) -> Option<Self> {
        let count = parameter_count(model);
        if count == 0 || 2 * sights.len() < count {
            return None;
        }
        let problem = Problem::coarse(sights, start, count);
        let base = parameters_of(start);
        let ends: Vec<Descent> = (0..STARTS)
            .into_par_iter()
            .map(|attempt| match attempt {
                1 => problem.descend_nested(base),
                _ => problem.descend(perturbed(base, count, attempt, seed)),
            })
            .collect();
        let coarse = best(&ends, start)?;
        let rmse = |d: &Descent| (d.cost / sights.len() as f64).sqrt();
        let agreeing = ends
            .iter()
            .filter(|d| (rmse(d) - rmse(coarse)).abs() <= SAME_OPTIMUM_MM);
        let starts_agreeing = agreeing.count() as u32;
        let mut fit = Self::finish(&problem, coarse, model);
        if (fit.result.rank as usize) < count && is_plausible(start, &ends[0].parameters) {
            // Many solutions are equally good: take the one nearest to the start, independent of the seed.
            fit = Self::finish(&problem, &ends[0], model);
        }
        fit.result.starts_agreeing = starts_agreeing;
        Some(fit)
    }

    /// The last fit from a coarse solution, with its diagnostics.
    fn finish(problem: &Problem<'_>, coarse: &Descent, model: CalibrationModel) -> Self {
        let Problem {
            sights,
            base: start,
            count,
            ..
        } = *problem;
        let (problem, fine) = problem.last_fit(coarse);
        let end = if is_plausible(start, &fine.parameters) {
            &fine
        } else {
            coarse
        };
        let geometry = with_parameters(start, &end.parameters);
        let (residuals, jacobian) = problem.rows(&end.parameters);
        let locations: Vec<u32> = sights.iter().map(|s| s.location).collect();
        let uncertainty_report = uncertainty::uncertainty(&residuals, &jacobian, &locations);
        let lengths = error_lengths(sights, &geometry);
        let result = CalibrationResult {
            model,
            lens: start.cameras[0].lens.kind(),
            start: *start,
            names: NAMES[..count].iter().map(|n| (*n).to_owned()).collect(),
            start_values: parameters_of(start).as_slice()[..count].to_vec(),
            values: end.parameters.as_slice()[..count].to_vec(),
            standard_errors: uncertainty_report.standard_errors,
            correlation: uncertainty_report.correlation,
            condition: uncertainty_report.condition,
            rank: uncertainty_report.rank as u32,
            rmse_before_mm: rmse_mm(sights, start),
            rmse_after_mm: root_mean_square(&lengths),
            n: sights.len() as u32,
            // The weight `1 / (1 + (e / c)²)` is one half at e = c.
            outliers: lengths.iter().filter(|e| **e > problem.bound_mm).count() as u32,
            starts: STARTS,
            starts_agreeing: 0,
            termination: end.termination,
            compared: Vec::new(),
            bound_mm: None,
        };
        Self {
            geometry,
            parameters: end.parameters,
            result,
        }
    }
}

/// First of the best plausible results.
fn best<'a>(ends: &'a [Descent], start: &StereoGeometry) -> Option<&'a Descent> {
    ends.iter()
        .filter(|d| d.cost.is_finite() && is_plausible(start, &d.parameters))
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
}

fn perturbed(base: Parameters, count: usize, attempt: u32, seed: u64) -> Parameters {
    let mut from = base;
    if attempt > 0 {
        let mut rng = seeded::generator(seed, u64::from(attempt));
        for p in 0..count.min(PARAMETERS) {
            from[p] += SPREAD[p] * seeded::signed_unit(&mut rng);
        }
    }
    from
}

impl<'a> Problem<'a> {
    /// The problem while the starts compete.
    fn coarse(sights: &'a [CalibrationPress], base: &'a StereoGeometry, count: usize) -> Self {
        Problem {
            sights,
            base,
            count,
            measure: Measure::Error,
            bound_mm: COARSE_BOUND_MM,
            tolerance: TOLERANCE_COARSE,
        }
    }

    /// Descends from any start: first along the arcs, then along the errors.
    fn descend(&self, from: Parameters) -> Descent {
        let smooth = Problem {
            measure: Measure::Arc,
            tolerance: TOLERANCE_ARCS,
            ..*self
        };
        minimise(self, minimise(&smooth, from).parameters)
    }

    /// Descends with the smallest model, then from there with the next, up to this one: no model ends above a smaller one.
    fn descend_nested(&self, from: Parameters) -> Descent {
        let of = |count: usize| Problem { count, ..*self };
        let counts = MODELS.map(parameter_count).into_iter();
        let mut end = of(parameter_count(MODELS[0])).descend(from);
        for count in counts.skip(1).take_while(|c| *c <= self.count) {
            end = minimise(&of(count), end.parameters);
        }
        end
    }

    /// The last fit from a coarse solution, and its problem. The bound follows from the coarse solution, whose missing digits
    /// would be missing in the last fit too.
    fn last_fit(&self, coarse: &Descent) -> (Problem<'a>, Descent) {
        let problem = self.with_fine_bound(&self.polished(coarse));
        let fine = minimise(&problem, coarse.parameters);
        let parameters = problem.polished(&fine);
        (problem, Descent { parameters, ..fine })
    }

    fn polished(&self, descent: &Descent) -> Parameters {
        if descent.termination.is_converged() {
            polish(self, descent.parameters)
        } else {
            descent.parameters
        }
    }

    /// The problem with the bound of the last fit, from the errors at `parameters`.
    fn with_fine_bound(&self, parameters: &Parameters) -> Problem<'a> {
        let mut lengths = error_lengths(self.sights, &with_parameters(self.base, parameters));
        lengths.sort_unstable_by(f64::total_cmp);
        let sigma = lengths[lengths.len() / 2] / RAYLEIGH_MEDIAN;
        Problem {
            bound_mm: (FINE_BOUND_SIGMAS * sigma).max(MIN_BOUND_MM),
            tolerance: TOLERANCE_FINE,
            ..*self
        }
    }
}

/// Root mean square error over all presses, mm; a press without a fix counts the skin's diagonal, which is also the maximum.
#[must_use]
pub fn rmse_mm(sights: &[CalibrationPress], geometry: &StereoGeometry) -> f64 {
    root_mean_square(&error_lengths(sights, geometry))
}

pub(crate) fn root_mean_square(lengths: &[f64]) -> f64 {
    let squares: f64 = lengths.iter().map(|e| e * e).sum();
    (squares / lengths.len() as f64).sqrt()
}

fn error_lengths(sights: &[CalibrationPress], geometry: &StereoGeometry) -> Vec<f64> {
    let stereo = StereoModel::of(geometry);
    let length = |s: &CalibrationPress| {
        stereo.error_vector(s).map_or(NO_FIX_ERROR_MM, |[dx, dy]| {
            libm::hypot(dx, dy).min(NO_FIX_ERROR_MM)
        })
    };
    sights.iter().map(length).collect()
}
