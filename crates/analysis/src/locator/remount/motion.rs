//! A remount as numbers: skin and cameras move together, then each camera moves a little on the skin, and the lenses are known
//! as well as the earlier calibration left them.

use nalgebra::{DMatrix, SMatrix, SVector};
use skinrig_model::{Point2, RemountSettings, StereoGeometry};

use crate::calibrate::{PARAMETERS, parameters_of, with_parameters};

/// Shift (mm) and turn (degrees, counter-clockwise) of the whole.
pub(super) const WHOLE: usize = 3;
/// Numbers of a remount: those of the whole, then changes of the ten parameters of the geometry. The change of a skew is
/// that of the camera's axis, clockwise.
pub(super) const NUMBERS: usize = WHOLE + PARAMETERS;
/// Index of the first skew among the parameters of a geometry.
const SKEW: usize = 4;
/// Index of the first scale of the field of view.
const SCALE: usize = 8;

pub(super) type Numbers = SVector<f64, NUMBERS>;
pub(super) type Spread = SMatrix<f64, NUMBERS, NUMBERS>;

/// Rotation about a centre, then a shift.
#[derive(Debug, Clone, Copy)]
pub(super) struct RigidMotion {
    centre: [f64; 2],
    shift: [f64; 2],
    sin: f64,
    cos: f64,
}

impl RigidMotion {
    pub(super) fn new(centre: [f64; 2], numbers: &Numbers) -> Self {
        let (sin, cos) = libm::sincos(numbers[2].to_radians());
        Self {
            centre,
            shift: [numbers[0], numbers[1]],
            sin,
            cos,
        }
    }

    pub(super) fn forth(&self, at: [f64; 2]) -> [f64; 2] {
        let (x, y) = (at[0] - self.centre[0], at[1] - self.centre[1]);
        [
            self.centre[0] + self.shift[0] + self.cos * x - self.sin * y,
            self.centre[1] + self.shift[1] + self.sin * x + self.cos * y,
        ]
    }

    pub(super) fn back(&self, at: [f64; 2]) -> [f64; 2] {
        let x = at[0] - self.centre[0] - self.shift[0];
        let y = at[1] - self.centre[1] - self.shift[1];
        [
            self.centre[0] + self.cos * x + self.sin * y,
            self.centre[1] - self.sin * x + self.cos * y,
        ]
    }
}

/// Counter-clockwise angle of the axis of a camera before skew, degrees.
fn axis_deg(position: Point2, aim: Point2) -> f64 {
    libm::atan2(aim.y_mm - position.y_mm, aim.x_mm - position.x_mm).to_degrees()
}

/// Parameters of the geometry after a remount, relative to those of `base`; the points that the cameras aim at stay.
pub(super) fn parameters_after(
    base: &StereoGeometry,
    centre: [f64; 2],
    numbers: &Numbers,
) -> SVector<f64, PARAMETERS> {
    let motion = RigidMotion::new(centre, numbers);
    let mut p = parameters_of(base);
    for (k, camera) in base.cameras.iter().enumerate() {
        let own = |i: usize| numbers[WHOLE + i];
        let [x, y] = motion.forth([camera.position.x_mm, camera.position.y_mm]);
        let at = Point2::new(x + own(2 * k), y + own(2 * k + 1));
        let turned = axis_deg(at, camera.aim) - axis_deg(camera.position, camera.aim);
        let turned = turned - 360.0 * (turned / 360.0).round();
        (p[2 * k], p[2 * k + 1]) = (at.x_mm, at.y_mm);
        p[SKEW + k] += turned - numbers[2] + own(SKEW + k);
        for i in [SKEW + 2 + k, SCALE + k] {
            p[i] += own(i);
        }
    }
    p
}

/// The geometry after a remount.
pub(super) fn geometry_after(
    base: &StereoGeometry,
    centre: [f64; 2],
    numbers: &Numbers,
) -> StereoGeometry {
    with_parameters(base, &parameters_after(base, centre, numbers))
}

/// Covariance of a remount before any press: by the settings, and by what the earlier calibration leaves open about its
/// parameters.
pub(super) fn prior(
    base: &StereoGeometry,
    earlier: Option<&DMatrix<f64>>,
    scales: &RemountSettings,
) -> Spread {
    let mut out = Spread::zeros();
    let whole = [scales.shift_mm, scales.shift_mm, scales.turn_deg];
    for (i, scale) in whole.into_iter().enumerate() {
        out[(i, i)] = scale * scale;
    }
    if let Some(covariance) = earlier {
        // A camera that moves while its skew stays turns, because its axis keeps pointing at the same point.
        let mut of_axis = SMatrix::<f64, PARAMETERS, PARAMETERS>::identity();
        for (k, camera) in base.cameras.iter().enumerate() {
            let (ax, ay) = (
                camera.aim.x_mm - camera.position.x_mm,
                camera.aim.y_mm - camera.position.y_mm,
            );
            let square = ax * ax + ay * ay;
            of_axis[(SKEW + k, 2 * k)] = -(ay / square).to_degrees();
            of_axis[(SKEW + k, 2 * k + 1)] = (ax / square).to_degrees();
        }
        let own = SMatrix::<f64, PARAMETERS, PARAMETERS>::from_fn(|i, j| covariance[(i, j)]);
        let turned = of_axis * own * of_axis.transpose();
        out.fixed_view_mut::<PARAMETERS, PARAMETERS>(WHOLE, WHOLE)
            .copy_from(&turned);
    }
    for i in 0..SKEW + 2 {
        let scale = if i < SKEW {
            scales.camera_shift_mm
        } else {
            scales.camera_turn_deg
        };
        out[(WHOLE + i, WHOLE + i)] += scale * scale;
    }
    out
}

/// A matrix `R` with `R Rᵀ` equal to a covariance, which may be singular.
pub(super) fn root(covariance: &Spread) -> Spread {
    let split = covariance.symmetric_eigen();
    let mut root = split.eigenvectors;
    for (mut column, value) in root.column_iter_mut().zip(split.eigenvalues.iter()) {
        column *= value.max(0.0).sqrt();
    }
    root
}

/// Covariance of the parameters of the geometry after a remount; scales are relative to that geometry.
pub(super) fn covariance_after(
    base: &StereoGeometry,
    centre: [f64; 2],
    numbers: &Numbers,
    covariance: &Spread,
) -> DMatrix<f64> {
    const STEP: f64 = 1e-5;
    let own = parameters_after(base, centre, numbers);
    let mut slope = SMatrix::<f64, PARAMETERS, NUMBERS>::zeros();
    for j in 0..NUMBERS {
        let (mut ahead, mut behind) = (*numbers, *numbers);
        ahead[j] += STEP;
        behind[j] -= STEP;
        let change =
            parameters_after(base, centre, &ahead) - parameters_after(base, centre, &behind);
        slope.set_column(j, &(change / (2.0 * STEP)));
    }
    for i in SCALE..PARAMETERS {
        let mut row = slope.row_mut(i);
        row /= own[i];
    }
    let of_parameters = slope * covariance * slope.transpose();
    DMatrix::from_fn(PARAMETERS, PARAMETERS, |i, j| of_parameters[(i, j)])
}

#[cfg(test)]
mod tests {
    use super::*;

    const CENTRE: [f64; 2] = [10.0, 2.0];

    /// What a camera saw before is at the moved position afterwards, in the same column.
    #[test]
    fn a_rigid_motion_moves_what_both_cameras_see() {
        let base = StereoGeometry::paper_like([43.0, -33.5, 46.0, 38.0, -1.2, 0.9, -0.11, 0.05]);
        let mut numbers = Numbers::zeros();
        (numbers[0], numbers[1], numbers[2]) = (1.5, -0.7, 3.0);
        let motion = RigidMotion::new(CENTRE, &numbers);
        let after = geometry_after(&base, CENTRE, &numbers);
        for at in [[0.0, 0.0], [-20.0, 12.0], [25.0, -9.0]] {
            let moved = motion.forth(at);
            let [x, y] = motion.back(moved);
            assert!((x - at[0]).abs() < 1e-12 && (y - at[1]).abs() < 1e-12);
            for k in 0..2 {
                let column = |g: &StereoGeometry, [x, y]: [f64; 2]| {
                    g.cameras[k].column_of_point(Point2::new(x, y)).unwrap()
                };
                let off = column(&base, at) - column(&after, moved);
                assert!(off.abs() < 1e-9, "{at:?} {k}: {off}");
            }
        }
    }

    #[test]
    fn the_root_of_a_singular_prior_gives_it_back() {
        let base = StereoGeometry::PAPER;
        let mut covariance = DMatrix::zeros(PARAMETERS, PARAMETERS);
        for i in 0..6 {
            covariance[(i, i)] = 0.1 + 0.05 * i as f64;
        }
        let all = prior(&base, Some(&covariance), &RemountSettings::default());
        let root = root(&all);
        assert!((root * root.transpose() - all).amax() < 1e-12);
        assert_eq!(all[(NUMBERS - 1, NUMBERS - 1)], 0.0);
    }
}
