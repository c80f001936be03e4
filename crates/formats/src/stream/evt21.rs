//! EVT2.1: 64-bit words with a mask of 32 pixels.
//!
//! Layout (EVK1 reference, section 4.2; Prophesee's published EVT 2.1 format): type in bits 63:60. EVT_NEG
//! 0x0 and EVT_POS 0x1 carry t\[5:0\] in 59:54, x (a multiple of 32) in 53:43, y in 42:32 and a mask in 31:0: bit i is an event
//! at x + i. TIME_HIGH 0x8 carries t\[33:6\] in 59:32. EXT_TRIGGER 0xA carries t\[5:0\], channel 44:40, edge
//! 32. OTHERS 0xE carries t\[5:0\], subtype 47:32, payload 31:0. The *legacy* order sends the high half first.

use skinrig_model::{CdEvent, Polarity, TriggerEdge};

use super::clock::TimeBase;
use super::evt2::TIME_HIGH_BITS;
use super::output::Output;
use super::sink::{EventSink, Monitoring};

/// State of an EVT2.1 stream between two words.
#[derive(Debug, Clone)]
pub(super) struct Words {
    base: TimeBase<TIME_HIGH_BITS, 6>,
    legacy: bool,
}

impl Words {
    pub(super) fn new(legacy: bool) -> Self {
        Self {
            base: TimeBase::default(),
            legacy,
        }
    }

    /// State at the start of a stream whose times count from `origin_us`.
    pub(super) fn restart(&mut self, origin_us: u64) {
        self.base = TimeBase::starting_at(origin_us);
    }

    /// Words were lost.
    pub(super) const fn lost(&mut self) {
        self.base.lost();
    }

    /// Decodes whole words.
    pub(super) fn run<const KEEP: bool>(
        &mut self,
        bytes: &[u8],
        output: &mut Output,
        sink: &mut impl EventSink,
    ) {
        let turn = if self.legacy { 32 } else { 0 };
        let (words, _) = bytes.as_chunks();
        for word in words {
            self.word::<KEEP>(u64::from_le_bytes(*word).rotate_left(turn), output, sink);
        }
    }

    fn word<const KEEP: bool>(&mut self, w: u64, output: &mut Output, sink: &mut impl EventSink) {
        let kind = (w >> 60) as usize;
        let t_us = self.base.base_us() + (w >> 54 & 0x3f);
        match kind {
            0x8 => {
                let step = self.base.set((w >> 32) as u32 & 0x0fff_ffff);
                output.time_high(step, Some(self.base.base_us()), sink);
            }
            0x0 | 0x1 if !self.base.known() => {
                output.stats.dropped_before_time += u64::from((w as u32).count_ones());
            }
            0xa if !self.base.known() => output.stats.dropped_before_time += 1,
            0x0 | 0x1 => {
                let x = (w >> 43 & 0x7ff) as u16;
                let y = (w >> 32 & 0x7ff) as u16;
                let polarity = Polarity::from_bit(kind == 1);
                output.stats.unaligned += u64::from(!x.is_multiple_of(32));
                let mut mask = w as u32;
                while mask != 0 {
                    let x = x + mask.trailing_zeros() as u16;
                    mask &= mask - 1;
                    output.cd::<KEEP>(
                        CdEvent {
                            t_us,
                            x,
                            y,
                            polarity,
                        },
                        sink,
                    );
                }
            }
            0xa => output.trigger(
                TriggerEdge {
                    t_us,
                    channel: (w >> 40 & 0x1f) as u8,
                    rising: w >> 32 & 1 == 1,
                },
                sink,
            ),
            0xe => {
                output.stats.monitoring += 1;
                if self.base.known() {
                    output.monitoring(
                        Monitoring {
                            t_us,
                            subtype: (w >> 32) as u16,
                            payload: w as u32,
                        },
                        sink,
                    );
                }
            }
            _ => output.stats.skipped[kind] += 1,
        }
    }
}
