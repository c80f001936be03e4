//! Estimates the position of a camera from the columns in which it saw known positions, with the rig description as prior.
//!
//! Fits position, skew, distortion and field of view of one camera to (column, position) pairs, robustly, and deviates from
//! the nominal geometry only as far as the data require. The prior allows any number of pairs and makes the cost comparable
//! between readings of a session: a displaced camera can explain mirrored positions, and the prior charges for the
//! displacement.

use nalgebra::{SMatrix, SVector};
use skinrig_model::{CameraModel, Point2, SENSOR_WIDTH};

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
/// Iterations of the fit, at most.
const ROUNDS: usize = 12;
/// A step of this many prior standard deviations ends the fit.
const CONVERGED: f64 = 1e-6;
/// Least square of a distance from the camera, mm²: directions of positions at the camera turn without limit.
const NEAREST_MM2: f64 = 1e-6;

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
        if (0..PARAMETERS).all(|k| step[k].abs() < CONVERGED * PRIOR[k]) {
            break;
        }
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
    if angle.abs() < 180.0 {
        return angle;
    }
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
    let camera = moved(drawn, off);
    let mut normal = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
    let mut right = Vector::zeros();
    for (&(column, at), r) in pairs.iter().zip(residuals) {
        let by = slope(drawn, &camera, column, at);
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

/// Derivatives of [`residual_deg`] by the parameters.
fn slope(drawn: &CameraModel, camera: &CameraModel, column: f64, at: Point2) -> Vector {
    // By the camera's position, the direction of a point turns by this, degrees per mm.
    let turn = |to: Point2| {
        let (x, y) = (
            to.x_mm - camera.position.x_mm,
            to.y_mm - camera.position.y_mm,
        );
        let square = (x * x + y * y).max(NEAREST_MM2);
        [(y / square).to_degrees(), (-x / square).to_degrees()]
    };
    let (of_point, of_axis) = (turn(at), turn(camera.aim));
    let half = f64::from(SENSOR_WIDTH) / 2.0;
    let angle = camera.lens.angle((column - half) / half);
    Vector::new(
        of_point[0] - of_axis[0],
        of_point[1] - of_axis[1],
        1.0,
        angle.by_w,
        angle.by_half_fov * drawn.lens.coefficients().0,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::StereoGeometry;

    #[test]
    fn derivatives_are_the_slopes_of_the_residual() {
        let drawn = StereoGeometry::PAPER.cameras[0];
        let off = Vector::new(1.5, -2.0, 3.0, 0.05, -0.02);
        let at_off = |off: &Vector, column, at| residual_deg(&moved(&drawn, off), column, at);
        for (column, at) in [
            (40.0, Point2::new(-30.0, 20.0)),
            (333.0, Point2::new(10.0, 2.0)),
            (610.0, Point2::new(20.0, -20.0)),
        ] {
            let by = slope(&drawn, &moved(&drawn, &off), column, at);
            for k in 0..PARAMETERS {
                let step = 1e-5 * PRIOR[k];
                let (mut ahead, mut behind) = (off, off);
                ahead[k] += step;
                behind[k] -= step;
                let slope =
                    (at_off(&ahead, column, at) - at_off(&behind, column, at)) / (2.0 * step);
                assert!(
                    (slope - by[k]).abs() < 1e-4 * (1.0 + slope.abs()),
                    "{k}: {slope} {}",
                    by[k]
                );
            }
        }
    }

    #[test]
    fn a_position_at_the_camera_leaves_a_fit() {
        let drawn = StereoGeometry::PAPER.cameras[0];
        let mut pairs: Vec<(f64, Point2)> = (0..9)
            .map(|k| Point2::new(f64::from(k % 3) * 10.0, f64::from(k / 3) * 10.0))
            .filter_map(|at| Some((drawn.column_of_point(at)?, at)))
            .collect();
        assert_eq!(pairs.len(), 9);
        pairs.push((320.0, drawn.position));
        let fit = resect(&drawn, &pairs, pairs.len()).unwrap();
        assert!(fit.off.iter().all(|v| v.is_finite()));
        assert!(fit.spread_deg <= MIN_SPREAD_DEG, "{fit:?}");
    }
}
