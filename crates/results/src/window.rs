//! Owns the events of a short interval of camera time, decoded from the few chunks that hold them.

use skinrig_formats::Decoder;
use skinrig_model::{CameraId, CdEvent, StreamFormat};
use skinrig_recorder::{ChunkMeta, RecorderError, SessionReader};

/// A decoder that begins in the middle of a stream reads at least this many bytes before its first event counts. Cameras repeat
/// time, row and column words within a few hundred bytes.
const LEAD_IN_BYTES: u64 = 1 << 16;

/// The chunks of a camera, and where in its leg each one begins.
#[derive(Debug, Clone)]
pub struct ChunkIndex {
    camera: CameraId,
    format: StreamFormat,
    chunks: Vec<ChunkMeta>,
    /// Bytes of the leg before each chunk, lost ones included.
    offsets: Vec<u64>,
}

impl ChunkIndex {
    /// Reads the index of `camera`, which sends `format`.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn read(
        reader: &SessionReader,
        camera: CameraId,
        format: StreamFormat,
    ) -> Result<Self, RecorderError> {
        let chunks = reader.chunk_index(camera)?;
        let mut offset = 0u64;
        let offsets = chunks.iter().map(|chunk| {
            if chunk.restart_us.is_some() {
                offset = 0;
            }
            let begin = offset.saturating_add(chunk.lost_before);
            offset = begin.saturating_add(chunk.raw_bytes);
            begin
        });
        Ok(Self {
            camera,
            format,
            offsets: offsets.collect(),
            chunks,
        })
    }

    /// Positions of the chunks that may hold events of `from_us..=to_us`, in stream order.
    fn holding(&self, from_us: u64, to_us: u64) -> impl Iterator<Item = usize> {
        let may_hold = move |chunk: &ChunkMeta| match (chunk.facts.first_us, chunk.facts.last_us) {
            (Some(first), Some(last)) => first.min(last) <= to_us && from_us <= last.max(first),
            _ => false,
        };
        (0..self.chunks.len()).filter(move |&at| may_hold(&self.chunks[at]))
    }

    /// First chunk to decode for the events of chunk `at`: the start of its leg, or far enough before it.
    fn lead_in(&self, at: usize) -> usize {
        let mut first = at;
        let mut bytes = 0;
        while first > 0
            && self.chunks[first].restart_us.is_none()
            && (bytes < LEAD_IN_BYTES || self.chunks[first].facts.last_us.is_none())
        {
            first -= 1;
            bytes += self.chunks[first].raw_bytes;
        }
        first
    }
}

/// Calls `each` with the CD events of `from_us <= t <= to_us` in stream order, in camera times as recorded, the same events that
/// decoding the whole stream finds.
///
/// # Errors
/// When a chunk cannot be read.
pub fn events_between(
    reader: &SessionReader,
    index: &ChunkIndex,
    (from_us, to_us): (u64, u64),
    mut each: impl FnMut(CdEvent),
) -> Result<(), RecorderError> {
    let mut stream = Stream::new(index);
    for at in index.holding(from_us, to_us) {
        stream.go_to(reader, at)?;
        stream.decode(reader, at, |events| {
            let within = events
                .iter()
                .filter(|e| (from_us..=to_us).contains(&e.t_us));
            within.for_each(|event| each(*event));
        })?;
    }
    Ok(())
}

/// A decoder within a stream.
struct Stream<'a> {
    index: &'a ChunkIndex,
    decoder: Decoder,
    /// The chunk that the decoder expects.
    next: Option<usize>,
    /// Added to its times: whole ranges of the time base, passed before it began.
    ahead_us: u64,
}

impl<'a> Stream<'a> {
    fn new(index: &'a ChunkIndex) -> Self {
        Self {
            index,
            decoder: Decoder::new(index.format),
            next: None,
            ahead_us: 0,
        }
    }

    /// Prepares the decoder for chunk `at`.
    fn go_to(&mut self, reader: &SessionReader, at: usize) -> Result<(), RecorderError> {
        if self.next == Some(at) {
            return Ok(());
        }
        let first = self.index.lead_in(at);
        if self.next.is_none_or(|next| next < first) || self.next > Some(at) {
            let chunk = &self.index.chunks[first];
            self.decoder = Decoder::new(self.index.format);
            self.ahead_us = 0;
            // The chunk may begin within a word.
            self.decoder
                .lost(self.index.offsets[first] - chunk.lost_before);
            self.next = Some(first);
        }
        for before in self.next.unwrap_or(first)..at {
            self.decode(reader, before, |_| {})?;
        }
        Ok(())
    }

    fn decode(
        &mut self,
        reader: &SessionReader,
        at: usize,
        mut each: impl FnMut(&[CdEvent]),
    ) -> Result<(), RecorderError> {
        let chunk = &self.index.chunks[at];
        if let Some(origin_us) = chunk.restart_us {
            self.decoder.restart(origin_us);
            self.ahead_us = 0;
        }
        self.decoder.lost(chunk.lost_before);
        let bytes = reader.chunk_bytes(self.index.camera, chunk.seq)?;
        let (ahead_us, mut moved) = (self.ahead_us, Vec::new());
        self.decoder.for_each_slice(&bytes, |events| {
            if ahead_us == 0 {
                return each(events);
            }
            moved.clear();
            moved.extend(events.iter().map(|event| CdEvent {
                t_us: event.t_us.wrapping_add(ahead_us),
                ..*event
            }));
            each(&moved);
        });
        // The index has the times of a decoder that began at the start of the leg.
        if let (Some(recorded), Some(decoded)) = (chunk.facts.last_us, self.decoder.last_us()) {
            self.ahead_us = recorded.wrapping_sub(decoded);
        }
        self.next = Some(at + 1);
        Ok(())
    }
}
