//! Readings of a camera for a press, measured and expected at a position: the direction of the press, by the geometry; or
//! the column itself, by a polynomial that needs no geometry.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use skinrig_model::{CameraModel, Point2, SENSOR_WIDTH, StereoGeometry};

use super::robust::{scale, weight};
use crate::calibrate::{PARAMETERS, SPREAD, parameters_of, with_parameters};
use crate::sets::CalibrationPress;

/// Coefficients of 1, x, y, x², xy, y².
pub(super) const TERMS: usize = 6;
/// Reweighted fits of a polynomial.
const REWEIGHTINGS: usize = 20;
/// Step of derivatives by the parameters, in units of their [`SPREAD`].
const STEP: f64 = 1e-5;

/// How readings follow from columns and positions.
#[derive(Debug, Clone)]
pub(super) enum Reading {
    /// Directions, degrees; with the covariance of the parameters of the geometry.
    Bearing {
        geometry: StereoGeometry,
        covariance: Option<DMatrix<f64>>,
        /// Covariance that remains after a remount and is not part of the fields.
        remount: Option<DMatrix<f64>>,
    },
    /// Columns, px: one polynomial per camera in mm.
    Column([[f64; TERMS]; 2]),
}

impl Reading {
    /// The reading of a column, and its change per column.
    pub(super) fn of_column(&self, k: usize, column: f64) -> (f64, f64) {
        match self {
            Self::Bearing { geometry, .. } => {
                let camera = &geometry.cameras[k];
                let half = f64::from(SENSOR_WIDTH) / 2.0;
                let (_, by_s) = camera.lens.angle_deg((column - half) / half);
                (camera.angle_of_column_deg(column), by_s / half)
            }
            Self::Column(_) => (column, 1.0),
        }
    }

    /// The reading expected at a position, and its change per mm.
    pub(super) fn expected(&self, k: usize, at: [f64; 2]) -> (f64, [f64; 2]) {
        match self {
            Self::Bearing { geometry, .. } => bearing(&geometry.cameras[k], at),
            Self::Column(polynomials) => {
                let [c, cx, cy, cxx, cxy, cyy] = polynomials[k];
                let [x, y] = at;
                let value = c + cx * x + cy * y + cxx * x * x + cxy * x * y + cyy * y * y;
                let by = [cx + 2.0 * cxx * x + cxy * y, cy + cxy * x + 2.0 * cyy * y];
                (value, by)
            }
        }
    }

    /// Change of reading minus expected reading by the parameters of the geometry.
    fn slopes(geometry: &StereoGeometry, k: usize, at: [f64; 2], column: f64) -> DVector<f64> {
        let own = parameters_of(geometry);
        let off = |p: usize, by: f64| {
            let mut moved = own;
            moved[p] += by;
            let camera = &with_parameters(geometry, &moved).cameras[k];
            camera.angle_of_column_deg(column) - bearing(camera, at).0
        };
        DVector::from_fn(PARAMETERS, |p, _| {
            let step = STEP * SPREAD[p];
            (off(p, step) - off(p, -step)) / (2.0 * step)
        })
    }

    /// Column of a press minus the one expected where it was made, px.
    pub(super) fn residual(&self, k: usize, press: &CalibrationPress) -> f64 {
        let (value, slope) = self.of_column(k, press.columns[k]);
        let at = [press.truth.x_mm, press.truth.y_mm];
        (value - self.expected(k, at).0) / slope
    }

    /// Variance of reading minus expected reading from the parameters of the geometry: those that fields correct, and those of
    /// a remount.
    pub(super) fn parameter_variances(&self, k: usize, at: [f64; 2], column: f64) -> [f64; 2] {
        let Self::Bearing {
            geometry,
            covariance,
            remount,
        } = self
        else {
            return [0.0; 2];
        };
        let both = [covariance, remount];
        if both.iter().all(|c| c.is_none()) {
            return [0.0; 2];
        }
        let slope = Self::slopes(geometry, k, at, column);
        both.map(|c| {
            c.as_ref()
                .map_or(0.0, |c| slope.dot(&(c * &slope)).max(0.0))
        })
    }
}

/// Direction of a position, degrees clockwise from the axis of a camera, and its change per mm.
fn bearing(camera: &CameraModel, at: [f64; 2]) -> (f64, [f64; 2]) {
    let angle = camera.angle_of_point_deg(Point2::new(at[0], at[1]));
    let (dx, dy) = (at[0] - camera.position.x_mm, at[1] - camera.position.y_mm);
    let square = (dx * dx + dy * dy).max(f64::MIN_POSITIVE);
    (angle, [dy / square, -dx / square].map(f64::to_degrees))
}

/// Polynomials through the columns of `presses`, with little weight on outliers; `None` if the positions do not determine
/// them.
pub(super) fn polynomials(presses: &[CalibrationPress]) -> Option<[[f64; TERMS]; 2]> {
    let n = presses.len() as f64;
    let mean = |of: fn(&CalibrationPress) -> f64| presses.iter().map(of).sum::<f64>() / n;
    let centre = [mean(|p| p.truth.x_mm), mean(|p| p.truth.y_mm)];
    let off = |p: &CalibrationPress| [p.truth.x_mm - centre[0], p.truth.y_mm - centre[1]];
    let farthest = presses
        .iter()
        .map(|p| off(p).map(f64::abs))
        .fold(0.0, |m, [x, y]| x.max(y).max(m));
    if farthest.is_nan() || farthest <= 0.0 {
        return None;
    }
    let row = |p: &CalibrationPress| {
        let [x, y] = off(p).map(|v| v / farthest);
        SVector::<f64, TERMS>::from([1.0, x, y, x * x, x * y, y * y])
    };
    let fit = |k: usize| -> Option<[f64; TERMS]> {
        let mut weights = vec![1.0; presses.len()];
        let mut solution = SVector::<f64, TERMS>::zeros();
        for _ in 0..REWEIGHTINGS {
            let mut matrix = SMatrix::<f64, TERMS, TERMS>::zeros();
            let mut side = SVector::<f64, TERMS>::zeros();
            for (press, weight) in presses.iter().zip(&weights) {
                let row = row(press);
                matrix += row * row.transpose() * *weight;
                side += row * (press.columns[k] * weight);
            }
            let eigenvalues = matrix.symmetric_eigenvalues();
            // Positions on a line or a conic leave a coefficient open.
            if eigenvalues.min() <= 1e-9 * eigenvalues.max() {
                return None;
            }
            solution = matrix.cholesky()?.solve(&side);
            let residuals = presses.iter().map(|p| p.columns[k] - row(p).dot(&solution));
            let sigma = scale(residuals.clone());
            weights = residuals
                .map(|r| weight((r / sigma).powi(2), 1.0))
                .collect();
        }
        let finite = solution.iter().all(|v| v.is_finite());
        finite.then(|| uncentred(&solution, centre, farthest))
    };
    Some([fit(0)?, fit(1)?])
}

/// The same polynomial of x and y instead of (x - centre) / unit.
fn uncentred(of: &SVector<f64, TERMS>, [a, b]: [f64; 2], unit: f64) -> [f64; TERMS] {
    let [c, cx, cy] = [of[0], of[1] / unit, of[2] / unit];
    let [cxx, cxy, cyy] = [3, 4, 5].map(|i| of[i] / (unit * unit));
    [
        c - cx * a - cy * b + cxx * a * a + cxy * a * b + cyy * b * b,
        cx - 2.0 * cxx * a - cxy * b,
        cy - 2.0 * cyy * b - cxy * a,
        cxx,
        cxy,
        cyy,
    ]
}

#[cfg(test)]
mod tests {
    use skinrig_model::PressId;

    use super::*;

    fn slope_is_right(reading: &Reading) {
        for k in 0..2 {
            for at in [[10.0, 2.0], [-22.0, 30.0], [40.0, -11.0]] {
                let (_, by) = reading.expected(k, at);
                for axis in 0..2 {
                    let (mut left, mut right) = (at, at);
                    left[axis] -= 1e-4;
                    right[axis] += 1e-4;
                    let change = reading.expected(k, right).0 - reading.expected(k, left).0;
                    assert!((change / 2e-4 - by[axis]).abs() < 1e-6, "{k} {at:?}");
                }
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_values() {
        let geometry = StereoGeometry::paper_like([45.0, -36.0, 45.0, 40.0, 1.0, -2.0, 0.1, -0.1]);
        let reading = Reading::Bearing {
            geometry,
            covariance: None,
            remount: None,
        };
        slope_is_right(&reading);
        for column in [40.0, 320.0, 600.0] {
            let (_, by) = reading.of_column(1, column);
            let change =
                reading.of_column(1, column + 1e-4).0 - reading.of_column(1, column - 1e-4).0;
            assert!((change / 2e-4 - by).abs() < 1e-6, "{column}");
        }
        // The reading of a point is the expected one.
        let at = Point2::new(3.0, 4.0);
        let column = geometry.cameras[0].column_of_point(at).unwrap();
        let (read, _) = reading.of_column(0, column);
        assert!((read - reading.expected(0, [3.0, 4.0]).0).abs() < 1e-9);
        slope_is_right(&Reading::Column([[300.0, 2.0, -3.0, 0.01, 0.02, -0.03]; 2]));
    }

    #[test]
    fn a_polynomial_is_found_despite_outliers_and_not_on_a_line() {
        let planted = Reading::Column([
            [300.0, 2.0, -3.0, 0.01, 0.02, -0.03],
            [200.0, 1.0, 5.0, 0.0, 0.0, 0.01],
        ]);
        let press = |i: u32, at: [f64; 2]| CalibrationPress {
            press: PressId::from_index(i),
            location: i,
            repetition: 0,
            columns: [0, 1].map(|k| planted.expected(k, at).0 + if i == 17 { 200.0 } else { 0.0 }),
            spreads: [None; 2],
            truth: Point2::new(at[0], at[1]),
            cluster_events: 100,
        };
        let grid = |i: u32| {
            [
                -20.0 + 6.0 * f64::from(i % 7),
                30.0 - 5.0 * f64::from(i / 7),
            ]
        };
        let presses: Vec<_> = (0..49).map(|i| press(i, grid(i))).collect();
        let Reading::Column(column) = &planted else {
            return;
        };
        let found = polynomials(&presses).unwrap();
        for (found, column) in found.iter().flatten().zip(column.iter().flatten()) {
            assert!((found - column).abs() < 0.02, "{found} {column}");
        }
        let line: Vec<_> = (0..30)
            .map(|i| press(i, [f64::from(i), 2.0 * f64::from(i)]))
            .collect();
        assert_eq!(polynomials(&line), None);
        assert_eq!(polynomials(&vec![press(1, [3.0, 4.0]); 9]), None);
    }
}
