//! Estimates the position of a camera from the columns in which it saw known positions, with the rig description as prior.
//!
//! Fits position, skew, distortion and field of view of one camera to (column, position) pairs, robustly, and deviates from
//! the nominal geometry only as far as the data require. The prior allows any number of pairs and makes the cost comparable
//! between readings of a session: a displaced camera can explain mirrored positions, and the prior charges for the
//! displacement.

use nalgebra::{SMatrix, SVector};
use skinrig_model::{CameraModel, Point2};

use super::statistics::median;

/// x and y (mm), skew (degrees), distortion W, relative field of view.
const PARAMETERS: usize = 5;
/// Standard deviation of a rig from its description. The initial guess for the published rig was off by 3.5 mm per
/// coordinate (rms of four), 1.7 degrees of skew and 0.13 in W; slightly larger values tolerate a hastily measured rig.
const PRIOR: [f64; PARAMETERS] = [5.0, 5.0, 2.5, 0.2, 0.05];
/// Maximum number of independent locations: errors of a skin are correlated between neighbours.
pub(super) const MAX_PLACES: f64 = 25.0;
/// Lower bound of the angle uncertainty, degrees: half a degree is 5 columns.
pub(super) const MIN_SPREAD_DEG: f64 = 0.5;
/// Standard deviation of a normal distribution divided by its median absolute value.
pub(super) const MEDIAN_TO_SIGMA: f64 = 1.4826;
/// Residuals of this many standard deviations have half weight.
const SOFT: f64 = 2.5;
/// Iterations of the fit.
const ROUNDS: usize = 12;
/// Step sizes of the numerical derivatives.
const STEP: [f64; PARAMETERS] = [1e-3, 1e-3, 1e-3, 1e-4, 1e-4];

type Vector = SVector<f64, PARAMETERS>;

/// A camera fitted to observations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Resection {
    pub camera: CameraModel,
    /// Difference from the nominal camera: x and y (mm), skew (degrees), W, relative field of view.
    pub off: [f64; PARAMETERS],
    /// Robust standard deviation of the viewing angles about the fit, degrees.
    pub spread_deg: f64,
    /// Negative log likelihood of the angles plus the prior of the fit, nats, up to a constant that depends only on the
    /// locations.
    pub cost: f64,
}

/// Fits `nominal` to the pairs, which have the weight of `locations` observations. `None` with fewer than 3 pairs.
pub(crate) fn resect(
    drawn: &CameraModel,
    pairs: &[(f64, Point2)],
    places: usize,
) -> Option<Resection> {
    if pairs.len() < 3 {
        return None;
    }
    let independent = (places as f64).min(MAX_PLACES);
    let weight = independent / pairs.len() as f64;
    let mut off = Vector::zeros();
    let mut best: Option<(f64, Vector, f64)> = None;
    for _ in 0..ROUNDS {
        let residuals = residuals(&moved(drawn, &off), pairs);
        let spread = spread_deg(&residuals)?;
        let prior: f64 = (0..PARAMETERS).map(|k| (off[k] / PRIOR[k]).powi(2)).sum();
        let cost = independent * libm::log(spread) + 0.5 * prior;
        if best.is_none_or(|(least, ..)| cost < least) {
            best = Some((cost, off, spread));
        }
        let Some(step) = step(drawn, &off, pairs, &residuals, spread, weight) else {
            break;
        };
        off += step;
        // A lens that folds, or a camera at the other end of the room, is not a fit.
        for k in 0..PARAMETERS {
            off[k] = off[k].clamp(-12.0 * PRIOR[k], 12.0 * PRIOR[k]);
        }
        off[3] = off[3].clamp(
            -0.9 - drawn.lens.coefficients().1,
            0.9 - drawn.lens.coefficients().1,
        );
    }
    let (cost, off, spread_deg) = best?;
    Some(Resection {
        camera: moved(drawn, &off),
        off: off.into(),
        spread_deg,
        cost,
    })
}

/// Viewing angle of each column minus that of its position, degrees within ±180.
pub(super) fn residuals(camera: &CameraModel, pairs: &[(f64, Point2)]) -> Vec<f64> {
    let one = |&(column, at): &(f64, Point2)| residual_deg(camera, column, at);
    pairs.iter().map(one).collect()
}

/// Viewing angle of `column` minus that of `at`, degrees within ±180.
pub(crate) fn residual_deg(camera: &CameraModel, column: f64, at: Point2) -> f64 {
    wrapped_deg(camera.angle_of_column_deg(column) - camera.angle_of_point_deg(at))
}

/// The same angle within ±180, degrees.
pub(super) fn wrapped_deg(angle: f64) -> f64 {
    angle - 360.0 * (angle / 360.0).round()
}

/// Robust standard deviation about 0, degrees.
pub(crate) fn spread_deg(residuals: &[f64]) -> Option<f64> {
    let usual = median(residuals.iter().map(|r| r.abs()).collect())?;
    let spread = MEDIAN_TO_SIGMA * usual;
    spread.is_finite().then(|| spread.max(MIN_SPREAD_DEG))
}

fn moved(drawn: &CameraModel, off: &Vector) -> CameraModel {
    let (half_fov_deg, w) = drawn.lens.coefficients();
    let mut camera = *drawn;
    camera.position = Point2::new(drawn.position.x_mm + off[0], drawn.position.y_mm + off[1]);
    camera.skew_deg += off[2];
    camera.lens = drawn.lens.with(half_fov_deg * (1.0 + off[4]), w + off[3]);
    camera
}

/// A Gauss-Newton step with softly bounded residuals.
fn step(
    drawn: &CameraModel,
    off: &Vector,
    pairs: &[(f64, Point2)],
    residuals: &[f64],
    spread: f64,
    weight: f64,
) -> Option<Vector> {
    let ahead: Vec<CameraModel> = (0..PARAMETERS)
        .map(|k| {
            let mut there = *off;
            there[k] += STEP[k];
            moved(drawn, &there)
        })
        .collect();
    let mut normal = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
    let mut right = Vector::zeros();
    for (pair, r) in pairs.iter().zip(residuals) {
        let mut by = Vector::zeros();
        for k in 0..PARAMETERS {
            by[k] = (residual_deg(&ahead[k], pair.0, pair.1) - r) / STEP[k];
        }
        let soft = weight / (1.0 + (r / (SOFT * spread)).powi(2)) / (spread * spread);
        normal += by * by.transpose() * soft;
        right -= by * (soft * r);
    }
    for k in 0..PARAMETERS {
        let precision = 1.0 / (PRIOR[k] * PRIOR[k]);
        normal[(k, k)] += precision;
        right[k] -= precision * off[k];
    }
    let step = normal.cholesky()?.solve(&right);
    step.iter().all(|v| v.is_finite()).then_some(step)
}
