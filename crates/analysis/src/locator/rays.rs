//! The intersection of two rays, and how well it is known.

use nalgebra::{DMatrix, DVector, SVector};
use skinrig_model::StereoGeometry;

use super::prediction::Covariance;
use super::quasi_newton::minimise;
use super::robust::{LEAST, reference_events, response, weight};
use crate::calibrate::StereoModel;
use crate::result::Scatter;
use crate::sets::CalibrationPress;

/// Standard deviation of the priors of both logarithms of the scatter.
const LOOSE: f64 = 2.0;
/// Steps of a descent, and the gain in log likelihood that ends it.
const STEPS: usize = 40;
const TOLERANCE: f64 = 1e-7;
/// Rounds of weights.
const ROUNDS: usize = 3;

/// Where two rays meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    /// Position, mm.
    pub at: [f64; 2],
    /// `J Jᵀ` of the derivative J by the columns, mm²/px².
    pub by_columns: Covariance,
    /// Covariance from the parameters, mm².
    pub from_parameters: Covariance,
}

/// A geometry, and what is known about its parameters.
#[derive(Debug, Clone)]
pub(super) struct Rays {
    stereo: StereoModel,
    covariance: Option<DMatrix<f64>>,
}

impl Rays {
    pub(super) fn new(geometry: &StereoGeometry, covariance: Option<DMatrix<f64>>) -> Self {
        Self {
            stereo: StereoModel::of(geometry),
            covariance,
        }
    }

    /// `None` if the rays do not meet in front of both cameras.
    pub(super) fn crossing(&self, columns: [f64; 2]) -> Option<Crossing> {
        let crossing = self.stereo.crossing(columns)?;
        let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        let [x, y] = crossing.by_column;
        let from_parameters = self.covariance.as_ref().map_or([0.0; 3], |c| {
            let rows = crossing.by_parameter.map(|r| DVector::from_row_slice(&r));
            let moved = c * &rows[1];
            [
                rows[0].dot(&(c * &rows[0])).max(0.0),
                rows[0].dot(&moved),
                rows[1].dot(&moved).max(0.0),
            ]
        });
        Some(Crossing {
            at: crossing.at,
            by_columns: [dot(x, x), dot(x, y), dot(y, y)],
            from_parameters,
        })
    }

    /// Scatter of the presses about their crossings, by maximum likelihood; little weight on outliers. The presses taught the geometry, so
    /// their errors are smaller by what its parameters fitted. `None` if no press has a crossing.
    pub(super) fn scatter(&self, presses: &[CalibrationPress]) -> Option<Scatter> {
        let reference = reference_events(presses);
        // Squared error, mm², and mean square of either coordinate per px².
        let rows: Vec<(f64, f64)> = presses
            .iter()
            .filter_map(|p| {
                let c = self.crossing(p.columns)?;
                let (dx, dy) = (p.truth.x_mm - c.at[0], p.truth.y_mm - c.at[1]);
                let per_px = 0.5 * (c.by_columns[0] + c.by_columns[2]);
                let fitted = c.from_parameters[0] + c.from_parameters[2];
                let row = (
                    dx * dx + dy * dy + fitted,
                    per_px * response(p.cluster_events, reference),
                );
                (row.0.is_finite() && row.1.is_finite()).then_some(row)
            })
            .collect();
        let median = |mut values: Vec<f64>| {
            values.sort_unstable_by(f64::total_cmp);
            values.get(values.len() / 2).copied()
        };
        let sigma = (median(rows.iter().map(|r| r.0).collect())?.sqrt() / 1.177_410_022_515_474_7)
            .max(LEAST);
        let typical = median(rows.iter().map(|r| r.1).collect())?.max(1e-12);
        let centre = SVector::from([
            libm::log(0.7 * sigma),
            libm::log(0.5 * sigma / typical.sqrt()),
        ]);
        let variance = |per_px: f64, logs: &SVector<f64, 2>| {
            let [fixed, column] = [logs[0], logs[1]].map(|l| libm::exp(2.0 * l));
            [
                fixed,
                column * per_px,
                fixed + column * per_px + LEAST * LEAST,
            ]
        };
        let mut weights: Vec<f64> = rows
            .iter()
            .map(|r| weight(r.0 / (sigma * sigma), 2.0))
            .collect();
        let mut logs = centre;
        for _ in 0..ROUNDS {
            let evaluate = |logs: &SVector<f64, 2>| {
                let off = (logs - centre) / LOOSE;
                let (mut value, mut by) = (0.5 * off.norm_squared(), off / LOOSE);
                for ((square, per_px), weight) in rows.iter().zip(&weights) {
                    let [fixed, column, all] = variance(*per_px, logs);
                    let square = weight * square / all;
                    value += libm::log(all) + 0.5 * square;
                    by[0] += (2.0 - square) * fixed / all;
                    by[1] += (2.0 - square) * column / all;
                }
                let finite = value.is_finite() && by.iter().all(|v| v.is_finite());
                finite.then_some((value, by))
            };
            logs = minimise(logs, STEPS, TOLERANCE, evaluate)?.0;
            let each = rows.iter();
            weights = each
                .map(|(s, per_px)| weight(s / variance(*per_px, &logs)[2], 2.0))
                .collect();
        }
        Some(Scatter {
            fixed_mm: libm::exp(logs[0]),
            column_px: libm::exp(logs[1]),
        })
    }
}
