//! EVT2: 32-bit words; what an EVK1 Gen3.1 sends.
//!
//! Layout (EVK1 reference, section 4.1; Prophesee's published EVT 2.0 format): type in bits 31:28. CD_OFF 0x0
//! and CD_ON 0x1 carry t\[5:0\] in 27:22, x in 21:11, y in 10:0. TIME_HIGH 0x8 carries t\[33:6\]. EXT_TRIGGER
//! 0xA carries t\[5:0\], channel 12:8, edge 0. OTHER 0xE with CONTINUED 0xF carry monitoring values. The 34
//! bits of time wrap every 17 179.869184 s.

use skinrig_model::{CdEvent, Polarity, TriggerEdge};

pub use super::evt2_encode::{Encoder, TIME_HIGH_CADENCE_US};

use super::clock::TimeBase;
use super::output::{BLOCK, Output};
use super::sink::{EventSink, Monitoring};

/// Length of the time base counter, bits; its unit is 64 µs.
pub const TIME_HIGH_BITS: u32 = 28;
/// Range of the stream's time, µs.
pub const RANGE_US: u64 = 1 << 34;

/// CD words that are handled at once.
const GROUP: usize = 8;

/// True for a CD word of a pixel of the sensor.
#[inline]
fn is_cd_within(w: u32, (width, height): (u16, u16)) -> bool {
    (w >> 29 == 0) & ((w >> 11 & 0x7ff) < u32::from(width)) & ((w & 0x7ff) < u32::from(height))
}

/// A run of plain words, on its way through the fast loop.
struct Run {
    epoch_us: u64,
    base_us: u64,
    high: u32,
    events: usize,
    on: u64,
}

impl Run {
    #[inline]
    fn event(&self, w: u32) -> CdEvent {
        CdEvent {
            t_us: self.base_us + u64::from(w >> 22 & 0x3f),
            x: (w >> 11 & 0x7ff) as u16,
            y: (w & 0x7ff) as u16,
            polarity: Polarity::from_bit(w >> 28 & 1 == 1),
        }
    }

    /// Takes CD words of one time base.
    #[inline]
    fn group<const KEEP: bool>(&mut self, group: &[u32; GROUP], buffer: &mut [CdEvent; BLOCK]) {
        if KEEP && let Some(out) = buffer[self.events..].first_chunk_mut::<GROUP>() {
            for (out, w) in out.iter_mut().zip(group) {
                *out = self.event(*w);
            }
        }
        self.on += u64::from(group.iter().map(|w| w >> 28).sum::<u32>());
        self.events += GROUP;
    }

    /// Takes one word if it is plain.
    #[inline]
    fn word<const KEEP: bool>(
        &mut self,
        w: u32,
        limits: (u16, u16),
        buffer: &mut [CdEvent; BLOCK],
    ) -> bool {
        if is_cd_within(w, limits) {
            if KEEP {
                buffer[self.events] = self.event(w);
            }
            self.events += 1;
            self.on += u64::from(w >> 28);
            return true;
        }
        let high = w & 0x0fff_ffff;
        let progress = high.wrapping_sub(self.high) <= TimeBase::<TIME_HIGH_BITS, 6>::HALF;
        if w >> 28 == 8 && progress {
            self.high = high;
            self.base_us = self.epoch_us + (u64::from(high) << 6);
            return true;
        }
        false
    }
}

/// State of an EVT2 stream between two words.
#[derive(Debug, Clone, Default)]
pub(super) struct Words {
    base: TimeBase<TIME_HIGH_BITS, 6>,
    /// Time and subtype of an OTHER word whose first CONTINUED word is still to come.
    other: Option<(u64, u16)>,
}

impl Words {
    /// Decodes whole words.
    pub fn run<const KEEP: bool>(
        &mut self,
        mut bytes: &[u8],
        output: &mut Output,
        sink: &mut impl EventSink,
    ) {
        while !bytes.is_empty() {
            output.flush(sink);
            if self.base.known() {
                let used = self.plain_words::<KEEP>(bytes, output);
                bytes = &bytes[used..];
                if used == BLOCK * 4 {
                    continue;
                }
            }
            // The input is at its end, or the next word is not plain.
            let Some((word, rest)) = bytes.split_first_chunk() else {
                return;
            };
            self.word::<KEEP>(u32::from_le_bytes(*word), output, sink);
            bytes = rest;
        }
    }

    /// Decodes a run of at most [`BLOCK`] plain words into the empty buffer and returns the bytes used.
    ///
    /// Plain are CD events on the sensor and ordinary progress of the time base: nearly everything a camera
    /// sends. Eight CD events in a row, the usual case, are checked at once and written without a branch.
    fn plain_words<const KEEP: bool>(&mut self, bytes: &[u8], output: &mut Output) -> usize {
        let bytes = &bytes[..bytes.len().min(BLOCK * 4)];
        let limits = (output.geometry.width, output.geometry.height);
        let mut run = Run {
            epoch_us: self.base.epoch_us(),
            base_us: self.base.base_us(),
            high: self.base.high(),
            events: 0,
            on: 0,
        };
        let (groups, _) = bytes.as_chunks::<{ 4 * GROUP }>();
        let mut words = 0;
        'groups: for group in groups {
            let group: [u32; GROUP] = std::array::from_fn(|k| {
                u32::from_le_bytes([
                    group[4 * k],
                    group[4 * k + 1],
                    group[4 * k + 2],
                    group[4 * k + 3],
                ])
            });
            if group
                .iter()
                .fold(true, |all, w| all & is_cd_within(*w, limits))
            {
                run.group::<KEEP>(&group, &mut output.buffer);
                words += GROUP;
                continue;
            }
            for w in group {
                if !run.word::<KEEP>(w, limits, &mut output.buffer) {
                    break 'groups;
                }
                words += 1;
            }
        }
        if words == groups.len() * GROUP {
            let (rest, _) = bytes[words * 4..].as_chunks();
            for word in rest {
                if !run.word::<KEEP>(u32::from_le_bytes(*word), limits, &mut output.buffer) {
                    break;
                }
                words += 1;
            }
        }
        self.finish_run::<KEEP>(&bytes[..words * 4], &run, output);
        words * 4
    }

    /// Books a run that used `bytes`.
    fn finish_run<const KEEP: bool>(&mut self, bytes: &[u8], run: &Run, output: &mut Output) {
        let (words, _) = bytes.as_chunks();
        let (Some(first), Some(last)) = (words.first(), words.last()) else {
            return;
        };
        let time_of = |word: &[u8; 4], base_us| {
            let w = u32::from_le_bytes(*word);
            match w >> 28 {
                8 => run.epoch_us + (u64::from(w & 0x0fff_ffff) << 6),
                _ => base_us + u64::from(w >> 22 & 0x3f),
            }
        };
        output.timed(time_of(first, self.base.base_us()));
        output.timed(time_of(last, run.base_us));
        self.base.advance(run.high);
        self.other = None;
        if KEEP {
            output.len = run.events;
        }
        output.stats.cd_on += run.on;
        output.stats.cd_off += run.events as u64 - run.on;
        output.stats.time_high += (words.len() - run.events) as u64;
    }

    /// Decodes one word of any kind.
    fn word<const KEEP: bool>(&mut self, w: u32, output: &mut Output, sink: &mut impl EventSink) {
        let kind = w >> 28;
        let t_us = self.base.base_us() + u64::from(w >> 22 & 0x3f);
        let other = self.other.take();
        match kind {
            0x8 => {
                let step = self.base.set(w & 0x0fff_ffff);
                output.time_high(step, self.base.base_us(), sink);
            }
            0x0 | 0x1 | 0xa if !self.base.known() => output.stats.dropped_before_time += 1,
            0x0 | 0x1 => output.cd::<KEEP>(
                CdEvent {
                    t_us,
                    x: (w >> 11 & 0x7ff) as u16,
                    y: (w & 0x7ff) as u16,
                    polarity: Polarity::from_bit(kind == 1),
                },
                sink,
            ),
            0xa => output.trigger(
                TriggerEdge {
                    t_us,
                    channel: (w >> 8 & 0x1f) as u8,
                    rising: w & 1 == 1,
                },
                sink,
            ),
            0xe => {
                output.stats.monitoring += 1;
                self.other = Some((t_us, w as u16));
            }
            0xf if other.is_some() => {
                output.stats.monitoring += 1;
                if let (Some((t_us, subtype)), true) = (other, self.base.known()) {
                    let payload = w & 0x0fff_ffff;
                    output.monitoring(
                        Monitoring {
                            t_us,
                            subtype,
                            payload,
                        },
                        sink,
                    );
                }
            }
            _ => output.stats.skipped[kind as usize] += 1,
        }
    }
}
