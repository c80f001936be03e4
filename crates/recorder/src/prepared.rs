//! Records between the preparation thread and the writer thread.

use skinrig_model::{CameraId, HostTime, Record};

use crate::query::Fault;
use skinrig_formats::codec::Codec;

/// A record ready to write, or the reason why it cannot be written. Keeps its place in the order either way.
pub(crate) type PreparedResult = Result<PreparedRecord, Fault>;

/// A record ready to write.
#[derive(Debug)]
pub(crate) enum PreparedRecord {
    /// Camera bytes.
    Chunk(Box<PreparedChunk>),
    /// Any other record, unchanged.
    Record(Record),
}

impl PreparedRecord {
    /// Whether it must be on disk before the caller continues.
    pub(crate) fn is_durable(&self) -> bool {
        matches!(self, Self::Record(record) if is_durable(record))
    }
}

/// A row of `chunk`, and the rows of `trigger_edge` that belong to it.
#[derive(Debug)]
pub(crate) struct PreparedChunk {
    pub camera: CameraId,
    pub seq: i64,
    pub host_time: HostTime,
    pub lost_before: i64,
    /// Time lost before it, as far as known; `None` without a loss.
    pub gap: Option<PreparedGap>,
    /// The chunk of the first gap that this chunk's first time ends. It also ends all later open gaps.
    pub ends_gaps_from: Option<i64>,
    pub codec: Codec,
    pub raw_bytes: i64,
    pub raw_crc32: u32,
    pub stored_sha256: [u8; 32],
    pub first_us: Option<i64>,
    pub last_us: Option<i64>,
    pub cd_events: i64,
    pub on_events: i64,
    pub trigger_edges: i64,
    pub stored: Vec<u8>,
    /// `[[t_us, channel, rising], ...]`; `None` without edges.
    pub edges_json: Option<String>,
}

/// A row of `gap`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PreparedGap {
    pub from_us: Option<i64>,
    pub to_us: Option<i64>,
}

/// Whether a record must be on disk before the caller continues.
pub(crate) fn is_durable(record: &Record) -> bool {
    matches!(
        record,
        Record::Started(_) | Record::Intent { .. } | Record::Outcome(_) | Record::Ended { .. }
    )
}
