//! Event streams of cameras: one decoder and one scanner for all word formats.

mod clock;
pub mod evt2;
pub mod evt21;
mod evt2_encode;
pub mod evt3;
mod evt3_group;
mod evt3_run;
mod output;
mod scan;
mod sink;
mod stats;

use skinrig_model::{CdEvent, StreamFormat, TriggerEdge};
use skinrig_simd::InstructionSet;

pub use scan::Scanner;
pub use sink::{EventSink, Monitoring};
pub use stats::{Discontinuity, Geometry, StreamStats};

use output::Output;

/// An incremental decoder: bytes in, events out, in stream order.
///
/// The bytes may be split anywhere, also inside a word; the result does not depend on the splits. After a loss, call
/// [`Self::lost`]. Times are
/// camera times in µs, unwrapped, with the origin of the stream (nothing is shifted to zero). Events before
/// the first time base word have no time and are counted in [`StreamStats::dropped_before_time`].
///
/// A backward step of the time base by more than half of its range is a wrap. A smaller one, and a forward
/// step by more than half of the range, is taken literally and counted as a discontinuity.
#[derive(Debug, Clone)]
pub struct Decoder {
    words: Words,
    output: Output,
    partial: [u8; 8],
    partial_len: usize,
    /// Bytes still to arrive of a word whose beginning is lost.
    torn_len: usize,
}

#[derive(Debug, Clone)]
enum Words {
    Evt2(evt2::Words),
    Evt21(evt21::Words),
    Evt3(evt3::Words),
}

impl Words {
    fn run<const KEEP: bool>(
        &mut self,
        bytes: &[u8],
        output: &mut Output,
        sink: &mut impl EventSink,
    ) {
        match self {
            Self::Evt2(w) => w.run::<KEEP>(bytes, output, sink),
            Self::Evt21(w) => w.run::<KEEP>(bytes, output, sink),
            Self::Evt3(w) => w.run::<KEEP>(bytes, output, sink),
        }
    }

    /// Resets the state.
    fn restart(&mut self, origin_us: u64) {
        match self {
            Self::Evt2(w) => w.restart(origin_us),
            Self::Evt21(w) => w.restart(origin_us),
            Self::Evt3(w) => w.restart(origin_us),
        }
    }

    /// Words were lost.
    const fn lost(&mut self) {
        match self {
            Self::Evt2(w) => w.lost(),
            Self::Evt21(w) => w.lost(),
            Self::Evt3(w) => w.lost(),
        }
    }

    const fn word_bytes(&self) -> usize {
        match self {
            Self::Evt2(_) => 4,
            Self::Evt21(_) => 8,
            Self::Evt3(_) => 2,
        }
    }
}

impl Decoder {
    /// A decoder at the start of a stream of `format`, for the EVK1's 640 x 480 pixels.
    #[must_use]
    pub fn new(format: StreamFormat) -> Self {
        Self::with_geometry(format, Geometry::EVK1)
    }

    /// A decoder for a sensor of `geometry`. Events outside it are not delivered but counted in
    /// [`StreamStats::out_of_geometry`].
    #[must_use]
    pub fn with_geometry(format: StreamFormat, geometry: Geometry) -> Self {
        let words = match format {
            StreamFormat::Evt2 => Words::Evt2(evt2::Words::default()),
            StreamFormat::Evt21 => Words::Evt21(evt21::Words::new(false)),
            StreamFormat::Evt21Legacy => Words::Evt21(evt21::Words::new(true)),
            StreamFormat::Evt3 => Words::Evt3(evt3::Words::default()),
        };
        Self {
            words,
            output: Output::new(geometry),
            partial: [0; 8],
            partial_len: 0,
            torn_len: 0,
        }
    }

    /// Uses other instructions than the best ones of this processor, with the same results.
    #[must_use]
    pub fn with_instructions(mut self, instructions: InstructionSet) -> Self {
        self.output.instructions = instructions;
        self
    }

    /// Starts a new stream, for example after a restart of the device. No state carries over; times
    /// count from `origin_us`, which the caller chooses after the earlier times. Counts continue.
    pub fn restart(&mut self, origin_us: u64) {
        self.output.stats.trailing_bytes += self.partial_len as u64;
        (self.partial_len, self.torn_len) = (0, 0);
        self.words.restart(origin_us);
    }

    /// Reports a loss: `bytes` were lost here, exactly or except for whole words, so that the next word boundary is known. The
    /// incomplete word is discarded, and so is everything that a lost time base word (or EVT3 address) would have changed: events and
    /// edges up to the next one have no time and are counted in [`StreamStats::dropped_before_time`], never stamped with the
    /// old one. Camera time continues through a loss of less than half of its range: 2.4 h, EVT3 8 s.
    pub fn lost(&mut self, bytes: u64) {
        if bytes == 0 {
            return;
        }
        let size = self.words.word_bytes();
        let into_word = match self.torn_len {
            0 => self.partial_len,
            torn => size - torn,
        };
        // Words have at most 8 bytes.
        let phase = (into_word + (bytes % size as u64) as usize) % size;
        self.output.stats.trailing_bytes += self.partial_len as u64;
        self.partial_len = 0;
        self.torn_len = (size - phase) % size;
        self.words.lost();
    }

    /// Decodes `bytes` and passes everything to `sink`, in stream order; CD events come in slices of at
    /// most a few thousand, so that they stay in the processor's cache. This is the fast way to process events
    /// once.
    pub fn push(&mut self, bytes: &[u8], sink: &mut impl EventSink) {
        self.feed::<true>(bytes, sink);
    }

    /// Decodes `bytes` and passes the CD events to `on_slice`, without the triggers.
    pub fn for_each_slice(&mut self, bytes: &[u8], on_slice: impl FnMut(&[CdEvent])) {
        self.push(bytes, &mut sink::CdSlices(on_slice));
    }

    /// Decodes `bytes` and appends CD events and trigger edges.
    pub fn push_cd(
        &mut self,
        bytes: &[u8],
        events: &mut Vec<CdEvent>,
        triggers: &mut Vec<TriggerEdge>,
    ) {
        self.push(bytes, &mut sink::CollectingSink { events, triggers });
    }

    /// Statistics since the start. Bytes of an unfinished word are in [`StreamStats::trailing_bytes`].
    #[must_use]
    pub fn stats(&self) -> StreamStats {
        StreamStats {
            trailing_bytes: self.output.stats.trailing_bytes + self.partial_len as u64,
            ..self.output.stats
        }
    }

    /// Time of the first timed word, µs; `None` before the first time base word.
    #[must_use]
    pub fn first_us(&self) -> Option<u64> {
        self.output.chunk_first_us
    }

    /// Time of the last timed word (time base, CD event or trigger edge), µs; `None` before the first time
    /// base word.
    #[must_use]
    pub fn last_us(&self) -> Option<u64> {
        self.output.last_us
    }

    fn feed<const KEEP: bool>(&mut self, mut bytes: &[u8], sink: &mut impl EventSink) {
        let size = self.words.word_bytes();
        if self.torn_len > 0 {
            let torn = bytes.len().min(self.torn_len);
            self.torn_len -= torn;
            self.output.stats.trailing_bytes += torn as u64;
            bytes = &bytes[torn..];
        }
        if self.partial_len > 0 {
            let taken = bytes.len().min(size - self.partial_len);
            let (head, rest) = bytes.split_at(taken);
            self.partial[self.partial_len..self.partial_len + taken].copy_from_slice(head);
            self.partial_len += taken;
            bytes = rest;
            if self.partial_len < size {
                return;
            }
            let word = self.partial;
            self.partial_len = 0;
            self.words
                .run::<KEEP>(&word[..size], &mut self.output, sink);
        }
        let (whole, rest) = bytes.split_at(bytes.len() - bytes.len() % size);
        self.words.run::<KEEP>(whole, &mut self.output, sink);
        self.partial[..rest.len()].copy_from_slice(rest);
        self.partial_len = rest.len();
        self.output.flush(sink);
    }
}
