//! Statistics of a camera's events that the field publishes: law of the intervals of a pixel, equal timestamps, refractory
//! floor, polarity, support by neighbours.

use skinrig_model::{CameraId, CdEvent};

mod counter;
mod presses;
#[cfg(test)]
mod tests;
mod values;

pub use self::presses::{PressCourse, PressPolarity, PressStatistics, PressStatisticsCollector};
pub use self::values::{Bin, EventStatistics, IntervalLaw, Ring};

use self::counter::Counter;

/// Collects the statistics of one camera.
#[derive(Debug)]
pub struct EventStatisticsCollector(Counter);

impl EventStatisticsCollector {
    /// No events yet. `presses`: contact and lift of each press on the clock of the camera, µs, in order; empty if they are not
    /// known.
    #[must_use]
    pub fn new(presses: &[(f64, f64)]) -> Self {
        Self(Counter::new(presses))
    }

    /// Counts the next events, nearly in order of time. Those outside the sensor do not count.
    pub fn push(&mut self, events: &[CdEvent]) {
        for event in events {
            self.0.add(event);
        }
    }

    /// The statistics.
    #[must_use]
    pub fn finish(&self, camera: CameraId) -> EventStatistics {
        self.0.statistics(camera)
    }
}
