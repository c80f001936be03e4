//! The time base of an EVT2 stream: its start and its jumps.

use skinrig_model::HostTime;

use crate::inbox::WORD;

/// Words examined together when searching for a rare word.
const GROUP: usize = 16;
/// Number of TIME_HIGH values.
const RANGE: u32 = 1 << 28;
/// Duration of one TIME_HIGH count, µs.
const COUNT_US: u64 = 64;

/// The counter of a TIME_HIGH word; `None` for other words.
fn time_high(word: [u8; WORD]) -> Option<u32> {
    let w = u32::from_le_bytes(word);
    (w >> 28 == 8).then_some(w & (RANGE - 1))
}

/// Holds back data without a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Gate {
    /// Until the first TIME_HIGH word: at a start, and after a loss, where events would otherwise get a time from before the loss.
    AwaitTime,
    /// Until the first TIME_HIGH word that differs from the first one. A Gen3.1 slave streams immediately, with a constant time of 0 until
    /// the master's clock arrives.
    AwaitAdvance {
        /// The constant counter.
        standing: Option<u32>,
    },
    /// Passes everything.
    Open,
}

impl Gate {
    /// Returns the number of leading bytes to hold back; opens at the first valid time.
    pub fn pass(&mut self, bytes: &[u8]) -> usize {
        if *self == Self::Open {
            return 0;
        }
        for (n, word) in bytes.as_chunks::<WORD>().0.iter().enumerate() {
            let Some(high) = time_high(*word) else {
                continue;
            };
            match self {
                Self::AwaitAdvance { standing: None } => {
                    *self = Self::AwaitAdvance {
                        standing: Some(high),
                    };
                }
                Self::AwaitAdvance { standing } if *standing == Some(high) => {}
                _ => {
                    *self = Self::Open;
                    return n * WORD;
                }
            }
        }
        bytes.len()
    }
}

/// A time base step of more than one count, or backward.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeJump {
    /// Time base before the step, µs, as sent (34 bits).
    pub from_us: u64,
    /// Time base after it, µs, as sent.
    pub to_us: u64,
    /// Arrival of its bytes.
    pub arrived: HostTime,
}

impl TimeJump {
    /// Whether this is a backward step that is not a wrap.
    #[must_use]
    pub const fn backwards(self) -> bool {
        let range_us = RANGE as u64 * COUNT_US;
        (self.to_us.wrapping_sub(self.from_us)) % range_us > range_us / 2
    }
}

/// Checks the time base, which must advance in steps of 0 or 1.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct TimeBaseMonitor {
    last: Option<u32>,
}

impl TimeBaseMonitor {
    /// Resets the state: at a start, and after a loss.
    pub fn reset(&mut self) {
        self.last = None;
    }

    /// Byte position of the first step of more than `most_us`, or backward, in these whole words. Does not change the state.
    #[must_use]
    pub fn gap(&self, bytes: &[u8], most_us: u64) -> Option<usize> {
        let mut last = self.last;
        for (n, word) in bytes.as_chunks::<WORD>().0.iter().enumerate() {
            let Some(high) = time_high(*word) else {
                continue;
            };
            let step = last.map_or(0, |last| high.wrapping_sub(last) % RANGE);
            if step > 1 && u64::from(step) * COUNT_US > most_us {
                return Some(n * WORD);
            }
            last = Some(high);
        }
        None
    }

    /// Examines whole words received at `arrived`, and reports jumps.
    pub fn scan(&mut self, bytes: &[u8], arrived: HostTime, mut on_jump: impl FnMut(TimeJump)) {
        let (words, _) = bytes.as_chunks::<WORD>();
        for group in words.chunks(GROUP) {
            let any = group.iter().fold(0, |any, w| any | u32::from_le_bytes(*w));
            if any >> 31 == 0 {
                continue;
            }
            for high in group.iter().filter_map(|w| time_high(*w)) {
                if let Some(last) = self.last
                    && high.wrapping_sub(last) % RANGE > 1
                {
                    on_jump(TimeJump {
                        from_us: u64::from(last) * COUNT_US,
                        to_us: u64::from(high) * COUNT_US,
                        arrived,
                    });
                }
                self.last = Some(high);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(words: &[u32]) -> Vec<u8> {
        words.iter().flat_map(|w| w.to_le_bytes()).collect()
    }

    fn high(count: u32) -> u32 {
        0x8000_0000 | count
    }

    const CD: u32 = 0x1240_5014;

    #[test]
    fn words_before_the_first_time_are_held_back() {
        let mut gate = Gate::AwaitTime;
        assert_eq!(gate.pass(&bytes(&[CD, 0xa240_0001])), 8);
        assert_eq!(gate.pass(&bytes(&[CD, high(0), CD])), 4);
        assert_eq!(gate.pass(&bytes(&[CD])), 0);
    }

    #[test]
    fn a_slave_is_held_back_until_its_time_advances() {
        let mut gate = Gate::AwaitAdvance { standing: None };
        assert_eq!(gate.pass(&bytes(&[CD, high(0), CD, high(0)])), 16);
        assert_eq!(gate.pass(&bytes(&[high(0), CD, high(1), CD])), 8);
        assert_eq!(gate, Gate::Open);
    }

    #[test]
    fn jumps_differ_from_progress_and_wraps() {
        let mut watch = TimeBaseMonitor::default();
        let mut jumps = Vec::new();
        let mut stream = vec![high(RANGE - 1), high(RANGE - 1), high(0), high(1)];
        stream.extend([CD; 40]);
        stream.extend([high(3), high(2), high(3)]);
        // The result must not depend on how the stream is cut.
        for word in stream {
            watch.scan(&bytes(&[word]), HostTime(7), |j| jumps.push(j));
        }
        let us: Vec<_> = jumps
            .iter()
            .map(|j| (j.from_us, j.to_us, j.backwards()))
            .collect();
        assert_eq!(us, [(64, 192, false), (192, 128, true)]);
        watch.reset();
        watch.scan(&bytes(&[high(100)]), HostTime(8), |j| panic!("{j:?}"));
    }
}
