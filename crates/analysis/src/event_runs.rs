//! Runs of events that identify a part of a recording by its content, wherever it is cut.

use std::collections::BTreeSet;

/// Events of a run.
pub const RUN: usize = 32;
/// Fewer pixels in a run are those of a hot pixel or a flicker, which other recordings have too.
const MIN_PIXELS: usize = 16;
/// Multiplier of the rolling hash; odd, so that no bit is lost.
const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
/// The power of it by which the oldest event of a run counts.
const OLDEST: u64 = FACTOR.wrapping_pow(RUN as u32);
/// Bits of a token that hold pixel and polarity.
const PIXEL: u64 = (1 << 33) - 1;

/// The token of an event for [`RollingRuns`]; `more` (31 bits) tells runs of the same pixels apart.
#[must_use]
pub fn token(event: &skinrig_model::CdEvent, more: u64) -> u64 {
    let on = event.polarity == skinrig_model::Polarity::On;
    u64::from(event.x) | u64::from(event.y) << 16 | u64::from(on) << 32 | more << 33
}

/// The last events of a stream, and their rolling hash.
#[derive(Debug, Clone)]
pub struct RollingRuns {
    last: [u64; RUN],
    mixed: [u64; RUN],
    events: usize,
    hash: u64,
    one_in: u64,
}

impl RollingRuns {
    /// Selects one run in `one_in`, by its content: cutting a recording does not change which.
    #[must_use]
    pub const fn new(one_in: u64) -> Self {
        Self {
            last: [0; RUN],
            mixed: [0; RUN],
            events: 0,
            hash: 0,
            one_in,
        }
    }

    /// From now on selects one run in `one_in`: of those that it selected before, if `one_in` is a multiple of the number before.
    pub(crate) const fn select_one_in(&mut self, one_in: u64) {
        self.one_in = one_in;
    }

    /// Hash of the run that ends with the event of this token, if it is selected.
    pub fn push(&mut self, token: u64) -> Option<u64> {
        let at = self.events % RUN;
        let newest = mixed(token);
        let oldest = std::mem::replace(&mut self.mixed[at], newest);
        self.last[at] = token;
        self.events += 1;
        self.hash = self.hash.wrapping_mul(FACTOR).wrapping_add(newest);
        if self.events > RUN {
            self.hash = self.hash.wrapping_sub(oldest.wrapping_mul(OLDEST));
        }
        let hash = mixed(self.hash);
        let is_selected =
            self.events >= RUN && hash.is_multiple_of(self.one_in) && self.pixels() >= MIN_PIXELS;
        is_selected.then_some(hash)
    }

    fn pixels(&self) -> usize {
        let pixels = self.last.iter().map(|token| token & PIXEL);
        pixels.collect::<BTreeSet<_>>().len()
    }
}

/// Finaliser of `SplitMix64` (Steele, Lea and Flood 2014).
const fn mixed(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
