//! Sensor columns of a contact: the footprint of the flat tip, projected point by point.

use skinrig_model::{CameraModel, Point2, SENSOR_WIDTH};

/// Points per side of the footprint.
const SIDE: usize = 24;
/// Number of column borders in the lens table.
const BORDERS: usize = SENSOR_WIDTH as usize + 1;

/// The lens as a table: viewing angle at each column border, degrees, including skew.
#[derive(Debug, Clone)]
pub(crate) struct ColumnTable {
    camera: CameraModel,
    angles: Vec<f64>,
}

impl ColumnTable {
    /// Table of `camera`.
    #[must_use]
    pub(crate) fn new(camera: CameraModel) -> Self {
        let angles = (0..BORDERS)
            .map(|u| camera.angle_of_column_deg(u as f64))
            .collect();
        Self { camera, angles }
    }

    /// Fractional column of `p`, linear between borders (within 1e-3 px of the exact inverse); `None` outside the field of view.
    #[must_use]
    pub(crate) fn column(&self, p: Point2) -> Option<f64> {
        let angle = self.camera.angle_of_point_deg(p);
        let above = self.angles.partition_point(|&a| a <= angle);
        if above == 0 || above >= BORDERS {
            return None;
        }
        let (low, high) = (self.angles[above - 1], self.angles[above]);
        Some((above - 1) as f64 + (angle - low) / (high - low))
    }

    /// Columns of the points of a square of `side_mm` around `centre`; NaN outside the field of view.
    #[must_use]
    pub(crate) fn footprint(&self, centre: Point2, side_mm: f64) -> Vec<f64> {
        let at = |k: usize| ((k as f64 + 0.5) / SIDE as f64 - 0.5) * side_mm;
        let mut columns = Vec::with_capacity(SIDE * SIDE);
        for i in 0..SIDE {
            for j in 0..SIDE {
                let p = Point2::new(centre.x_mm + at(i), centre.y_mm + at(j));
                columns.push(self.column(p).unwrap_or(f64::NAN));
            }
        }
        columns
    }

    /// Columns per mm perpendicular to the line of sight at `p`; 0 outside the field of view.
    #[must_use]
    pub(crate) fn columns_per_mm(&self, p: Point2) -> f64 {
        let Some(u) = self.column(p) else { return 0.0 };
        let k = (u as usize).min(BORDERS - 2);
        let per_radian = 1.0 / (self.angles[k + 1] - self.angles[k]).to_radians();
        per_radian / self.camera.position.distance_mm(p).max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::StereoGeometry;

    #[test]
    fn table_agrees_with_the_exact_inverse() {
        for camera in StereoGeometry::PAPER.cameras {
            let table = ColumnTable::new(camera);
            for k in 0..400 {
                let p = Point2::new(
                    -38.0 + 0.2 * f64::from(k),
                    50.0 - 0.25 * f64::from(k * 7 % 397),
                );
                match (table.column(p), camera.column_of_point(p)) {
                    (Some(a), Some(b)) => assert!((a - b).abs() < 1e-3, "{a} {b}"),
                    (a, b) => assert_eq!(a.is_some(), b.is_some(), "{p:?}"),
                }
            }
        }
    }
}
