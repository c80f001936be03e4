//! The geometry of a camera that looks sideways through the skin: from pixel column to ray and back.
//!
//! With `s = (u - 320) / 320` the [lens](LensModel) gives the angle from the optical axis, and the viewing angle is
//! that angle plus the skew. A positive angle turns the camera's axis, which points at the skin centre, clockwise.
//!
//! Transcendental functions come from the `libm` crate, so that simulated bytes are the same on every machine.

use serde::{Deserialize, Serialize};

use crate::frame::Point2;
use crate::lens::LensModel;

/// Columns of the sensor (EVK1 Gen3.1 VGA).
pub const SENSOR_WIDTH: u16 = 640;
/// Rows of the sensor.
pub const SENSOR_HEIGHT: u16 = 480;

/// One camera in the skin's plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CameraModel {
    /// Optical centre, skin frame, mm.
    pub position: Point2,
    /// Point that the axis passes through before skew: the skin centre.
    pub aim: Point2,
    /// Rotation of the axis away from `aim`, degrees, clockwise positive.
    pub skew_deg: f64,
    /// The lens.
    pub lens: LensModel,
}

impl CameraModel {
    /// Viewing angle of column `u` (fractional, 0..=640), degrees, skew included.
    #[must_use]
    pub fn angle_of_column_deg(&self, u: f64) -> f64 {
        let half = f64::from(SENSOR_WIDTH) / 2.0;
        self.lens.angle_deg((u - half) / half).0 + self.skew_deg
    }

    /// Unit direction of the ray at `angle_deg`: the axis turned clockwise by it.
    #[must_use]
    pub fn direction(&self, angle_deg: f64) -> [f64; 2] {
        let (ax, ay) = (
            self.aim.x_mm - self.position.x_mm,
            self.aim.y_mm - self.position.y_mm,
        );
        let length = libm::hypot(ax, ay);
        let (sin, cos) = libm::sincos(angle_deg.to_radians());
        [
            (ax * cos + ay * sin) / length,
            (ay * cos - ax * sin) / length,
        ]
    }

    /// Viewing angle of the point `p`, degrees in -180..=180, skew included. The inverse of [`Self::direction`].
    #[must_use]
    pub fn angle_of_point_deg(&self, p: Point2) -> f64 {
        let (ax, ay) = (
            self.aim.x_mm - self.position.x_mm,
            self.aim.y_mm - self.position.y_mm,
        );
        let (bx, by) = (p.x_mm - self.position.x_mm, p.y_mm - self.position.y_mm);
        // Clockwise from a to b: the negated counter-clockwise angle.
        -libm::atan2(ax * by - ay * bx, ax * bx + ay * by).to_degrees()
    }

    /// The fractional column at which `p` appears, or `None` outside the field of view (columns 0..=640). If a
    /// strong distortion folds the image, so that two columns show `p`, the one nearer the axis.
    #[must_use]
    pub fn column_of_point(&self, p: Point2) -> Option<f64> {
        let target_deg = self.angle_of_point_deg(p) - self.skew_deg;
        let half = f64::from(SENSOR_WIDTH) / 2.0;
        let edge = self.fold();
        let (mut low, mut high) = (-edge, edge);
        let field = self.lens.angle_deg(low).0..=self.lens.angle_deg(high).0;
        if !field.contains(&target_deg) {
            return None;
        }
        // The angle grows with s between the folds; bisection is exact to the last bits in 60 steps.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.lens.angle_deg(middle).0 < target_deg {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(half + half * 0.5 * (low + high))
    }

    /// The `s` up to which the angle grows: 1, the sensor's edge, or the fold of a strong distortion.
    fn fold(&self) -> f64 {
        let grows = |s: f64| self.lens.angle_deg(s).1 >= 0.0;
        if grows(1.0) {
            return 1.0;
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if grows(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }
}

/// Both cameras.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StereoGeometry {
    /// Camera 1 and camera 2.
    pub cameras: [CameraModel; 2],
}

impl StereoGeometry {
    /// The published optimum (public code: p1, p2, skews, W; half field of view 60°, aim (10, 2)).
    pub const PAPER: Self =
        Self::paper_like([44.25, -31.98, 49.71, 39.81, -1.92, -1.47, -0.17, 0.074]);

    /// The geometry with the paper's eight parameters: positions (x1, y1, x2, y2) in mm, skews (1, 2) in
    /// degrees, distortions W (1, 2).
    #[must_use]
    pub const fn paper_like(p: [f64; 8]) -> Self {
        const fn camera(x: f64, y: f64, skew_deg: f64, w: f64) -> CameraModel {
            CameraModel {
                position: Point2::new(x, y),
                aim: Point2::new(10.0, 2.0),
                skew_deg,
                lens: LensModel::Exponential {
                    half_fov_deg: 60.0,
                    w,
                },
            }
        }
        Self {
            cameras: [
                camera(p[0], p[1], p[4], p[6]),
                camera(p[2], p[3], p[5], p[7]),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn angles_match_the_published_ones() {
        let [one, two] = StereoGeometry::PAPER.cameras;
        assert!((one.angle_of_column_deg(480.0) - 30.741_512_001).abs() < 1e-8);
        assert!((two.angle_of_column_deg(362.0) - 6.328_884_298).abs() < 1e-8);
        assert!((one.angle_of_column_deg(120.0) + 43.623_745_002).abs() < 1e-8);
    }

    proptest! {
        #[test]
        fn column_and_point_agree(u in 0.0f64..=640.0, range in 1.0f64..90.0, second in any::<bool>()) {
            let camera = StereoGeometry::PAPER.cameras[usize::from(second)];
            let [dx, dy] = camera.direction(camera.angle_of_column_deg(u));
            let p = Point2::new(camera.position.x_mm + range * dx, camera.position.y_mm + range * dy);
            let back = camera.column_of_point(p);
            prop_assume!((1e-6..=640.0 - 1e-6).contains(&u));
            prop_assert!((back.unwrap() - u).abs() < 1e-8);
        }
    }
}
