//! Owns the result of estimating depth and force: errors, intervals, and how the skin returns to zero.

use serde::{Deserialize, Serialize};
use skinrig_model::PressId;

use super::Estimate;
use crate::with_text::with_text;

/// Depth and force of the presses, estimated from their events. Calibration presses teach, scored presses only score.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Indentation {
    /// Depth, mm; the reason if it could not be learnt.
    pub depth: Option<Quantity>,
    /// Why not.
    pub no_depth: Option<NoQuantity>,
    /// Mean force during the hold, N, as the robot reports it.
    pub force: Option<Quantity>,
    /// Why not.
    pub no_force: Option<NoQuantity>,
    /// Return to zero after the release; `None` if the presses follow each other too closely, or without depths.
    pub zero: Option<ZeroReturn>,
    /// Located presses, in plan order.
    pub presses: Vec<PressIndentation>,
}

impl Indentation {
    /// Of a press.
    #[must_use]
    pub fn of(&self, press: PressId) -> Option<&PressIndentation> {
        let found = self.presses.binary_search_by_key(&press, |p| p.press);
        found.ok().map(|i| &self.presses[i])
    }
}

/// Errors of a quantity in its unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// At the scored presses within what was taught.
    pub scored: QuantityErrors,
    /// At the calibration presses, each by a model that has not seen its location.
    pub left_out: QuantityErrors,
    /// Both by planned depth, shallowest first.
    pub depths: Vec<QuantityAtDepth>,
    /// Calibration presses that taught.
    pub taught_by: u32,
    /// Smallest and largest measurement that they taught.
    pub taught: [f64; 2],
    /// Scored presses that are left out: measured more than a tenth beyond those.
    pub beyond: u32,
}

impl Quantity {
    /// Share of the smallest and of the largest taught measurement by which a scored press may be beyond it: depths of equal
    /// presses scatter. Our choice.
    const EDGE: f64 = 0.1;

    /// True if presses of these measurements teach what this one is.
    pub(crate) fn teaches(taught: [f64; 2], measured: f64) -> bool {
        let [least, most] = taught;
        (least * (1.0 - Self::EDGE)..=most * (1.0 + Self::EDGE)).contains(&measured)
    }
}

/// Errors of a quantity in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct QuantityErrors {
    /// Root mean square error.
    pub rmse: Estimate,
    /// Mean error, estimate minus measurement.
    pub bias: Estimate,
    /// Root mean square of the error as a share of the measurement, percent.
    pub relative_percent: Estimate,
    /// Share of the 95 % intervals that hold the measurement.
    pub covered: Estimate,
}

/// Errors at one planned depth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct QuantityAtDepth {
    /// Planned depth, mm.
    pub depth_mm: f64,
    /// At the scored presses.
    pub scored: QuantityErrors,
    /// At left-out locations.
    pub left_out: QuantityErrors,
}

/// Why a quantity was not estimated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(remote = "Self", tag = "kind", rename_all = "snake_case")]
pub enum NoQuantity {
    /// The robot reports none.
    #[error("the session holds no measured force: only a robot that reports forces can teach them")]
    NotReported,
    /// Too few calibration locations.
    #[error("{found} calibration locations with measurements, {needed} needed")]
    FewLocations {
        /// Minimum.
        needed: u32,
        /// Calibration locations with measurements.
        found: u32,
    },
    /// The presses do not determine the regression.
    #[error("the calibration presses do not determine the regression")]
    Degenerate,
}

with_text!(NoQuantity);

/// How the image returns after the presses. Sizes are depths of the press whose change would be left, relative to the
/// calibration presses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ZeroReturn {
    /// Shortest time after a release behind it, in either camera, s.
    pub after_s: f64,
    /// Mean over the scored presses, mm: what is left in the direction of the press.
    pub mean_mm: Estimate,
    /// Root mean square over the scored presses, mm.
    pub rms_mm: Estimate,
    /// Change of the rest from the first to the last scored press, mm: a straight line in order of the plan.
    pub trend_mm: Option<f64>,
    /// True if mean or trend is beyond [`ZeroReturn::LIMIT_MM`] with its 95 % interval.
    pub drifts: bool,
}

impl ZeroReturn {
    /// Largest rest of a skin that returns to zero, mm.
    pub const LIMIT_MM: f64 = 0.05;
}

/// Estimates of one press.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PressIndentation {
    /// Press.
    pub press: PressId,
    /// Estimated depth, mm.
    pub depth_mm: Option<Ranged>,
    /// Estimated force, N.
    pub force_n: Option<Ranged>,
    /// Depth estimated by a model that has not seen the location, mm; calibration presses only.
    pub left_out_mm: Option<Ranged>,
    /// Measured depth, mm: mean over the hold.
    pub measured_mm: Option<f64>,
    /// Measured force, N: mean over the hold.
    pub measured_n: Option<f64>,
    /// What is left of the press in the end, mm; see [`ZeroReturn`].
    pub rest_mm: Option<f64>,
}

/// An estimate with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ranged {
    /// Value.
    pub value: f64,
    /// Ends of the interval; `None` if too few calibration presses determine it, or if the value is beyond what they taught.
    pub interval: Option<[f64; 2]>,
}
