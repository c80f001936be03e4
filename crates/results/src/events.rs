//! Owns the events of a session as input of the analysis, and the decoder used by the recorder's check.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use skinrig_analysis::{EventSource, EventSourceError, LegStart};
use skinrig_formats::{Decoder, Geometry, Scanner};
use skinrig_model::{CameraId, CdEvent, ChunkFacts, StreamFormat, TriggerEdge};
use skinrig_recorder::{ChunkScanner, SessionReader};

/// Events of a session file, decoded chunk by chunk. Each pass opens the file again, so that both cameras can be read in
/// parallel.
pub struct SessionEvents {
    path: PathBuf,
    formats: [StreamFormat; 2],
    /// Time shift of each further leg, by its recorded start.
    moves: [BTreeMap<u64, i64>; 2],
    bytes_read: Arc<AtomicU64>,
    stop: Option<Arc<AtomicBool>>,
}

/// A pass over the events was cancelled.
#[derive(Debug, thiserror::Error)]
#[error("reading the events was stopped")]
pub(crate) struct PassStopped;

impl SessionEvents {
    /// Events of `path`, whose cameras send `formats`, in the camera times of its aligned `legs`.
    #[must_use]
    pub fn new(path: &Path, formats: [StreamFormat; 2], legs: &[LegStart]) -> Self {
        // Of legs with the same camera start time only the last has events.
        let recorded = |leg: &LegStart, k: usize| (leg.recorded_us[k], leg.moved_us[k]);
        Self {
            path: path.to_owned(),
            formats,
            moves: [0, 1].map(|k| legs.iter().map(|leg| recorded(leg, k)).collect()),
            bytes_read: Arc::default(),
            stop: None,
        }
    }

    /// Ends each pass with an error, at the next chunk, once `stop` is set. The file is closed then.
    #[must_use]
    pub fn stopping_on(mut self, stop: Arc<AtomicBool>) -> Self {
        self.stop = Some(stop);
        self
    }

    /// Camera bytes read so far, over all passes; for the display of progress.
    #[must_use]
    pub fn bytes_read(&self) -> Arc<AtomicU64> {
        Arc::clone(&self.bytes_read)
    }
}

impl EventSource for SessionEvents {
    fn for_each_slice(
        &self,
        camera: CameraId,
        each: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), EventSourceError> {
        let reader = SessionReader::open(&self.path)?;
        let moves = &self.moves[camera.index()];
        let mut legs = LegDecoder::new(self.formats[camera.index()]);
        let is_stopped = || {
            self.stop
                .as_ref()
                .is_some_and(|s| s.load(Ordering::Relaxed))
        };
        reader.for_each_chunk_while(camera, 0, |meta, bytes| {
            if let Some(origin_us) = meta.restart_us {
                legs.restart(
                    origin_us,
                    moves.get(&origin_us).copied().unwrap_or_default(),
                );
            }
            legs.lost(meta.lost_before);
            legs.for_each_slice(bytes, each);
            let read = bytes.len() as u64;
            self.bytes_read.fetch_add(read, Ordering::Relaxed);
            !is_stopped()
        })?;
        if is_stopped() {
            return Err(PassStopped.into());
        }
        Ok(())
    }
}

/// Decodes leg after leg and shifts each event like the edges of its leg.
struct LegDecoder {
    decoder: Decoder,
    /// Remaining shift: 0, except for a leg that would begin below zero, where no decoder can begin.
    by_us: i64,
    moved: Vec<CdEvent>,
}

impl LegDecoder {
    fn new(format: StreamFormat) -> Self {
        // Deliver events outside the sensor too: the analysis counts and ignores them.
        Self {
            decoder: Decoder::with_geometry(format, Geometry::ANY),
            by_us: 0,
            moved: Vec::new(),
        }
    }

    /// Starts the next leg, recorded from `origin_us` on and shifted by `by_us`.
    fn restart(&mut self, origin_us: u64, by_us: i64) {
        let (begin_us, rest_us) = match origin_us.checked_add_signed(by_us) {
            Some(moved_us) => (moved_us, 0),
            None => (origin_us, by_us),
        };
        self.decoder.restart(begin_us);
        self.by_us = rest_us;
    }

    /// Notes lost bytes: events get times again from the next time base word on.
    fn lost(&mut self, bytes: u64) {
        self.decoder.lost(bytes);
    }

    fn for_each_slice(&mut self, bytes: &[u8], each: &mut dyn FnMut(&[CdEvent])) {
        let Self {
            decoder,
            by_us,
            moved,
        } = self;
        decoder.for_each_slice(bytes, |events| {
            if *by_us == 0 {
                return each(events);
            }
            moved.clear();
            moved.extend(events.iter().map(|event| CdEvent {
                t_us: event.t_us.saturating_add_signed(*by_us),
                ..*event
            }));
            each(moved);
        });
    }
}

/// Decodes chunks again for `verify`.
pub struct Rescan(Scanner);

impl ChunkScanner for Rescan {
    fn new(format: StreamFormat) -> Self {
        Self(Scanner::new(format))
    }

    fn scan(&mut self, bytes: &[u8]) -> (ChunkFacts, Vec<TriggerEdge>) {
        self.0.push(bytes)
    }

    fn lost(&mut self, bytes: u64) {
        self.0.lost(bytes);
    }

    fn restart(&mut self, origin_us: u64) {
        self.0.restart(origin_us);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times of the events of an EVT2 leg with events at 100, 700 and 200 000 µs.
    fn times(restart: impl Fn(&mut LegDecoder)) -> Vec<u64> {
        let word = |t: u64| [0x8000_0000 | (t >> 6) as u32, ((t & 63) as u32) << 22];
        let words = [100, 700, 200_000].into_iter().flat_map(word);
        let bytes: Vec<u8> = words.flat_map(u32::to_le_bytes).collect();
        let mut legs = LegDecoder::new(StreamFormat::Evt2);
        restart(&mut legs);
        let mut times = Vec::new();
        legs.for_each_slice(&bytes, &mut |events| {
            times.extend(events.iter().map(|e| e.t_us))
        });
        times
    }

    #[test]
    fn events_are_moved_as_the_edges_of_their_leg() {
        let recorded_us = times(|legs| legs.restart(5_000_000, 0));
        assert_eq!(recorded_us, [5_000_100, 5_000_700, 5_200_000]);
        // The last three would begin below zero.
        for by in [7, -7, -5_000_000, -5_000_001, -5_000_300, -9_000_000] {
            let edges = recorded_us.iter().map(|t| t.saturating_add_signed(by));
            let events = times(|legs| legs.restart(5_000_000, by));
            assert!(events.iter().copied().eq(edges), "by {by}: {events:?}");
        }
        // The remaining shift ends with the leg.
        let next = times(|legs| {
            legs.restart(5_000_000, -5_000_300);
            legs.restart(6_000_000, 1);
        });
        assert_eq!(next, [6_000_101, 6_000_701, 6_200_001]);
    }
}
