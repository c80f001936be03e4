//! Positions before any field: the intersection of two rays, or an affine map of the columns; and how well they are known.

use nalgebra::{DMatrix, Matrix3, Vector3};
use skinrig_model::StereoGeometry;

use crate::calibrate::StereoModel;
use crate::result::AffineModel;
use crate::sets::CalibrationPress;

/// Symmetric 2 x 2 matrix: xx, xy, yy.
pub(super) type Covariance = [f64; 3];

/// Reweighted fits of an affine map.
const REWEIGHTINGS: usize = 20;
/// Degrees of freedom of the weights of outliers.
pub(super) const FREEDOM: f64 = 4.0;
/// Median of the length of a standard normal 2-vector.
const RAYLEIGH_MEDIAN: f64 = 1.177_410_022_515_474_7;
/// Smallest robust standard deviation, mm.
pub(super) const LEAST_MM: f64 = 1e-3;

/// A position before the field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Anchor {
    /// Position, mm.
    pub at: [f64; 2],
    /// `J Jᵀ` of the derivative J by the columns, mm²/px².
    pub by_columns: Covariance,
    /// Covariance from the parameters, mm².
    pub from_parameters: Covariance,
}

/// From columns to positions.
#[derive(Debug, Clone)]
pub(super) enum Base {
    /// Intersection of the rays.
    Rays {
        stereo: Box<StereoModel>,
        covariance: Option<DMatrix<f64>>,
    },
    /// Affine map.
    Affine(AffineModel),
}

impl Base {
    pub(super) fn rays(geometry: &StereoGeometry, covariance: Option<DMatrix<f64>>) -> Self {
        Self::Rays {
            stereo: Box::new(StereoModel::of(geometry)),
            covariance,
        }
    }

    /// `None` if the rays do not meet in front of both cameras.
    pub(super) fn anchor(&self, columns: [f64; 2]) -> Option<Anchor> {
        match self {
            Self::Rays { stereo, covariance } => {
                let crossing = stereo.crossing(columns)?;
                let from_parameters = covariance.as_ref().map_or([0.0; 3], |c| {
                    let rows = crossing.by_parameter.map(|r| nalgebra::DVector::from_row_slice(&r));
                    let moved = c * &rows[1];
                    [
                        rows[0].dot(&(c * &rows[0])).max(0.0),
                        rows[0].dot(&moved),
                        rows[1].dot(&moved).max(0.0),
                    ]
                });
                Some(Anchor {
                    at: crossing.at,
                    by_columns: outer(crossing.by_column),
                    from_parameters,
                })
            }
            Self::Affine(map) => {
                let inputs = Vector3::new(1.0, columns[0], columns[1]);
                let at = map.rows.map(|r| Vector3::from(r).dot(&inputs));
                let covariance = Matrix3::from_fn(|i, j| map.covariance[i][j]);
                let variance = inputs.dot(&(covariance * inputs)).max(0.0);
                Some(Anchor {
                    at,
                    by_columns: outer(map.rows.map(|[_, a, b]| [a, b])),
                    from_parameters: [variance, 0.0, variance],
                })
            }
        }
    }
}

/// `J Jᵀ`.
fn outer(j: [[f64; 2]; 2]) -> Covariance {
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    [dot(j[0], j[0]), dot(j[0], j[1]), dot(j[1], j[1])]
}

/// The affine map through `presses`, with little weight on outliers; `None` if the columns lie on a line.
pub(super) fn affine(presses: &[CalibrationPress]) -> Option<AffineModel> {
    let n = presses.len() as f64;
    let mean = [0, 1].map(|k| presses.iter().map(|p| p.columns[k]).sum::<f64>() / n);
    let centred =
        |p: &CalibrationPress| Vector3::new(1.0, p.columns[0] - mean[0], p.columns[1] - mean[1]);
    let mut weights = vec![1.0; presses.len()];
    let mut solution = None;
    for _ in 0..REWEIGHTINGS {
        let (mut matrix, mut sides) = (Matrix3::zeros(), [Vector3::zeros(); 2]);
        for (press, weight) in presses.iter().zip(&weights) {
            let row = centred(press);
            matrix += row * row.transpose() * *weight;
            sides[0] += row * (press.truth.x_mm * weight);
            sides[1] += row * (press.truth.y_mm * weight);
        }
        let (uu, uv, vv) = (matrix[(1, 1)], matrix[(1, 2)], matrix[(2, 2)]);
        // One part in a million of the spread across a line is rounding or a repeated press.
        if uu * vv - uv * uv <= 1e-6 * uu * vv {
            return None;
        }
        let inverse = matrix.try_inverse()?;
        let rows = sides.map(|s| inverse * s);
        let squares: Vec<f64> = presses
            .iter()
            .map(|p| {
                let row = centred(p);
                let (dx, dy) = (
                    p.truth.x_mm - rows[0].dot(&row),
                    p.truth.y_mm - rows[1].dot(&row),
                );
                dx * dx + dy * dy
            })
            .collect();
        let sigma = robust_sigma(&squares);
        weights = squares.iter().map(|s| weight(s / (sigma * sigma))).collect();
        solution = Some((rows, inverse * (sigma * sigma)));
    }
    let (rows, covariance) = solution?;
    // Back from centred columns.
    let shift = Matrix3::new(1.0, -mean[0], -mean[1], 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let covariance = shift * covariance * shift.transpose();
    let rows = rows.map(|r| <[f64; 3]>::from(shift * r));
    let finite = rows.iter().flatten().chain(covariance.iter()).all(|v| v.is_finite());
    finite.then(|| AffineModel {
        rows,
        covariance: [0, 1, 2].map(|i| [0, 1, 2].map(|j| covariance[(i, j)])),
    })
}

/// Weight of a press with this squared error in units of its variance: 1 for small ones.
pub(super) fn weight(square: f64) -> f64 {
    ((FREEDOM + 2.0) / (FREEDOM + square)).min(1.0)
}

/// Robust standard deviation of one coordinate from squared lengths of vectors, mm; at least 1 µm.
pub(super) fn robust_sigma(squares: &[f64]) -> f64 {
    let mut sorted = squares.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    (median.sqrt() / RAYLEIGH_MEDIAN).max(LEAST_MM)
}
