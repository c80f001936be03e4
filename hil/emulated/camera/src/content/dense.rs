//! A fixed pattern at a fixed rate, copied instead of generated, for rates at which generating events would be too slow.

use skinrig_formats::evt2::TIME_HIGH_CADENCE_US;
use skinrig_model::{SENSOR_HEIGHT, SENSOR_WIDTH};

use skinrig_sim::scene::PixelEvent;

use crate::random::Splitmix;

/// Random pixels in the pattern, a power of two.
const PATTERN: usize = 1 << 13;

pub(crate) struct DenseContent {
    /// EVT2 words without their time.
    words: Vec<u32>,
    next: usize,
    per_slot: f64,
    /// Number of due events, including a fraction.
    due: f64,
}

impl DenseContent {
    pub(crate) fn new(mev_per_s: f64) -> Self {
        let mut random = Splitmix(1);
        let words = (0..PATTERN)
            .map(|_| {
                let x = random.below(SENSOR_WIDTH.into()) as u32;
                let y = random.below(SENSOR_HEIGHT.into()) as u32;
                let on = (random.next() >> 63) as u32;
                on << 28 | x << 11 | y
            })
            .collect();
        Self {
            words,
            next: 0,
            per_slot: mev_per_s * TIME_HIGH_CADENCE_US as f64,
            due: 0.0,
        }
    }

    /// Words of the 16 µs from `slot_us` on, evenly spaced.
    pub(crate) fn slot(&mut self, slot_us: u64, bytes: &mut Vec<u8>) {
        self.due += self.per_slot;
        let count = self.due as usize;
        self.due -= count as f64;
        let low = slot_us as u32 & 0x3f;
        // Time within the slot in 1/2^16 µs, so that the loop has no division.
        let step = ((TIME_HIGH_CADENCE_US as u32) << 16) / count.max(1) as u32;
        let start = bytes.len();
        bytes.resize(start + count * 4, 0);
        for (k, to) in bytes[start..].chunks_exact_mut(4).enumerate() {
            let t = low + ((k as u32 * step) >> 16);
            let word = self.words[(self.next + k) % PATTERN] | t << 22;
            to.copy_from_slice(&word.to_le_bytes());
        }
        self.next = (self.next + count) % PATTERN;
    }

    /// The same rate as single events, for when the registers filter some of them.
    pub(crate) fn events(&mut self, from_ns: i64, until_ns: i64, out: &mut Vec<PixelEvent>) {
        let slots = (until_ns - from_ns) as f64 / (TIME_HIGH_CADENCE_US as f64 * 1e3);
        self.due += self.per_slot * slots;
        let count = self.due as i64;
        self.due -= count as f64;
        for k in 0..count {
            let word = self.words[self.next];
            self.next = (self.next + 1) % PATTERN;
            out.push(PixelEvent {
                t_ns: from_ns + (until_ns - from_ns) * k / count,
                x: (word >> 11 & 0x7ff) as u16,
                y: (word & 0x7ff) as u16,
                polarity: skinrig_model::Polarity::from_bit(word >> 28 == 1),
            });
        }
    }
}
