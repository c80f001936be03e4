//! Statistics of the events of one camera.

use serde::Serialize;
use skinrig_model::CameraId;

use super::presses::{PressCourse, PressPolarity};

/// Statistics of one camera; `None` where the recording has too few events.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EventStatistics {
    /// The camera.
    pub camera: CameraId,
    /// Events.
    pub events: u64,
    /// From the first to the last, s.
    pub duration_s: f64,
    /// Share of ON events.
    pub on_share: Option<f64>,
    /// Share of events with the timestamp of the event before.
    pub equal_times: Option<f64>,
    /// Share of events with one in the same or a neighbouring cell of 4 px in the millisecond before.
    pub supported: Option<f64>,
    /// The same for events at random pixels at random times, of the same number.
    pub supported_by_chance: Option<f64>,
    /// How often cells around an event had one in the millisecond before, nearest first.
    pub correlation: Vec<Ring>,
    /// The same for any cell at any time.
    pub correlation_by_chance: Option<f64>,
    /// Variance of the counts in 10 ms over their mean: 1 for independent events at a constant rate.
    pub dispersion: Option<f64>,
    /// Share of the sensor's pixels with an event.
    pub active_pixels: f64,
    /// Share of the events from the hundredth of the pixels that has most.
    pub hottest_share: Option<f64>,
    /// Pixels by their number of events, from 1 on, four bins an octave.
    pub pixels: Vec<Bin>,
    /// Law of the intervals.
    pub intervals: Option<IntervalLaw>,
    /// Intervals above 0 in µs, ten bins a decade.
    pub interval_bins: Vec<Bin>,
    /// Polarity at contacts and lifts.
    pub polarity: Option<PressPolarity>,
    /// Rates around contacts and lifts.
    pub course: Option<PressCourse>,
}

/// How many values lie from `from` to `to`, which is not in it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bin {
    /// Lower end.
    pub from: f64,
    /// Upper end.
    pub to: f64,
    /// Values.
    pub n: u64,
}

/// Cells of 4 px at a distance from that of an event.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ring {
    /// Distance along columns or rows, the larger one, px.
    pub distance_px: f64,
    /// Share of the cells with an event in the millisecond before, over a sixteenth of the events.
    pub active: f64,
}

/// Intervals between consecutive events of a pixel, all pixels together, fitted by maximum likelihood.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct IntervalLaw {
    /// Intervals above 0.
    pub n: u64,
    /// Intervals of 0 µs: a pixel twice in a microsecond.
    pub zero: u64,
    /// Interval below which one in a thousand lies, µs; `None` if it is above 65 ms.
    pub floor_us: Option<u32>,
    /// Mean, µs.
    pub mean_us: f64,
    /// Shape of the inverse Gaussian law, µs.
    pub shape_us: f64,
    /// Mean negative log-likelihood of the inverse Gaussian law, nats per interval.
    pub inverse_gaussian: f64,
    /// The same of the exponential law.
    pub exponential: f64,
}
