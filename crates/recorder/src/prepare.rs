//! Preparation of records on a thread of its own: checks, hashes and folds camera bytes while SQLite writes earlier records.

use std::sync::Arc;

use sha2::{Digest, Sha256};
use skinrig_model::{RawChunk, Record, StreamFormat};

use crate::error::WriteFailure;
use crate::prepared::{PreparedChunk, PreparedGap, PreparedRecord, PreparedResult};
use crate::query::Fault;
use crate::queue::Shared;
use skinrig_formats::codec::{self, Codec};

/// Time of a camera's stream.
#[derive(Debug, Clone, Copy, Default)]
struct StreamClock {
    /// The latest time in the stream.
    last_us: Option<i64>,
    /// First chunk after lost bytes since which no time has arrived.
    open_gap: Option<i64>,
}

impl StreamClock {
    /// Advances by one chunk; returns the time lost before it and the gap that it ends.
    fn advance(
        &mut self,
        seq: i64,
        lost: bool,
        lost_from_us: Option<i64>,
        times_us: (Option<i64>, Option<i64>),
    ) -> (Option<PreparedGap>, Option<i64>) {
        let (first_us, last_us) = times_us;
        let gap = lost.then(|| PreparedGap {
            from_us: match (self.last_us, lost_from_us) {
                (Some(last), Some(from)) => Some(last.min(from)),
                (last, _) => last,
            },
            to_us: first_us,
        });
        let ends = self.open_gap.filter(|_| first_us.is_some());
        if first_us.is_some() {
            self.open_gap = None;
        } else if lost {
            self.open_gap.get_or_insert(seq);
        }
        self.last_us = last_us.or(self.last_us);
        (gap, ends)
    }
}

/// Notifies waiting callers if the thread panics.
struct PanicNotifier(Arc<Shared>);

impl Drop for PanicNotifier {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.fail(WriteFailure::PreparationPanicked);
        }
    }
}

/// Prepares records in order until the queue closes.
pub(crate) fn run(shared: &Arc<Shared>, mut preparer: Preparer) {
    let _notifier = PanicNotifier(Arc::clone(shared));
    while let Some((record, bytes)) = shared.next_to_prepare() {
        shared.push_prepared(preparer.prepare(record), bytes);
    }
}

/// State carried from record to record.
#[derive(Debug, Default)]
pub(crate) struct Preparer {
    /// Stream formats of the cameras; known once the run's header has arrived.
    pub formats: Option<[StreamFormat; 2]>,
    /// Number of the next chunk of each camera.
    pub next_seq: [u64; 2],
    /// Stream time of each camera in this leg.
    clocks: [StreamClock; 2],
}

impl Preparer {
    /// Preparer for a further leg: stream formats of its cameras, and the next chunk of each.
    pub(crate) fn resuming(formats: [StreamFormat; 2], next_seq: [u64; 2]) -> Self {
        Self {
            formats: Some(formats),
            next_seq,
            ..Self::default()
        }
    }
}

impl Preparer {
    fn prepare(&mut self, record: Record) -> PreparedResult {
        match record {
            Record::Chunk(chunk) => Ok(PreparedRecord::Chunk(Box::new(self.chunk(chunk)?))),
            other => {
                if let Record::Started(header) = &other {
                    self.formats = Some(header.stream_formats);
                }
                Ok(PreparedRecord::Record(other))
            }
        }
    }

    fn chunk(&mut self, chunk: RawChunk) -> Result<PreparedChunk, Fault> {
        let camera = chunk.camera.index();
        let place = format!("{} chunk {}", chunk.camera, chunk.seq);
        let next = self.next_seq[camera];
        if chunk.seq != next {
            return Err(Fault::bad(place, format!("chunk {next}"), chunk.seq));
        }
        if chunk.bytes.len() > codec::MAX_CHUNK_BYTES {
            let most = format!("at most {} bytes", codec::MAX_CHUNK_BYTES);
            return Err(Fault::bad(place, most, chunk.bytes.len()));
        }
        let facts = chunk.facts;
        if facts.trigger_edges != chunk.triggers.len() as u64 {
            let counted = format!(
                "the {} trigger edges that were counted",
                facts.trigger_edges
            );
            return Err(Fault::bad(place, counted, chunk.triggers.len()));
        }
        self.next_seq[camera] += 1;
        let edges: Vec<_> = chunk
            .triggers
            .iter()
            .map(|e| (e.t_us, e.channel, u8::from(e.rising)))
            .collect();
        let edges_json = (!edges.is_empty())
            .then(|| serde_json::to_string(&edges))
            .transpose()
            .map_err(|e| Fault::bad(&place, "edges", e))?;
        let signed = |value: u64| {
            i64::try_from(value).map_err(|_| Fault::bad(&place, "a number below 2^63", value))
        };
        let raw_bytes = signed(chunk.bytes.len() as u64)?;
        let raw_crc32 = crc32fast::hash(&chunk.bytes);
        let folded = match self.formats.map(|formats| formats[camera]) {
            Some(StreamFormat::Evt2) => codec::fold(&chunk.bytes),
            _ => None,
        };
        let (codec, stored) = match folded {
            Some(folded) => (Codec::TimeHighRuns, folded),
            None => (Codec::None, chunk.bytes),
        };
        let seq = signed(chunk.seq)?;
        let first_us = facts.first_us.map(signed).transpose()?;
        let last_us = facts.last_us.map(signed).transpose()?;
        let lost_from_us = chunk.lost_from_us.map(signed).transpose()?;
        let (gap, ends_gaps_from) = self.clocks[camera].advance(
            seq,
            chunk.lost_before > 0,
            lost_from_us,
            (first_us, last_us),
        );
        Ok(PreparedChunk {
            camera: chunk.camera,
            seq,
            host_time: chunk.host_time,
            lost_before: signed(chunk.lost_before)?,
            gap,
            ends_gaps_from,
            codec,
            raw_bytes,
            raw_crc32,
            stored_sha256: Sha256::digest(&stored).into(),
            first_us,
            last_us,
            cd_events: signed(facts.cd_events)?,
            on_events: signed(facts.on_events)?,
            trigger_edges: signed(facts.trigger_edges)?,
            stored,
            edges_json,
        })
    }
}
