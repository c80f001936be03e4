//! The measured tradeoff: one row per choice, with its error and costs.

use serde::{Deserialize, Serialize};
use skinrig_model::{AnalysisSettings, CalibrationModel, Locator};

use super::choice::Choice;
use super::predict::Predictions;
use crate::result::Estimate;

/// A cost to trade for accuracy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cost {
    /// CPU time per press.
    Cpu,
    /// Bytes per second.
    Bytes,
    /// Time from contact to the estimate.
    Delay,
    /// Pixels that are read, after cropping and binning.
    Pixels,
}

impl Cost {
    /// All costs.
    pub const ALL: [Self; 4] = [Self::Cpu, Self::Bytes, Self::Delay, Self::Pixels];

    /// Value of this cost in a row.
    #[must_use]
    pub const fn of(self, row: &Row) -> f64 {
        match self {
            Self::Cpu => row.cpu_us,
            Self::Bytes => row.bytes_per_s,
            Self::Delay => row.delay_ms,
            Self::Pixels => row.pixels as f64,
        }
    }
}

/// Measured tradeoff.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tradeoff {
    /// The session's settings.
    pub settings: AnalysisSettings,
    /// Calibration model of all choices: the one chosen in the session's analysis.
    pub model: CalibrationModel,
    /// Locator of all choices: likewise.
    pub locator: Locator,
    /// Calibration presses: used, and attempted in the session.
    pub calibrating: (u32, u32),
    /// Scored presses: used, and attempted in the session.
    pub scored: (u32, u32),
    /// Minimum located rate to compete.
    pub least_located: f64,
    /// Number of timed presses.
    pub timed_presses: u32,
    /// Timed runs per choice.
    pub repeats: u32,
    /// Mean length of a press with its margins, s: the time base of bytes per second.
    pub press_s: f64,
    /// One row per choice, the session's own first.
    pub rows: Vec<Row>,
    /// How they were found, and what was predicted of them.
    pub predictions: Predictions,
    /// True if the operator stopped before all choices of the plan were measured.
    pub is_interrupted: bool,
}

/// One choice with its results.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The choice.
    pub choice: Choice,
    /// Rows of each camera that are read, inclusive.
    pub rows: [(u16, u16); 2],
    /// Protocol settings that select it: (key, value) below `analysis` that differ from the session's.
    pub overrides: Vec<(String, String)>,
    /// RMSE of the counting presses, mm.
    pub rmse_mm: Estimate,
    /// RMSE with every failed press at the penalty.
    pub penalised_rmse_mm: Estimate,
    /// Share of the attempted presses that count; for all or none the interval is exact, see [`Estimate`].
    pub located_rate: Estimate,
    /// Share within `within_mm`; likewise.
    pub within_rate: Estimate,
    /// Events per press, both cameras.
    pub events_per_press: f64,
    /// Bytes per second of both cameras during a press.
    pub bytes_per_s: f64,
    /// Time from contact to the end of the window, ms.
    pub delay_ms: f64,
    /// Pixels of the camera that reads more: the sensor's columns by these rows, in bins.
    pub pixels: u32,
    /// CPU time from the events to the location, median over the repeats, µs per press.
    pub cpu_us: f64,
    /// Lowest and highest of the repeats, µs.
    pub cpu_range_us: (f64, f64),
    /// True if it locates enough presses.
    pub competes: bool,
    /// Costs on whose fronts it is.
    pub fronts: Vec<Cost>,
}
