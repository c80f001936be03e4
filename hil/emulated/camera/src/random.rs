//! Pseudo-random numbers.

use skinrig_model::{Polarity, SENSOR_HEIGHT, SENSOR_WIDTH};
use skinrig_sim::scene::PixelEvent;

/// A small generator of pseudo-random numbers (Steele, Lea, Flood: Fast splittable pseudorandom number generators,
/// 2014). Good enough for noise and jitter, and the same everywhere.
pub(crate) struct Splitmix(pub u64);

impl Splitmix {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// 0..`end`; `end` is not 0.
    pub(crate) fn below(&mut self, end: u64) -> u64 {
        ((u128::from(self.next()) * u128::from(end)) >> 64) as u64
    }

    /// Exponentially distributed with mean 1.
    pub(crate) fn exponential(&mut self) -> f64 {
        // In (0, 1], so that the logarithm is finite.
        let unit = ((self.next() >> 11) + 1) as f64 / (1u64 << 53) as f64;
        -libm::log(unit)
    }

    pub(crate) fn event(&mut self, t_ns: i64) -> PixelEvent {
        PixelEvent {
            t_ns,
            x: self.below(SENSOR_WIDTH.into()) as u16,
            y: self.below(SENSOR_HEIGHT.into()) as u16,
            polarity: Polarity::from_bit(self.next() >> 63 == 1),
        }
    }
}
