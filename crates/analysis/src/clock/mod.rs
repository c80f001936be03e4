//! Camera clocks: the map from host time to a camera's clock, and its certainty.

mod activity;
mod bursts;
mod correlate;
mod error;
pub(crate) mod line;
mod marks;
mod presses;
mod refine;
mod search;
mod shifts;
mod span;
mod tally;

pub use error::{LineError, MarksError, RatesError};
pub use line::{Line, Pair, fit as fit_line};
pub use marks::{MarksFit, fit_marks};
pub use presses::{RatesAlignment, RatesFit, align_by_rates, fit_rates};
pub use span::PressSpan;

use skinrig_model::HostTime;

use crate::result::ClockFit;

/// Camera times from 2^62 µs (146 000 years) come from a broken time base; no clock is fitted, because windows around them
/// would exceed 64 bits.
const NO_TIME_US: u64 = 1 << 62;
/// A line with a larger drift is not a clock.
pub(crate) const NO_CLOCK_DRIFT: f64 = 0.01;

impl ClockFit {
    /// Camera time (µs) of a host time.
    #[must_use]
    pub fn camera_us_of_host(&self, t: HostTime) -> f64 {
        self.camera_us(t.0 as f64 * 1e-3)
    }

    /// Camera time (µs) of a host time in µs.
    #[must_use]
    pub fn camera_us(&self, host_us: f64) -> f64 {
        // The small term is separate, so that the sum keeps the digits of the drift at large times.
        self.offset_us + host_us + self.drift_ppm * 1e-6 * host_us
    }

    /// Host time (µs) of a camera time in µs.
    #[must_use]
    pub fn host_us_of_camera(&self, camera_us: f64) -> f64 {
        (camera_us - self.offset_us) / (1.0 + self.drift_ppm * 1e-6)
    }
}
