//! Statistics of a decoder.

use skinrig_model::{SENSOR_HEIGHT, SENSOR_WIDTH};

/// Pixels of a sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Geometry {
    /// Columns.
    pub width: u16,
    /// Rows.
    pub height: u16,
}

impl Geometry {
    /// 640 x 480: EVK1 Gen3.1.
    pub const EVK1: Self = Self {
        width: SENSOR_WIDTH,
        height: SENSOR_HEIGHT,
    };
    /// Every coordinate that the formats can express (11 bits each).
    pub const ANY: Self = Self {
        width: 2048,
        height: 2048,
    };

    /// True if the pixel exists.
    #[must_use]
    pub const fn contains(self, x: u16, y: u16) -> bool {
        x < self.width && y < self.height
    }
}

/// A step of a stream's time base that is neither progress nor a wrap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Discontinuity {
    /// Time base before the step, µs.
    pub from_us: u64,
    /// Time base after it, µs.
    pub to_us: u64,
}

/// Statistics of a decoder since the start of a stream. They cover every word and every event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StreamStats {
    /// Delivered CD events of polarity ON.
    pub cd_on: u64,
    /// Delivered CD events of polarity OFF.
    pub cd_off: u64,
    /// Delivered trigger edges by channel.
    pub triggers: [u64; 32],
    /// Time base words (TIME_HIGH).
    pub time_high: u64,
    /// Lower time words (EVT3 TIME_LOW).
    pub time_low: u64,
    /// Address words that carry no event (EVT3 ADDR_Y and VECT_BASE_X).
    pub address: u64,
    /// Monitoring words (OTHER) and the words that continue them.
    pub monitoring: u64,
    /// Skipped words, by their type code: inertial data, codes without a meaning for a single CD
    /// sensor, and continuations without a beginning.
    pub skipped: [u64; 16],
    /// Events and triggers before the first time base word, of the stream and after each loss.
    pub dropped_before_time: u64,
    /// EVT3 events without a known row or vector base.
    pub dropped_before_address: u64,
    /// Steps of the time base that are neither progress nor a wrap.
    pub discontinuities: u64,
    /// Wraps of the time base.
    pub wraps: u64,
    /// CD events outside the sensor; not delivered.
    pub out_of_geometry: u64,
    /// EVT2.1 vectors whose first column is no multiple of 32, which no sensor sends (Prophesee, EVT 2.1 format). Their events count.
    pub unaligned: u64,
    /// Bytes that do not form a whole word: at the end, and on both sides of a loss.
    pub trailing_bytes: u64,
}

impl StreamStats {
    /// Delivered CD events.
    #[must_use]
    pub const fn cd_events(&self) -> u64 {
        self.cd_on + self.cd_off
    }

    /// Delivered trigger edges on all channels.
    #[must_use]
    pub fn trigger_edges(&self) -> u64 {
        self.triggers.iter().sum()
    }

    /// Skipped words of all type codes.
    #[must_use]
    pub fn skipped_words(&self) -> u64 {
        self.skipped.iter().sum()
    }
}
