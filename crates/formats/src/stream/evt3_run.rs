//! Runs of plain EVT3 words: those that a camera sends nearly always, decoded without the cases that are rare.
//!
//! A run begins when time and row are known. Its words are rows and pixels on the sensor, vectors of such pixels, low time
//! words, and repeated time base words. Groups of single events, rows and low time words are decoded without a branch per word:
//! their kinds alternate irregularly, and a branch misprediction costs more than a word.

use skinrig_model::{CdEvent, Polarity};

use super::evt3_group::{Group, WORDS};
use super::output::BLOCK;

/// State of a run.
#[derive(Debug, Clone)]
pub(super) struct Run {
    pub width: u16,
    pub height: u16,
    /// Time of the time base, µs.
    pub base_us: u64,
    /// The time base word that repeats it.
    pub time_high_word: u16,
    /// Current time, µs: the base and a low time below 4096.
    pub t_us: u64,
    /// A row of the sensor in the upper half, which compiles to one store of both coordinates.
    pub row: u32,
    /// Column and polarity of the next vector.
    pub vector: Option<(u16, Polarity)>,
    pub counts: Counts,
}

/// Words and events of a run.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pub events: usize,
    pub on: usize,
    pub time_low: usize,
    pub time_high: usize,
    pub address: usize,
}

impl Run {
    /// Decodes plain words into `buffer`, and returns the state behind them, the bytes used and whether they ended because the buffer
    /// is full.
    #[inline(always)]
    pub(super) fn words<const KEEP: bool>(
        mut self,
        bytes: &[u8],
        buffer: &mut [CdEvent; BLOCK],
    ) -> (Self, usize, bool) {
        let (used, full) = self.all::<KEEP>(bytes, buffer);
        (self, used, full)
    }

    #[inline(always)]
    fn all<const KEEP: bool>(
        &mut self,
        bytes: &[u8],
        buffer: &mut [CdEvent; BLOCK],
    ) -> (usize, bool) {
        let (groups, rest) = bytes.as_chunks();
        let mut used = 0;
        for bytes in groups {
            let group = Group::new(bytes);
            if group.is_single(self.width, self.height) {
                if KEEP {
                    let Some(out) = self.place(buffer) else {
                        return (used, true);
                    };
                    self.single(bytes, out);
                } else {
                    self.skip(&group);
                }
                self.count(&group);
            } else if let Some((each, full)) = self.each::<KEEP>(bytes, buffer) {
                return (used + each, full);
            }
            used += bytes.len();
        }
        match self.each::<KEEP>(rest, buffer) {
            Some((each, full)) => (used + each, full),
            None => (used + rest.len(), false),
        }
    }

    /// Room for the events of a group or word.
    #[inline(always)]
    fn place<'a>(&self, buffer: &'a mut [CdEvent; BLOCK]) -> Option<&'a mut [CdEvent; WORDS]> {
        buffer.get_mut(self.counts.events..)?.first_chunk_mut()
    }

    /// Writes the events of a group of single events, rows and low time words.
    #[inline(always)]
    fn single(&mut self, bytes: &[u8; 2 * WORDS], out: &mut [CdEvent; WORDS]) {
        let mut events = 0;
        for word in bytes.as_chunks().0 {
            let w = u32::from(u16::from_le_bytes(*word));
            let (low, row) = (u64::from(w & 0x0fff), (w & 0x07ff) << 16);
            let t_us = self.base_us + low;
            self.t_us = if w & 0x4000 != 0 { t_us } else { self.t_us };
            self.row = if w & 0x2000 == 0 { row } else { self.row };
            // Each word is written, and overwritten by the next event. There are at most WORDS - 1 events before the last word.
            out[events % WORDS] = self.event(w & 0x07ff, w);
            // A carry from kind 2 leaves one bit there, from 0 and 6 none.
            events += ((w + 0x2000) >> 14 & 1) as usize;
        }
    }

    /// Processes a group of single events, rows and low time words without events.
    #[inline(always)]
    fn skip(&mut self, group: &Group) {
        if let Some(low) = group.last_low() {
            self.t_us = self.base_us + low;
        }
        if let Some(row) = group.last_row() {
            self.row = row << 16;
        }
    }

    #[inline(always)]
    fn count(&mut self, group: &Group) {
        let (events, time_low) = (group.events(), group.time_low());
        self.counts.events += events;
        self.counts.on += group.on_events();
        self.counts.time_low += time_low;
        self.counts.address += WORDS - events - time_low;
    }

    /// The event at column `x`; `sign`: bit 11 is its polarity.
    #[inline(always)]
    fn event(&self, x: u32, sign: u32) -> CdEvent {
        let pixel = self.row.wrapping_add(x);
        CdEvent {
            t_us: self.t_us,
            x: pixel as u16,
            y: (pixel >> 16) as u16,
            polarity: Polarity::from_bit(sign >> 11 & 1 == 1),
        }
    }

    /// Processes words one by one; returns the bytes used and whether the buffer is full, if they do not end before.
    #[inline(always)]
    fn each<const KEEP: bool>(
        &mut self,
        bytes: &[u8],
        buffer: &mut [CdEvent; BLOCK],
    ) -> Option<(usize, bool)> {
        for (used, word) in bytes.as_chunks().0.iter().enumerate() {
            if KEEP && self.counts.events > BLOCK - WORDS {
                return Some((2 * used, true));
            }
            if !self.word::<KEEP>(u16::from_le_bytes(*word).into(), buffer) {
                return Some((2 * used, false));
            }
        }
        None
    }

    /// Processes a word if it is plain.
    #[inline(always)]
    fn word<const KEEP: bool>(&mut self, w: u32, buffer: &mut [CdEvent; BLOCK]) -> bool {
        let data = w & 0x0fff;
        match w >> 12 {
            0x4 => return self.vector::<KEEP>(data, 12, buffer),
            0x5 => return self.vector::<KEEP>(data & 0xff, 8, buffer),
            0x3 => {
                self.vector = Some(((data & 0x7ff) as u16, Polarity::from_bit(data & 0x800 != 0)));
                self.counts.address += 1;
            }
            0x2 if data & 0x7ff < self.width.into() => {
                if KEEP {
                    buffer[self.counts.events] = self.event(data & 0x7ff, data);
                }
                self.counts.events += 1;
                self.counts.on += (data >> 11) as usize;
            }
            0x0 if data & 0x7ff < self.height.into() => {
                self.row = (data & 0x7ff) << 16;
                self.counts.address += 1;
            }
            0x6 => {
                self.t_us = self.base_us + u64::from(data);
                self.counts.time_low += 1;
            }
            0x8 if w == self.time_high_word.into() => self.counts.time_high += 1,
            _ => return false,
        }
        true
    }

    /// Processes a vector whose columns are all on the sensor.
    #[inline(always)]
    fn vector<const KEEP: bool>(
        &mut self,
        mask: u32,
        columns: u16,
        buffer: &mut [CdEvent; BLOCK],
    ) -> bool {
        let Some((x, polarity)) = self.vector else {
            return false;
        };
        if x + columns > self.width {
            return false;
        }
        self.vector = Some((x + columns, polarity));
        if KEEP {
            let Some(out) = self.place(buffer) else {
                return false;
            };
            let (sign, mut events) = (u32::from(polarity.bit()) << 11, 0);
            for bit in 0..columns {
                // Each column is written, and overwritten by the next event.
                out[events % WORDS] = self.event(u32::from(x + bit), sign);
                events += (mask >> bit & 1) as usize;
            }
        }
        let events = mask.count_ones() as usize;
        self.counts.events += events;
        self.counts.on += events * usize::from(polarity.bit());
        true
    }
}
