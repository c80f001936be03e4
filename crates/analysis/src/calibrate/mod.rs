//! Calibration of the camera geometry by damped least squares on the error vectors of the calibrating presses.
//!
//! Residuals are (dx, dy) per press, not the distance, which has a kink at 0. They are bounded: an error vector
//! of length e counts as `e / sqrt(1 + (e / c)²)`, which is e for small errors and never more than c. So every
//! press with two centroids takes part to the end: one far outside the skin pulls no more than c, one whose rays
//! meet behind a camera or not at all counts c. c is 25 mm (a quarter of the skin) while the starts compete, then
//! ten robust standard deviations of the best solution's errors, so that the last fit is ordinary least squares
//! for all but outliers.

mod covariance;
mod problem;

use levenberg_marquardt::{LevenbergMarquardt, TerminationReason};
use nalgebra::{DMatrix, DVector};
use skinrig_model::{CalibrationModel, LensKind, StereoGeometry};

use crate::result::CalibrationResult;
use crate::seeded;
use crate::sets::{CalibrationSet, Sight};
use problem::{PARAMETERS, Problem, parameters_of};

/// Bound on an error vector while the starts compete, mm: a quarter of the skin's side.
const COARSE_BOUND_MM: f64 = 25.0;
/// Bound of the last fit in robust standard deviations of one coordinate.
const FINE_BOUND_SIGMAS: f64 = 10.0;
/// Smallest bound of the last fit, mm.
const LEAST_BOUND_MM: f64 = 1.0;
/// Median of the length of a standard normal 2-vector, `sqrt(2 ln 2)`.
const RAYLEIGH_MEDIAN: f64 = 1.177_410_022_515_474_7;
/// Starts: the nominal geometry and perturbed ones.
const STARTS: u64 = 10;
/// Largest perturbation of a start: mm for positions, degrees for skews, 1 for W. About the half widths of the
/// public code's search box (positions 5 to 10 mm, skews 5 degrees, W 1).
const SPREAD: [f64; PARAMETERS] = [8.0, 8.0, 8.0, 8.0, 4.0, 4.0, 0.4, 0.4];
/// A solution further than this from the start is not a calibration of this rig, mm.
const FARTHEST_MM: f64 = 60.0;
/// Error length charged to a press whose rays do not meet in front of both cameras, mm: the skin's diagonal
/// (100 x 100 mm).
const NO_FIX_ERROR_MM: f64 = 141.421_356_237_309_5;

/// Names of the parameters, in order; models use the first 4, 6 or 8.
const NAMES: [&str; PARAMETERS] = [
    "camera 1 x (mm)",
    "camera 1 y (mm)",
    "camera 2 x (mm)",
    "camera 2 y (mm)",
    "camera 1 skew (deg)",
    "camera 2 skew (deg)",
    "camera 1 distortion W (1)",
    "camera 2 distortion W (1)",
];

/// How many parameters a model fits.
#[must_use]
pub const fn parameter_count(model: CalibrationModel) -> usize {
    match model {
        CalibrationModel::None => 0,
        CalibrationModel::Positions => 4,
        CalibrationModel::PositionsSkews => 6,
        CalibrationModel::Full | CalibrationModel::FullScale | CalibrationModel::Auto => PARAMETERS,
    }
}

/// What a model is called in settings and messages.
#[must_use]
pub const fn model_name(model: CalibrationModel) -> &'static str {
    match model {
        CalibrationModel::None => "none",
        CalibrationModel::Positions => "positions",
        CalibrationModel::PositionsSkews => "positions_skews",
        CalibrationModel::Full => "full",
        CalibrationModel::FullScale => "full_scale",
        CalibrationModel::Auto => "auto",
    }
}

/// The largest model of `wanted` and the smaller ones that the data can bear: at least as many different
/// locations as parameters, that is two residuals per parameter.
#[must_use]
pub fn affordable_model(set: &CalibrationSet, wanted: CalibrationModel) -> CalibrationModel {
    let mut places: Vec<(i64, i64)> = set
        .sights()
        .iter()
        .map(|s| {
            // Places closer than 0.1 mm are one place.
            let tenth = |mm: f64| (mm * 10.0).round() as i64;
            (tenth(s.truth.x_mm), tenth(s.truth.y_mm))
        })
        .collect();
    places.sort_unstable();
    places.dedup();
    let smaller = [
        CalibrationModel::Full,
        CalibrationModel::PositionsSkews,
        CalibrationModel::Positions,
    ];
    smaller
        .into_iter()
        .find(|&m| {
            parameter_count(m) <= parameter_count(wanted) && parameter_count(m) <= places.len()
        })
        .unwrap_or(CalibrationModel::None)
}

/// Fits `model` to the set, starting from `start` and from seeded perturbations of it.
///
/// `None` when the model has no parameters, or no start led to a plausible geometry (positions within 60 mm of
/// the start, |W| < 1 so that the lens stays monotone, |skew| < 45 degrees).
#[must_use]
pub fn calibrate(
    set: &CalibrationSet,
    start: &StereoGeometry,
    model: CalibrationModel,
    seed: u64,
) -> Option<(StereoGeometry, CalibrationResult)> {
    let count = parameter_count(model);
    let sights = set.sights();
    if count == 0 || 2 * sights.len() < count {
        return None;
    }
    let base = parameters_of(start);
    let mut best: Option<Solution> = None;
    for attempt in 0..STARTS {
        let mut from = base;
        if attempt > 0 {
            let mut rng = seeded::generator(seed, attempt);
            for (p, spread) in from.iter_mut().zip(SPREAD).take(count) {
                *p += spread * seeded::signed_unit(&mut rng);
            }
        }
        let solution = minimise(sights, start, &from[..count], COARSE_BOUND_MM);
        if solution.is_plausible(&base) && best.as_ref().is_none_or(|b| solution.cost < b.cost) {
            best = Some(solution);
        }
    }
    let coarse = best?;
    let bound = fine_bound(sights, &coarse.geometry);
    let fine = minimise(sights, start, &coarse.parameters, bound);
    let solution = if fine.is_plausible(&base) {
        fine
    } else {
        coarse
    };
    let standard_errors = covariance::standard_errors(&solution.residuals, &solution.jacobian);
    let result = CalibrationResult {
        model,
        lens: LensKind::Exponential,
        correlation: Vec::new(),
        condition: None,
        rank: count as u32,
        outliers: 0,
        starts: STARTS as u32,
        starts_agreeing: 0,
        compared: Vec::new(),
        start: *start,
        names: NAMES[..count].iter().map(|n| (*n).to_owned()).collect(),
        start_values: base[..count].to_vec(),
        values: solution.parameters.clone(),
        standard_errors,
        rmse_before_mm: rmse_mm(sights, start),
        rmse_after_mm: rmse_mm(sights, &solution.geometry),
        n: sights.len() as u32,
        termination: solution.termination,
    };
    Some((solution.geometry, result))
}

/// Root mean square error over all presses, mm; a press without a fix counts the skin's diagonal.
#[must_use]
pub fn rmse_mm(sights: &[Sight], geometry: &StereoGeometry) -> f64 {
    let squares: f64 = error_lengths(sights, geometry).map(|e| e * e).sum();
    (squares / sights.len() as f64).sqrt()
}

fn error_lengths(sights: &[Sight], geometry: &StereoGeometry) -> impl Iterator<Item = f64> {
    sights.iter().map(|s| {
        problem::error_vector(geometry, s).map_or(NO_FIX_ERROR_MM, |[dx, dy]| {
            libm::hypot(dx, dy).min(NO_FIX_ERROR_MM)
        })
    })
}

fn fine_bound(sights: &[Sight], geometry: &StereoGeometry) -> f64 {
    let mut lengths: Vec<f64> = error_lengths(sights, geometry).collect();
    lengths.sort_unstable_by(f64::total_cmp);
    let sigma = lengths[lengths.len() / 2] / RAYLEIGH_MEDIAN;
    (FINE_BOUND_SIGMAS * sigma).max(LEAST_BOUND_MM)
}

struct Solution {
    geometry: StereoGeometry,
    parameters: Vec<f64>,
    cost: f64,
    termination: String,
    residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
}

impl Solution {
    fn is_plausible(&self, base: &[f64; PARAMETERS]) -> bool {
        let p = parameters_of(&self.geometry);
        let far = |i: usize| (p[i] - base[i]).abs() > FARTHEST_MM;
        self.cost.is_finite()
            && p.iter().all(|v| v.is_finite())
            && !(0..4).any(far)
            && p[4].abs().max(p[5].abs()) < 45.0
            && p[6].abs().max(p[7].abs()) < 1.0
    }
}

fn minimise(sights: &[Sight], start: &StereoGeometry, from: &[f64], bound_mm: f64) -> Solution {
    let problem = Problem::new(sights, start, DVector::from_column_slice(from), bound_mm);
    let (problem, report) = LevenbergMarquardt::new().minimize(problem);
    let (residuals, jacobian) = problem.linearised();
    Solution {
        geometry: problem.geometry(),
        parameters: problem.parameters().iter().copied().collect(),
        cost: residuals.norm_squared(),
        termination: in_words(&report.termination),
        residuals,
        jacobian,
    }
}

fn in_words(reason: &TerminationReason) -> String {
    match reason {
        TerminationReason::ResidualsZero => "all residuals are zero".to_owned(),
        TerminationReason::Orthogonal => "the gradient is zero".to_owned(),
        TerminationReason::Converged { ftol, xtol } => match (ftol, xtol) {
            (true, true) => "converged: neither error nor parameters change any more".to_owned(),
            (true, false) => "converged: the error does not change any more".to_owned(),
            _ => "converged: the parameters do not change any more".to_owned(),
        },
        TerminationReason::NoImprovementPossible(_) => {
            "converged to the resolution of floating point".to_owned()
        }
        TerminationReason::LostPatience => "not converged: too many evaluations".to_owned(),
        TerminationReason::Numerical(what) => {
            format!("not converged: {what} is not a finite number")
        }
        TerminationReason::User(what) | TerminationReason::WrongDimensions(what) => {
            format!("not converged: {what} could not be computed")
        }
        TerminationReason::NoParameters => "not converged: no parameters".to_owned(),
        TerminationReason::NoResiduals => "not converged: no presses".to_owned(),
    }
}
