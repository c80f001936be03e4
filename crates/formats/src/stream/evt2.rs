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
            if self.base.known() {
                let used = self.plain_words::<KEEP>(bytes, output);
                bytes = &bytes[used..];
                if output.len > 0 {
                    output.flush(sink);
                }
            }
            // Either the buffer was full, or the next word is not plain.
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
    /// sends. Each word is written as an event, and kept by moving the end of the buffer, so that the loop
    /// has no branch that depends on the mixture of words.
    fn plain_words<const KEEP: bool>(&mut self, bytes: &[u8], output: &mut Output) -> usize {
        let (width, height) = (
            u32::from(output.geometry.width),
            u32::from(output.geometry.height),
        );
        let epoch_us = self.base.epoch_us();
        let mut base_us = self.base.base_us();
        let mut high = self.base.high();
        let buffer = &mut *output.buffer;
        let (mut events, mut on, mut words) = (0_usize, 0_u64, 0_usize);
        let mut first = None;
        for word in bytes.chunks_exact(4).take(BLOCK) {
            let w = u32::from_le_bytes([word[0], word[1], word[2], word[3]]);
            let kind = w >> 28;
            let (is_cd, is_time) = (kind < 2, kind == 8);
            let (x, y) = (w >> 11 & 0x7ff, w & 0x7ff);
            let next = w & 0x0fff_ffff;
            let progress = next.wrapping_sub(high) <= TimeBase::<TIME_HIGH_BITS, 6>::HALF;
            let plain = (is_cd & (x < width) & (y < height)) | (is_time & progress);
            if !plain {
                break;
            }
            high = if is_time { next } else { high };
            base_us = if is_time {
                epoch_us + (u64::from(next) << 6)
            } else {
                base_us
            };
            let t_us = base_us + u64::from(w >> 22 & 0x3f);
            if KEEP {
                buffer[events & (BLOCK - 1)] = CdEvent {
                    t_us,
                    x: x as u16,
                    y: y as u16,
                    polarity: Polarity::from_bit(kind == 1),
                };
            }
            if words == 0 {
                first = Some(if is_time { base_us } else { t_us });
            }
            words += 1;
            events += usize::from(is_cd);
            on += u64::from(kind == 1);
        }
        self.base.advance(high);
        if KEEP {
            output.len = events;
        }
        output.stats.cd_on += on;
        output.stats.cd_off += events as u64 - on;
        output.stats.time_high += (words - events) as u64;
        if let Some(first_us) = first {
            self.other = None;
            output.timed(first_us);
            let last = &bytes[words * 4 - 4..words * 4];
            let w = u32::from_le_bytes([last[0], last[1], last[2], last[3]]);
            let low = if w >> 28 == 8 { 0 } else { w >> 22 & 0x3f };
            output.timed(base_us + u64::from(low));
        }
        words * 4
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
