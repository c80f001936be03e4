//! EVT2: 32-bit words, the format of the EVK1 Gen3.1.
//!
//! Layout (EVK1 reference, section 4.1; Prophesee's published EVT 2.0 format): type in bits 31:28. CD_OFF 0x0
//! and CD_ON 0x1 carry t\[5:0\] in 27:22, x in 21:11, y in 10:0. TIME_HIGH 0x8 carries t\[33:6\]. EXT_TRIGGER
//! 0xA carries t\[5:0\], channel 12:8, edge 0. OTHER 0xE with CONTINUED 0xF carry monitoring values. The 34
//! bits of time wrap every 17 179.869184 s.

use skinrig_model::{CdEvent, Polarity, TriggerEdge};

pub use super::evt2_encode::{Encoder, MAX_COORDINATE, TIME_HIGH_CADENCE_US};

use super::clock::TimeBase;
use super::output::{BLOCK, Output};
use super::sink::{EventSink, Monitoring};

/// Length of the time base counter, bits; its unit is 64 µs.
pub(crate) const TIME_HIGH_BITS: u32 = 28;
/// Range of the stream's time, µs.
pub const RANGE_US: u64 = 1 << 34;

/// Bytes of a group of words.
type Group = [[u8; 4]; GROUP];
const GROUP: usize = 16;
/// Words per group. Groups are checked lane by lane, which compiles to vector instructions.
const LANES: usize = 4;
/// Set in a time base word and in no CD word.
const TIME_HIGH_FLAG: u32 = 1 << 31;
/// Steps of the time base below this, in its unit, are certainly progress.
const SURE_STEP: u32 = TimeBase::<TIME_HIGH_BITS, 6>::HALF;

/// A run of plain words in the fast loop: CD events on the sensor and ordinary progress of the
/// time base, which are nearly all words of a camera.
///
/// A group of words is checked and counted without a branch per word: events and time
/// base words alternate at random in a quiet stream, and a branch misprediction costs more than a word.
struct Run {
    width: u32,
    height: u32,
    epoch_us: u64,
    high: u32,
    events: usize,
    on: u64,
}

impl Run {
    #[inline(always)]
    fn base_us(&self) -> u64 {
        self.epoch_us + (u64::from(self.high) << 6)
    }

    #[inline(always)]
    fn event(w: u32, base_us: u64) -> CdEvent {
        CdEvent {
            t_us: base_us + u64::from(w >> 22 & 0x3f),
            x: (w >> 11 & 0x7ff) as u16,
            y: (w & 0x7ff) as u16,
            polarity: Polarity::from_bit(w >> 28 & 1 == 1),
        }
    }

    /// Bits that no plain word has: nonzero for a word of another type, or of a pixel outside the sensor.
    #[inline(always)]
    fn foreign_bits(&self, w: u32) -> u32 {
        // The highest bit is set when x < width and y < height.
        let inside =
            (w >> 11 & 0x7ff).wrapping_sub(self.width) & (w & 0x7ff).wrapping_sub(self.height);
        (!(inside | w) & 0x8000_0000) | (w & 0x6000_0000) | (w & w >> 3 & 0x1000_0000)
    }

    /// Processes a group if it is plain; its events go to `out`.
    #[inline(always)]
    fn group<const KEEP: bool>(&mut self, group: &Group, out: &mut [CdEvent; GROUP]) -> bool {
        let (mut foreign, mut any, mut all) = ([0; LANES], [0; LANES], [u32::MAX; LANES]);
        for words in group.as_chunks::<LANES>().0 {
            for k in 0..LANES {
                let w = u32::from_le_bytes(words[k]);
                foreign[k] |= self.foreign_bits(w);
                any[k] |= w;
                all[k] &= w;
            }
        }
        let or = |lanes: [u32; LANES]| lanes.iter().fold(0, |a, b| a | b);
        if or(foreign) != 0 {
            return false;
        }
        if or(any) & TIME_HIGH_FLAG == 0 {
            self.events_only::<KEEP>(group, out);
            true
        } else if all.iter().fold(u32::MAX, |a, b| a & b) & TIME_HIGH_FLAG != 0 {
            self.time_only(group)
        } else {
            self.mixed::<KEEP>(group, out)
        }
    }

    #[inline(always)]
    fn events_only<const KEEP: bool>(&mut self, group: &Group, out: &mut [CdEvent; GROUP]) {
        if KEEP {
            let base_us = self.base_us();
            for (out, w) in out.iter_mut().zip(group) {
                *out = Self::event(u32::from_le_bytes(*w), base_us);
            }
        }
        self.events += GROUP;
        self.count_on(group);
    }

    /// Processes a group of time base words if they are in order.
    #[inline(always)]
    fn time_only(&mut self, group: &Group) -> bool {
        let high = |k: usize| u32::from_le_bytes(group[k]) ^ TIME_HIGH_FLAG;
        let mut steps = [high(0).wrapping_sub(self.high), 0, 0, 0];
        // The last step overlaps the one before it.
        for first in [1, 5, 9, GROUP - LANES] {
            for (k, step) in steps.iter_mut().enumerate() {
                *step |= high(first + k).wrapping_sub(high(first + k - 1));
            }
        }
        let in_order = steps.iter().fold(0, |a, b| a | b) < SURE_STEP;
        if in_order {
            self.high = high(GROUP - 1);
        }
        in_order
    }

    /// Processes a group of both kinds if its time base words are in order.
    #[inline(always)]
    fn mixed<const KEEP: bool>(&mut self, group: &Group, out: &mut [CdEvent; GROUP]) -> bool {
        let (mut high, mut steps, mut events) = (self.high, 0, 0);
        for w in group {
            let w = u32::from_le_bytes(*w);
            let previous = high;
            high = if w & TIME_HIGH_FLAG != 0 {
                w ^ TIME_HIGH_FLAG
            } else {
                previous
            };
            steps |= high.wrapping_sub(previous);
            if KEEP {
                // A time base word is written too, and overwritten by the next event. The rest is
                // harmless, as there are at most GROUP - 1 events before the last word.
                let base_us = self.epoch_us + (u64::from(high) << 6);
                out[events % GROUP] = Self::event(w, base_us);
            }
            events += (!w >> 31) as usize;
        }
        let in_order = steps < SURE_STEP;
        if in_order {
            self.high = high;
            self.events += events;
            self.count_on(group);
        }
        in_order
    }

    #[inline(always)]
    fn count_on(&mut self, group: &Group) {
        let mut on = [0; LANES];
        for words in group.as_chunks::<LANES>().0 {
            for k in 0..LANES {
                on[k] += u32::from_le_bytes(words[k]) >> 28 & 1;
            }
        }
        self.on += u64::from(on.iter().sum::<u32>());
    }

    /// Processes one word if it is plain.
    #[inline(always)]
    fn word<const KEEP: bool>(&mut self, w: u32, buffer: &mut [CdEvent; BLOCK]) -> bool {
        if self.foreign_bits(w) != 0 {
            return false;
        }
        if w & TIME_HIGH_FLAG != 0 {
            let high = w ^ TIME_HIGH_FLAG;
            let progress = high.wrapping_sub(self.high) < SURE_STEP;
            if progress {
                self.high = high;
            }
            return progress;
        }
        if KEEP {
            buffer[self.events] = Self::event(w, self.base_us());
        }
        self.events += 1;
        self.on += u64::from(w >> 28);
        true
    }

    /// Decodes plain words into `buffer`, and returns the bytes used and whether they ended because the buffer is full.
    #[inline(always)]
    fn words<const KEEP: bool>(
        mut self,
        bytes: &[u8],
        buffer: &mut [CdEvent; BLOCK],
    ) -> (Self, usize, bool) {
        let (all, _) = bytes.as_chunks();
        let (mut words, mut full) = (0, false);
        for group in all.as_chunks::<GROUP>().0 {
            let place = if KEEP { self.events } else { 0 };
            let Some(out) = buffer.get_mut(place..).and_then(<[_]>::first_chunk_mut) else {
                full = true;
                break;
            };
            if !self.group::<KEEP>(group, out) {
                break;
            }
            words += GROUP;
        }
        if !full {
            // The words before one that is not plain fit; the last words of the input, fewer than a group, may not.
            for word in &all[words..] {
                if KEEP && self.events == BLOCK {
                    full = true;
                    break;
                }
                if !self.word::<KEEP>(u32::from_le_bytes(*word), buffer) {
                    break;
                }
                words += 1;
            }
        }
        (self, words * 4, full)
    }
}

/// State of an EVT2 stream between two words.
#[derive(Debug, Clone, Default)]
pub(super) struct Words {
    base: TimeBase<TIME_HIGH_BITS, 6>,
    /// Time and subtype of an OTHER word whose first CONTINUED word has not arrived.
    other: Option<(u64, u16)>,
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
        self.other = None;
    }

    /// Decodes whole words.
    pub(super) fn run<const KEEP: bool>(
        &mut self,
        mut bytes: &[u8],
        output: &mut Output,
        sink: &mut impl EventSink,
    ) {
        while !bytes.is_empty() {
            output.flush(sink);
            if self.base.known() {
                let (used, full) = self.plain_words::<KEEP>(bytes, output);
                bytes = &bytes[used..];
                if full {
                    continue;
                }
            }
            // The end of the input, or the next word is not plain.
            let Some((word, rest)) = bytes.split_first_chunk() else {
                return;
            };
            self.word::<KEEP>(u32::from_le_bytes(*word), output, sink);
            bytes = rest;
        }
    }

    /// Decodes plain words into the empty buffer, and returns the bytes used and whether they ended
    /// because the buffer is full.
    fn plain_words<const KEEP: bool>(
        &mut self,
        bytes: &[u8],
        output: &mut Output,
    ) -> (usize, bool) {
        let run = Run {
            width: output.geometry.width.into(),
            height: output.geometry.height.into(),
            epoch_us: self.base.epoch_us(),
            high: self.base.high(),
            events: 0,
            on: 0,
        };
        let buffer = &mut output.buffer;
        let (run, used, full) = output.instructions.run(
            #[inline(always)]
            || run.words::<KEEP>(bytes, buffer),
        );
        self.finish_run::<KEEP>(&bytes[..used], &run, output);
        (used, full)
    }

    /// Accounts for a run that used `bytes`.
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
        output.timed(time_of(last, run.base_us()));
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
                output.time_high(step, Some(self.base.base_us()), sink);
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
