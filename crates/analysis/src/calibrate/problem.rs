//! The least-squares problem: bounded residuals of the calibration presses and their analytic derivatives.
//!
//! There are two measures of how well a geometry locates a press. The final one is the [error](Measure::Error), estimate
//! minus truth. It is hard to minimise from far away: it has poles where rays are parallel and jumps where they meet at a
//! camera. The [arc](Measure::Arc) from ray to truth is smooth everywhere, and each camera's arc depends on that camera
//! alone: it leads from any start into the valley whose minimum the error then finds.

use nalgebra::{DMatrix, DVector, SMatrix};
use skinrig_model::{CameraModel, LensAngle, Point2, SENSOR_WIDTH, StereoGeometry};

use super::parameters::{PARAMETERS, Parameters, with_parameters};
use crate::sets::CalibrationPress;
use crate::triangulate::{Intersection, PARALLEL_SINE, intersect_rays};

/// Errors longer than this many bounds have no slope: it falls with the cube of the length.
const SATURATED: f64 = 1e6;

/// One camera at given parameters, with everything that does not depend on the press.
#[derive(Debug, Clone)]
struct PosedCamera {
    camera: CameraModel,
    /// Unit vector of the axis before skew, and the derivative of its counter-clockwise angle by x and y, rad/mm.
    axis: [f64; 2],
    axis_turn: [f64; 2],
    /// Half field of view at scale 1, degrees.
    half_fov_deg: f64,
}

impl PosedCamera {
    fn new(camera: CameraModel, half_fov_deg: f64) -> Self {
        let ax = camera.aim.x_mm - camera.position.x_mm;
        let ay = camera.aim.y_mm - camera.position.y_mm;
        let length = libm::hypot(ax, ay);
        let axis = [ax / length, ay / length];
        Self {
            camera,
            axis,
            axis_turn: [axis[1] / length, -axis[0] / length],
            half_fov_deg,
        }
    }

    /// Lens angle at this column and unit direction of the ray: the axis turned clockwise by angle and skew.
    fn ray(&self, column: f64) -> (LensAngle, [f64; 2]) {
        let half = f64::from(SENSOR_WIDTH) / 2.0;
        let s = (column - half) / half;
        let angle = self.camera.lens.angle(s);
        let (sin, cos) = libm::sincos((angle.deg + self.camera.skew_deg).to_radians());
        let [ax, ay] = self.axis;
        (angle, [ax * cos + ay * sin, ay * cos - ax * sin])
    }
}

/// Where the rays of two columns meet, and how the position moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RayCrossing {
    /// Position, mm.
    pub at: [f64; 2],
    /// Derivative of x and y by the column of each camera, mm/px.
    pub by_column: [[f64; 2]; 2],
    /// Derivative of x and y by all parameters, mm per unit.
    pub by_parameter: [[f64; PARAMETERS]; 2],
}

/// Both cameras at given parameters.
#[derive(Debug, Clone)]
pub(crate) struct StereoModel([PosedCamera; 2]);

impl StereoModel {
    /// `base` at its own parameters.
    pub(crate) fn of(base: &StereoGeometry) -> Self {
        Self(
            base.cameras
                .map(|c| PosedCamera::new(c, c.lens.coefficients().0)),
        )
    }

    fn at(base: &StereoGeometry, p: &Parameters) -> Self {
        let moved = with_parameters(base, p);
        Self(
            [0, 1]
                .map(|k| PosedCamera::new(moved.cameras[k], base.cameras[k].lens.coefficients().0)),
        )
    }

    /// Estimate minus truth, mm; `None` if the rays do not meet in front of both cameras.
    pub(crate) fn error_vector(&self, sight: &CalibrationPress) -> Option<[f64; 2]> {
        let d = [0, 1].map(|k| self.0[k].ray(sight.columns[k]).1);
        self.error_of(sight.truth, &self.intersect(d))
    }

    fn intersect(&self, directions: [[f64; 2]; 2]) -> Intersection {
        let positions = [0, 1].map(|k| self.0[k].camera.position);
        intersect_rays(positions, directions)
    }

    fn error_of(&self, truth: Point2, hit: &Intersection) -> Option<[f64; 2]> {
        let fixed = hit.sine.abs() >= PARALLEL_SINE && hit.range_mm.iter().all(|r| *r >= 0.0);
        let error = [hit.at.x_mm - truth.x_mm, hit.at.y_mm - truth.y_mm];
        (fixed && error.iter().all(|e| e.is_finite())).then_some(error)
    }

    /// Where the rays of these columns meet; `None` if not in front of both cameras.
    pub(crate) fn crossing(&self, columns: [f64; 2]) -> Option<RayCrossing> {
        let (at, by_parameter) = self.linearised(columns, Point2::new(0.0, 0.0))?;
        let mut by_column = [[0.0; 2]; 2];
        for (k, eye) in self.0.iter().enumerate() {
            let half = f64::from(SENSOR_WIDTH) / 2.0;
            let slope = eye.camera.lens.angle((columns[k] - half) / half).by_s / half;
            // The skew turns a ray by one degree per degree.
            for axis in 0..2 {
                by_column[axis][k] = by_parameter[axis][4 + k] * slope;
            }
        }
        let numbers = [at, by_column[0], by_column[1]];
        let finite = numbers.iter().flatten().all(|v| v.is_finite());
        finite.then_some(RayCrossing {
            at,
            by_column,
            by_parameter,
        })
    }

    /// Error vector and its derivative by all parameters, mm per unit: rows x and y.
    ///
    /// With n_k the direction d_k turned by +90 degrees, the intersection X solves `n_k . (X - p_k) = 0`. Its
    /// differential is `n_k . dX = n_k . dp_k + r_k dphi_k`, where phi_k is the ray's counter-clockwise angle: the
    /// axis angle `atan2(aim - p_k)` minus theta_k.
    fn linearised(
        &self,
        columns: [f64; 2],
        truth: Point2,
    ) -> Option<([f64; 2], [[f64; PARAMETERS]; 2])> {
        let rays = [0, 1].map(|k| self.0[k].ray(columns[k]));
        let hit = self.intersect(rays.map(|(_, d)| d));
        let error = self.error_of(truth, &hit)?;
        let mut slope = [[0.0; PARAMETERS]; 2];
        for (k, eye) in self.0.iter().enumerate() {
            let (angle, d) = rays[k];
            let r = hit.range_mm[k];
            let per_degree = -r * 1f64.to_radians();
            // Solve [n_1; n_2] dX = b e_k: along the other ray, because n_1 . d_2 = s and n_2 . d_1 = -s.
            let other = rays[1 - k].1;
            let along = if k == 0 { 1.0 } else { -1.0 } / hit.sine;
            let right_hand_sides = [
                (2 * k, -d[1] + r * eye.axis_turn[0]),
                (2 * k + 1, d[0] + r * eye.axis_turn[1]),
                (4 + k, per_degree),
                (6 + k, per_degree * angle.by_w),
                (8 + k, per_degree * angle.by_half_fov * eye.half_fov_deg),
            ];
            for (parameter, b) in right_hand_sides {
                slope[0][parameter] = along * b * other[0];
                slope[1][parameter] = along * b * other[1];
            }
        }
        Some((error, slope))
    }

    /// For each camera the arc from its ray to the truth, counter-clockwise, mm, and its derivative by all parameters.
    ///
    /// With v = truth - p the arc is `|v| (angle of v - phi)`, phi as above.
    fn arcs(&self, sight: &CalibrationPress) -> ([f64; 2], [[f64; PARAMETERS]; 2]) {
        let mut arcs = [0.0; 2];
        let mut slope = [[0.0; PARAMETERS]; 2];
        for (k, eye) in self.0.iter().enumerate() {
            let (angle, d) = eye.ray(sight.columns[k]);
            let p = eye.camera.position;
            let v = [sight.truth.x_mm - p.x_mm, sight.truth.y_mm - p.y_mm];
            let range = libm::hypot(v[0], v[1]);
            let turn = libm::atan2(d[0] * v[1] - d[1] * v[0], d[0] * v[0] + d[1] * v[1]);
            arcs[k] = range * turn;
            let per_degree = range * 1f64.to_radians();
            let by = &mut slope[k];
            by[2 * k] = v[1] / range - range * eye.axis_turn[0] - turn * v[0] / range;
            by[2 * k + 1] = -v[0] / range - range * eye.axis_turn[1] - turn * v[1] / range;
            by[4 + k] = per_degree;
            by[6 + k] = per_degree * angle.by_w;
            by[8 + k] = per_degree * angle.by_half_fov * eye.half_fov_deg;
        }
        (arcs, slope)
    }
}

/// Definition of the two residuals of a press, mm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Measure {
    /// Estimate minus truth, x and y; the bound applies to the length of the vector.
    Error,
    /// Arc about camera 1 and camera 2 from the ray to the truth; each is bounded.
    Arc,
}

/// Sum of squared residuals, half of its gradient `Jᵀr`, and the normal matrix `JᵀJ`.
pub(super) struct NormalEquations {
    pub cost: f64,
    pub gradient: Parameters,
    pub matrix: SMatrix<f64, PARAMETERS, PARAMETERS>,
}

/// Bounded residuals of presses as functions of the first `count` parameters.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub sights: &'a [CalibrationPress],
    pub base: &'a StereoGeometry,
    pub count: usize,
    pub measure: Measure,
    /// Maximum contribution of an error vector or arc, mm.
    pub bound_mm: f64,
    /// A descent ends when a step promises to lower the cost by at most this share of it.
    pub tolerance: f64,
}

impl Problem<'_> {
    /// Everything that a step needs, in one pass over the presses and without allocation. Sums are in the order of the
    /// presses.
    pub(super) fn normal(&self, p: &Parameters) -> NormalEquations {
        let stereo = StereoModel::at(self.base, p);
        let mut cost = 0.0;
        let mut gradient = [0.0; PARAMETERS];
        let mut matrix = [[0.0; PARAMETERS]; PARAMETERS];
        for sight in self.sights {
            let (residual, slope) = self.bounded(&stereo, sight);
            cost += residual[0] * residual[0] + residual[1] * residual[1];
            for i in 0..self.count {
                let (x, y) = (slope[0][i], slope[1][i]);
                gradient[i] += x * residual[0] + y * residual[1];
                // The upper triangle is not used, but whole rows are faster than half rows.
                for j in 0..PARAMETERS {
                    matrix[i][j] += x * slope[0][j] + y * slope[1][j];
                }
            }
        }
        let entry = |i: usize, j: usize| matrix[i.max(j)][i.min(j)];
        NormalEquations {
            cost,
            gradient: Parameters::from(gradient),
            matrix: SMatrix::from_fn(entry),
        }
    }

    /// All residuals (x and y of each press in turn) and the whole Jacobian.
    pub(super) fn rows(&self, p: &Parameters) -> (DVector<f64>, DMatrix<f64>) {
        let stereo = StereoModel::at(self.base, p);
        let mut residuals = DVector::zeros(2 * self.sights.len());
        let mut jacobian = DMatrix::zeros(2 * self.sights.len(), self.count);
        for (i, sight) in self.sights.iter().enumerate() {
            let (residual, slope) = self.bounded(&stereo, sight);
            for axis in 0..2 {
                residuals[2 * i + axis] = residual[axis];
                for j in 0..self.count {
                    jacobian[(2 * i + axis, j)] = slope[axis][j];
                }
            }
        }
        (residuals, jacobian)
    }

    fn bounded(
        &self,
        stereo: &StereoModel,
        sight: &CalibrationPress,
    ) -> ([f64; 2], [[f64; PARAMETERS]; 2]) {
        match self.measure {
            Measure::Error => self.bounded_error(stereo, sight),
            Measure::Arc => self.bounded_arcs(stereo, sight),
        }
    }

    /// `r / sqrt(1 + (r / c)²)` of each arc, and its slope.
    fn bounded_arcs(
        &self,
        stereo: &StereoModel,
        sight: &CalibrationPress,
    ) -> ([f64; 2], [[f64; PARAMETERS]; 2]) {
        let (mut arcs, mut slope) = stereo.arcs(sight);
        for (r, by) in arcs.iter_mut().zip(&mut slope) {
            let ratio = *r / self.bound_mm;
            let shrink = 1.0 / (1.0 + ratio * ratio).sqrt();
            *r *= shrink;
            let factor = shrink * shrink * shrink;
            by.iter_mut().for_each(|b| *b *= factor);
            if !r.is_finite() || !by.iter().all(|b| b.is_finite()) {
                (*r, *by) = (self.bound_mm, [0.0; PARAMETERS]);
            }
        }
        (arcs, slope)
    }

    /// `e / sqrt(1 + (e / c)²)` and its slope. A press without a fix counts c and has no slope.
    fn bounded_error(
        &self,
        stereo: &StereoModel,
        sight: &CalibrationPress,
    ) -> ([f64; 2], [[f64; PARAMETERS]; 2]) {
        let flat = [[0.0; PARAMETERS]; 2];
        let c = self.bound_mm;
        let Some((e, mut slope)) = stereo.linearised(sight.columns, sight.truth) else {
            return ([c * std::f64::consts::FRAC_1_SQRT_2; 2], flat);
        };
        let length = libm::hypot(e[0], e[1]);
        if length > SATURATED * c {
            return ([e[0] / length * c, e[1] / length * c], flat);
        }
        let shrink = 1.0 / (1.0 + (length / c) * (length / c)).sqrt();
        let bend = shrink * shrink * shrink / (c * c);
        let [by_x, by_y] = &mut slope;
        for (x, y) in by_x.iter_mut().zip(by_y) {
            let radial = bend * (e[0] * *x + e[1] * *y);
            *x = shrink * *x - e[0] * radial;
            *y = shrink * *y - e[1] * radial;
        }
        ([e[0] * shrink, e[1] * shrink], slope)
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::{LensKind, LensModel, PressId};

    use super::super::parameters::parameters_of;
    use super::*;

    fn sample_presses() -> Vec<CalibrationPress> {
        (0u32..12)
            .map(|i| CalibrationPress {
                press: PressId::from_index(i),
                location: i,
                repetition: 0,
                columns: [180.0 + 25.0 * f64::from(i), 410.0 - 9.0 * f64::from(i)],
                spreads: [None; 2],
                truth: Point2::new(10.0, f64::from(i)),
                cluster_events: 100,
            })
            .collect()
    }

    fn lens(kind: LensKind) -> StereoGeometry {
        let mut base = StereoGeometry::PAPER;
        for (camera, w) in base.cameras.iter_mut().zip([-0.17, 0.074]) {
            camera.lens = LensModel::new(kind, 58.0, w);
        }
        base
    }

    #[test]
    fn the_jacobian_is_the_slope_of_the_residuals_for_every_lens() {
        use LensKind::{Equidistant, Equisolid, Exponential, Rectilinear, Stereographic};
        let sights = sample_presses();
        for kind in [
            Exponential,
            Equidistant,
            Rectilinear,
            Stereographic,
            Equisolid,
        ] {
            let base = lens(kind);
            let p = parameters_of(&base);
            for measure in [Measure::Error, Measure::Arc] {
                let problem = Problem {
                    sights: &sights,
                    base: &base,
                    count: PARAMETERS,
                    measure,
                    bound_mm: 25.0,
                    tolerance: 0.0,
                };
                let (_, jacobian) = problem.rows(&p);
                for k in 0..PARAMETERS {
                    let h = 1e-6;
                    let at = |delta: f64| {
                        let mut q = p;
                        q[k] += delta;
                        problem.rows(&q).0
                    };
                    let slope = (at(h) - at(-h)) / (2.0 * h);
                    let worst = (slope - jacobian.column(k)).amax();
                    assert!(
                        worst < 1e-7 * (1.0 + jacobian.column(k).amax()),
                        "{kind:?}, {measure:?}, parameter {k}: {worst}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_normal_equations_are_those_of_the_rows() {
        let (sights, base) = (sample_presses(), lens(LensKind::Exponential));
        let p = parameters_of(&base);
        for count in [4, 6, 8, 10] {
            let problem = Problem {
                sights: &sights,
                base: &base,
                count,
                measure: Measure::Error,
                bound_mm: 25.0,
                tolerance: 0.0,
            };
            let (r, j) = problem.rows(&p);
            let normal = problem.normal(&p);
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (1.0 + b.abs());
            assert!(close(normal.cost, r.norm_squared()));
            let (gradient, matrix) = (j.transpose() * &r, j.transpose() * &j);
            for i in 0..count {
                assert!(close(normal.gradient[i], gradient[i]), "{i}");
                for k in 0..count {
                    assert!(close(normal.matrix[(i, k)], matrix[(i, k)]), "{i} {k}");
                }
            }
        }
    }
}
