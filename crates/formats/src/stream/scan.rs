//! Counts the content of a chunk without keeping its events.

use skinrig_model::{CdEvent, ChunkFacts, StreamFormat, TriggerEdge};
use skinrig_simd::InstructionSet;

use super::Decoder;
use super::sink::EventSink;
use super::stats::{Geometry, StreamStats};

/// Scans a stream chunk by chunk and reports the content of each. It is a faster [`Decoder`] without
/// events; its counts equal the decoder's.
#[derive(Debug, Clone)]
pub struct Scanner {
    decoder: Decoder,
}

struct Edges<'a>(&'a mut Vec<TriggerEdge>);

impl EventSink for Edges<'_> {
    fn on_cd(&mut self, _events: &[CdEvent]) {}
    fn on_trigger(&mut self, edge: TriggerEdge) {
        self.0.push(edge);
    }
}

impl Scanner {
    /// A scanner at the start of a stream of `format`, for 640 x 480 pixels.
    #[must_use]
    pub fn new(format: StreamFormat) -> Self {
        Self::with_geometry(format, Geometry::EVK1)
    }

    /// A scanner for a sensor of `geometry`.
    #[must_use]
    pub fn with_geometry(format: StreamFormat, geometry: Geometry) -> Self {
        Self {
            decoder: Decoder::with_geometry(format, geometry),
        }
    }

    /// Uses other instructions than the best ones of this processor, with the same results.
    #[must_use]
    pub fn with_instructions(self, instructions: InstructionSet) -> Self {
        Self {
            decoder: self.decoder.with_instructions(instructions),
        }
    }

    /// Reports lost bytes before the next ones: see [`Decoder::lost`].
    pub fn lost(&mut self, bytes: u64) {
        self.decoder.lost(bytes);
    }

    /// Starts a new stream, for example after a restart of the device: see [`Decoder::restart`].
    pub fn restart(&mut self, origin_us: u64) {
        self.decoder.restart(origin_us);
    }

    /// Scans the next bytes. A word that is split between two chunks counts in the chunk that completes it.
    /// `first_us` and `last_us` are the times of the first and last timed word, in stream order.
    pub fn push(&mut self, bytes: &[u8]) -> (ChunkFacts, Vec<TriggerEdge>) {
        let mut triggers = Vec::new();
        let before = self.decoder.output.stats;
        self.decoder.output.begin_chunk();
        self.decoder.feed::<false>(bytes, &mut Edges(&mut triggers));
        let output = &self.decoder.output;
        let after = &output.stats;
        let facts = ChunkFacts {
            cd_events: after.cd_events() - before.cd_events(),
            on_events: after.cd_on - before.cd_on,
            trigger_edges: triggers.len() as u64,
            first_us: output.chunk_first_us,
            last_us: output.chunk_first_us.and(output.last_us),
        };
        (facts, triggers)
    }

    /// Counts since the start of the stream.
    #[must_use]
    pub fn stats(&self) -> StreamStats {
        self.decoder.stats()
    }
}
