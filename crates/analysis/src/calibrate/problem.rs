//! The least-squares problem: error vectors of the calibrating presses and their analytic derivatives.

use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};
use skinrig_model::{CameraModel, LensModel, SENSOR_WIDTH, StereoGeometry};

use crate::sets::Sight;
use crate::triangulate::{PARALLEL_SINE, intersect};

/// Two positions, two skews, two distortions.
pub const PARAMETERS: usize = 8;

/// (x1, y1, x2, y2, skew 1, skew 2, W 1, W 2): the order in which nested models take parameters in.
pub fn parameters_of(geometry: &StereoGeometry) -> [f64; PARAMETERS] {
    let [a, b] = &geometry.cameras;
    let w = |c: &CameraModel| match c.lens {
        LensModel::Exponential { w, .. } => w,
    };
    [
        a.position.x_mm,
        a.position.y_mm,
        b.position.x_mm,
        b.position.y_mm,
        a.skew_deg,
        b.skew_deg,
        w(a),
        w(b),
    ]
}

/// `base` with its first parameters replaced.
pub fn with_parameters(base: &StereoGeometry, parameters: &[f64]) -> StereoGeometry {
    let mut p = parameters_of(base);
    for (to, from) in p.iter_mut().zip(parameters) {
        *to = *from;
    }
    let mut geometry = *base;
    for (k, camera) in geometry.cameras.iter_mut().enumerate() {
        camera.position.x_mm = p[2 * k];
        camera.position.y_mm = p[2 * k + 1];
        camera.skew_deg = p[4 + k];
        match &mut camera.lens {
            LensModel::Exponential { w, .. } => *w = p[6 + k],
        }
    }
    geometry
}

/// Estimate minus truth, mm; `None` where the rays do not meet in front of both cameras.
pub fn error_vector(geometry: &StereoGeometry, sight: &Sight) -> Option<[f64; 2]> {
    let hit = intersect(geometry, angles(geometry, sight));
    let fixed = hit.sine.abs() >= PARALLEL_SINE && hit.range_mm.iter().all(|r| *r >= 0.0);
    let error = [
        hit.at.x_mm - sight.truth.x_mm,
        hit.at.y_mm - sight.truth.y_mm,
    ];
    (fixed && error.iter().all(|e| e.is_finite())).then_some(error)
}

fn angles(geometry: &StereoGeometry, sight: &Sight) -> [f64; 2] {
    [0, 1].map(|k| geometry.cameras[k].angle_of_column_deg(sight.columns[k]))
}

/// Derivative of the intersection by all parameters, mm per unit: rows x and y.
///
/// With n_k the direction d_k turned by +90 degrees, the intersection X solves `n_k . (X - p_k) = 0`. Its
/// differential is `n_k . dX = n_k . dp_k + r_k dphi_k`, where phi_k is the ray's counter-clockwise angle: the
/// axis angle `atan2(aim - p_k)` minus theta_k.
fn derivative(geometry: &StereoGeometry, sight: &Sight) -> [[f64; PARAMETERS]; 2] {
    let theta = angles(geometry, sight);
    let hit = intersect(geometry, theta);
    let d = [0, 1].map(|k| geometry.cameras[k].direction(theta[k]));
    let n = d.map(|d| [-d[1], d[0]]);
    let mut out = [[0.0; PARAMETERS]; 2];
    for k in 0..2 {
        let camera = &geometry.cameras[k];
        let axis = [
            camera.aim.x_mm - camera.position.x_mm,
            camera.aim.y_mm - camera.position.y_mm,
        ];
        let length_sq = axis[0] * axis[0] + axis[1] * axis[1];
        let r = hit.range_mm[k];
        let half = f64::from(SENSOR_WIDTH) / 2.0;
        let s = (sight.columns[k] - half) / half;
        let by_w = match camera.lens {
            // d/dW of s * half_fov * exp(-W |s|), degrees.
            LensModel::Exponential { .. } => -s.abs() * camera.lens.angle_deg(s).0,
        };
        let right_hand_sides = [
            (2 * k, n[k][0] + r * axis[1] / length_sq),
            (2 * k + 1, n[k][1] - r * axis[0] / length_sq),
            (4 + k, -r * 1f64.to_radians()),
            (6 + k, -r * by_w.to_radians()),
        ];
        // Solve [n_1; n_2] dX = b e_k: along the other ray, as n_1 . d_2 = s and n_2 . d_1 = -s.
        let other = d[1 - k];
        let sign = if k == 0 { 1.0 } else { -1.0 };
        for (parameter, b) in right_hand_sides {
            out[0][parameter] = sign * b * other[0] / hit.sine;
            out[1][parameter] = sign * b * other[1] / hit.sine;
        }
    }
    out
}

/// Bounded error vectors of all presses as functions of the first parameters.
pub struct Problem<'a> {
    sights: &'a [Sight],
    base: &'a StereoGeometry,
    parameters: DVector<f64>,
    bound_mm: f64,
}

impl<'a> Problem<'a> {
    pub fn new(
        sights: &'a [Sight],
        base: &'a StereoGeometry,
        parameters: DVector<f64>,
        bound_mm: f64,
    ) -> Self {
        Self {
            sights,
            base,
            parameters,
            bound_mm,
        }
    }

    pub fn geometry(&self) -> StereoGeometry {
        with_parameters(self.base, self.parameters.as_slice())
    }

    pub fn parameters(&self) -> &DVector<f64> {
        &self.parameters
    }

    /// Residuals and Jacobian at the current parameters.
    pub fn linearised(&self) -> (DVector<f64>, DMatrix<f64>) {
        let geometry = self.geometry();
        let count = self.parameters.len();
        let mut residuals = DVector::zeros(2 * self.sights.len());
        let mut jacobian = DMatrix::zeros(2 * self.sights.len(), count);
        for (i, sight) in self.sights.iter().enumerate() {
            let Some(e) = error_vector(&geometry, sight) else {
                // No fix: the bound itself, without a slope to follow.
                residuals[2 * i] = self.bound_mm * std::f64::consts::FRAC_1_SQRT_2;
                residuals[2 * i + 1] = residuals[2 * i];
                continue;
            };
            let c_sq = self.bound_mm * self.bound_mm;
            let shrink = 1.0 / (1.0 + (e[0] * e[0] + e[1] * e[1]) / c_sq).sqrt();
            let slope = derivative(&geometry, sight);
            for axis in 0..2 {
                residuals[2 * i + axis] = e[axis] * shrink;
                for p in 0..count {
                    let radial = e[0] * slope[0][p] + e[1] * slope[1][p];
                    jacobian[(2 * i + axis, p)] = shrink * slope[axis][p]
                        - e[axis] * radial * (shrink * shrink * shrink) / c_sq;
                }
            }
        }
        (residuals, jacobian)
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.parameters.copy_from(x);
    }

    fn params(&self) -> DVector<f64> {
        self.parameters.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.linearised().0)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        Some(self.linearised().1)
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::{Point2, PressId};

    use super::*;

    #[test]
    fn the_jacobian_is_the_slope_of_the_residuals() {
        let sights: Vec<Sight> = (0u32..12)
            .map(|i| Sight {
                press: PressId(i),
                columns: [180.0 + 25.0 * f64::from(i), 410.0 - 9.0 * f64::from(i)],
                truth: Point2::new(10.0, f64::from(i)),
            })
            .collect();
        let base = StereoGeometry::PAPER;
        let p = DVector::from_column_slice(&parameters_of(&base));
        let (_, jacobian) = Problem::new(&sights, &base, p.clone(), 25.0).linearised();
        for k in 0..PARAMETERS {
            let h = 1e-5;
            let at = |delta: f64| {
                let mut q = p.clone();
                q[k] += delta;
                Problem::new(&sights, &base, q, 25.0).linearised().0
            };
            let slope = (at(h) - at(-h)) / (2.0 * h);
            let worst = (slope - jacobian.column(k)).amax();
            assert!(
                worst < 1e-5 * (1.0 + jacobian.column(k).amax()),
                "parameter {k}: {worst}"
            );
        }
    }
}
