//! EVT3: 16-bit words with state.
//!
//! Layout (EVK1 reference, section 4.3; Prophesee's published EVT 3.0 format): type in bits 15:12. ADDR_Y 0x0
//! sets the row, ADDR_X 0x2 is one event, VECT_BASE_X 0x3 sets column and polarity of the vectors VECT_12 0x4
//! and VECT_8 0x5, whose bits are events and which advance the column by 12 and 8. TIME_LOW 0x6 and TIME_HIGH
//! 0x8 hold 12 bits of time each; a changed TIME_HIGH sets the low part to 0. EXT_TRIGGER 0xA carries channel
//! 11:8 and edge 0. OTHERS 0xE is followed by 12 + 12 + 4 bits of payload. Time wraps every 16.777216 s.
//!
//! Every vector word is decoded on its own. Sensors send vectors in groups 12 + 12 + 8, and the camera vendor's
//! library waits for whole groups and ignores a lone vector. Decoding single words gives the same events
//! for whole groups and loses none at the edges of a recording.

use skinrig_model::{CdEvent, Polarity, TriggerEdge};

use super::clock::TimeBase;
use super::evt3_run::{Counts, Run};
use super::output::Output;
use super::sink::{EventSink, Monitoring};

/// Length of the time base counter, bits; its unit is 4096 µs.
pub(crate) const TIME_HIGH_BITS: u32 = 12;
/// Range of the stream's time, µs.
pub const RANGE_US: u64 = 1 << 24;
/// Coordinates that 11 bits express.
const MAX_SIDE: u16 = 2048;

/// State of an EVT3 stream between two words.
#[derive(Debug, Clone, Default)]
pub(super) struct Words {
    base: TimeBase<TIME_HIGH_BITS, 12>,
    low: u16,
    /// Words were lost, and no TIME_LOW has followed a TIME_HIGH since: whether that one changed is unknown.
    low_is_lost: bool,
    y: Option<u16>,
    /// Column and polarity of the next vector.
    vector: Option<(u16, Polarity)>,
    /// An OTHERS word with an incomplete payload.
    other: Option<OtherWord>,
}

#[derive(Debug, Clone, Copy)]
struct OtherWord {
    t_us: u64,
    subtype: u16,
    payload: u32,
    bits: u32,
}

impl Words {
    /// State at the start of a stream whose times count from `origin_us`.
    pub(super) fn restart(&mut self, origin_us: u64) {
        *self = Self {
            base: TimeBase::starting_at(origin_us),
            ..Self::default()
        };
    }

    /// Words were lost.
    pub(super) const fn lost(&mut self) {
        self.base.lost();
        self.low_is_lost = true;
        self.y = None;
        self.vector = None;
        self.other = None;
    }

    /// True while events have a time.
    const fn knows_time(&self) -> bool {
        self.base.known() && !self.low_is_lost
    }

    /// Decodes whole words.
    pub(super) fn run<const KEEP: bool>(
        &mut self,
        mut bytes: &[u8],
        output: &mut Output,
        sink: &mut impl EventSink,
    ) {
        while !bytes.is_empty() {
            // A run starts with an empty buffer and reports no first time.
            output.flush(sink);
            if let Some(run) = self.plain_run(output) {
                let (used, full) = self.plain_words::<KEEP>(bytes, run, output);
                bytes = &bytes[used..];
                if full {
                    continue;
                }
            }
            // The end of the input, or the next word is not plain.
            let Some((word, rest)) = bytes.split_first_chunk() else {
                return;
            };
            self.word::<KEEP>(u16::from_le_bytes(*word), output, sink);
            bytes = rest;
        }
    }

    /// A run from here; `None` unless events have a time and a row.
    fn plain_run(&self, output: &Output) -> Option<Run> {
        let (width, height) = (output.geometry.width, output.geometry.height);
        let y = self.y.filter(|y| *y < height)?;
        let is_ready = self.knows_time() && output.chunk_first_us.is_some();
        is_ready.then(|| Run {
            // More columns than the format can express.
            width: width.min(MAX_SIDE),
            height: height.min(MAX_SIDE),
            base_us: self.base.base_us(),
            t_us: self.base.base_us() + u64::from(self.low),
            time_high_word: 0x8000 | self.base.high() as u16,
            row: u32::from(y) << 16,
            vector: self.vector,
            counts: Counts::default(),
        })
    }

    /// Decodes plain words into the empty buffer, and returns the bytes used and whether they ended because the buffer is
    /// full.
    fn plain_words<const KEEP: bool>(
        &mut self,
        bytes: &[u8],
        run: Run,
        output: &mut Output,
    ) -> (usize, bool) {
        let buffer = &mut output.buffer;
        let (run, used, full) = output.instructions.run(
            #[inline(always)]
            || run.words::<KEEP>(bytes, buffer),
        );
        self.low = (run.t_us - run.base_us) as u16;
        self.y = Some((run.row >> 16) as u16);
        self.vector = run.vector;
        let counts = run.counts;
        if counts.events + counts.time_low + counts.time_high > 0 {
            output.timed(run.t_us);
        }
        if KEEP {
            output.len = counts.events;
        }
        output.stats.cd_on += counts.on as u64;
        output.stats.cd_off += (counts.events - counts.on) as u64;
        output.stats.time_low += counts.time_low as u64;
        output.stats.time_high += counts.time_high as u64;
        output.stats.address += counts.address as u64;
        (used, full)
    }

    #[inline]
    fn word<const KEEP: bool>(&mut self, w: u16, output: &mut Output, sink: &mut impl EventSink) {
        let t_us = self.base.base_us() + u64::from(self.low);
        let data = w & 0x0fff;
        match w >> 12 {
            0x2 => {
                let Some(y) = self.y.filter(|_| self.knows_time()) else {
                    return self.drop_events(1, output);
                };
                output.cd::<KEEP>(
                    CdEvent {
                        t_us,
                        x: data & 0x7ff,
                        y,
                        polarity: Polarity::from_bit(data & 0x800 != 0),
                    },
                    sink,
                );
            }
            0x4 => self.vector::<KEEP>(data, 12, t_us, output, sink),
            0x5 => self.vector::<KEEP>(data & 0xff, 8, t_us, output, sink),
            0x6 => {
                self.low = data;
                output.stats.time_low += 1;
                if self.base.known() {
                    self.low_is_lost = false;
                    output.timed(self.base.base_us() + u64::from(data));
                }
            }
            0x0 => {
                self.y = Some(data & 0x7ff);
                output.stats.address += 1;
            }
            0x3 => {
                self.vector = Some((data & 0x7ff, Polarity::from_bit(data & 0x800 != 0)));
                output.stats.address += 1;
            }
            0x8 => {
                if !self.base.known() || self.base.high() != u32::from(data) {
                    self.low = 0;
                }
                let step = self.base.set(data.into());
                let now_us = self.base.base_us() + u64::from(self.low);
                output.time_high(step, (!self.low_is_lost).then_some(now_us), sink);
            }
            0xa if !self.knows_time() => output.stats.dropped_before_time += 1,
            0xa => output.trigger(
                TriggerEdge {
                    t_us,
                    channel: (data >> 8) as u8,
                    rising: data & 1 == 1,
                },
                sink,
            ),
            0xe => {
                output.stats.monitoring += 1;
                self.other = Some(OtherWord {
                    t_us,
                    subtype: data,
                    payload: 0,
                    bits: 0,
                });
            }
            0xf => self.continued(data, 12, 0xf, output, sink),
            0x7 => self.continued(data & 0xf, 4, 0x7, output, sink),
            kind => output.stats.skipped[usize::from(kind)] += 1,
        }
    }

    #[inline]
    fn vector<const KEEP: bool>(
        &mut self,
        mut mask: u16,
        columns: u16,
        t_us: u64,
        output: &mut Output,
        sink: &mut impl EventSink,
    ) {
        let (Some(y), Some((x, polarity)), true) = (self.y, self.vector, self.knows_time()) else {
            self.drop_events(mask.count_ones(), output);
            if let Some((x, _)) = &mut self.vector {
                *x = x.saturating_add(columns);
            }
            return;
        };
        self.vector = Some((x.saturating_add(columns), polarity));
        while mask != 0 {
            let x = x.saturating_add(mask.trailing_zeros() as u16);
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

    /// Counts events whose time, row or column is unknown.
    fn drop_events(&self, events: u32, output: &mut Output) {
        if self.knows_time() {
            output.stats.dropped_before_address += u64::from(events);
        } else {
            output.stats.dropped_before_time += u64::from(events);
        }
    }

    /// Processes a continuation: the next bits of an OTHERS payload, low part first, 28 bits in all.
    fn continued(
        &mut self,
        data: u16,
        bits: u32,
        kind: usize,
        output: &mut Output,
        sink: &mut impl EventSink,
    ) {
        let Some(mut other) = self.other.take() else {
            output.stats.skipped[kind] += 1;
            return;
        };
        output.stats.monitoring += 1;
        other.payload |= u32::from(data) << other.bits;
        other.bits += bits;
        if other.bits < 28 {
            self.other = Some(other);
        } else if self.knows_time() {
            output.monitoring(
                Monitoring {
                    t_us: other.t_us,
                    subtype: other.subtype,
                    payload: other.payload & 0x0fff_ffff,
                },
                sink,
            );
        }
    }
}
