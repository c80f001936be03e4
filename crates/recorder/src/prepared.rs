//! Records on their way from the thread that prepares them to the one that writes.

use skinrig_model::{CameraId, HostTime, Record};

use crate::codec::Codec;
use crate::query::Fault;

/// A record that can be written, or why it cannot. It keeps its place in the order either way.
pub type Prepared = Result<Ready, Fault>;

/// A record that can be written.
#[derive(Debug)]
pub enum Ready {
    /// Camera bytes.
    Chunk(Box<PreparedChunk>),
    /// Anything else, as it came.
    Record(Record),
}

impl Ready {
    /// Whether it must be on the disk before the caller goes on.
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
    /// The time that was lost before it, as far as it is known by now; `None` without a loss.
    pub gap: Option<PreparedGap>,
    /// The first gap since which no time came, when this chunk's is the time that ends it and those after it.
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

/// Whether a record must be on the disk before the caller goes on.
pub(crate) fn is_durable(record: &Record) -> bool {
    matches!(
        record,
        Record::Started(_) | Record::Intent { .. } | Record::Outcome(_) | Record::Ended { .. }
    )
}
