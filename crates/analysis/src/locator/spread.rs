//! The spread of the events of a press in a camera as a reading: wide near the camera, narrow far from it.
//!
//! It is read on a logarithmic scale about a typical spread, where its scatter is about the same everywhere. Its field has no
//! trend: far from the calibration presses it says nothing.

use super::field::{Field, learn};
use super::likelihood::Logs;
use super::samples::samples;
use crate::result::SpreadField;
use crate::sets::CalibrationPress;

/// Fewest presses with a spread.
const FEWEST: usize = 12;

/// Reading of a spread, px: its logarithm about a typical one, in units of the typical one.
pub(super) fn reading(spread_px: f64, typical_px: f64) -> f64 {
    typical_px * libm::log(spread_px / typical_px)
}

/// A learnt field, with its hyperparameters.
type SpreadFit = (SpreadField, Logs);

/// Fields of the spreads along columns and rows, by camera; `None` if too few presses have them.
#[derive(Debug, Clone)]
pub(super) struct SpreadFits([Option<[SpreadFit; 2]>; 2]);

impl SpreadFits {
    /// Learns them from `presses`; `near`: fits to almost the same presses.
    pub(super) fn learn(presses: &[CalibrationPress], near: Option<&Self>) -> Self {
        let spread = |k: usize, axis: usize| {
            let near = near.and_then(|fits| fits.0[k].as_ref());
            learn_spread(presses, (k, axis), near.map(|fits| &fits[axis].1))
        };
        let camera = |k: usize| {
            let (columns, rows) = rayon::join(|| spread(k, 0), || spread(k, 1));
            columns.zip(rows).map(|(columns, rows)| [columns, rows])
        };
        let (one, two) = rayon::join(|| camera(0), || camera(1));
        Self([one, two])
    }

    /// The fields of camera `k`.
    pub(super) fn fields(&self, k: usize) -> Option<[SpreadField; 2]> {
        let fits = self.0[k].as_ref()?;
        Some(fits.each_ref().map(|(field, _)| field.clone()))
    }
}

/// Learns how the spread along an axis (0: columns, 1: rows) in camera `k` depends on the position; `None` if too few presses
/// have one.
fn learn_spread(
    presses: &[CalibrationPress],
    (k, axis): (usize, usize),
    near: Option<&Logs>,
) -> Option<SpreadFit> {
    let spread = |p: &CalibrationPress| p.spreads[k].map(|s| s[axis]);
    let mut all: Vec<f64> = presses.iter().filter_map(spread).collect();
    if all.len() < FEWEST {
        return None;
    }
    all.sort_unstable_by(f64::total_cmp);
    let typical_px = all[all.len() / 2];
    let samples = samples(presses, |p| Some(reading(spread(p)?, typical_px)));
    let (field, logs) = learn(&samples, near)?;
    Some((SpreadField { typical_px, field }, logs))
}

/// The spreads of one camera, ready to predict.
#[derive(Debug, Clone)]
pub(super) struct Spread {
    typical_px: f64,
    pub field: Field,
    /// Fixed variance and variance by events, px².
    pub scatter: [f64; 2],
}

impl Spread {
    /// `None` if the field contradicts itself.
    pub(super) fn new(model: &SpreadField) -> Option<Self> {
        let field = &model.field;
        Some(Self {
            typical_px: model.typical_px,
            scatter: [field.fixed_px, field.column_px].map(|s| s * s),
            field: Field::new(field)?,
        })
    }

    /// The reading of a spread, px.
    pub(super) fn reading(&self, spread_px: f64) -> f64 {
        reading(spread_px, self.typical_px)
    }
}
