//! Trigger edges of all chunks in one pass over their table, which also gives its digest.

use std::collections::HashMap;
use std::sync::mpsc::Sender;

use sha2::{Digest, Sha256};
use skinrig_model::{CameraId, TriggerEdge};

use crate::digest::{TableDigest, digest_table};
use crate::reader::SessionReader;

/// SHA-256 over the trigger edges of one chunk.
pub(super) type Fingerprint = [u8; 32];

/// Encoded value of an integer column: a type byte and its value.
const VALUE_BYTES: usize = 9;
const INTEGER: u8 = 1;

/// The recorded trigger edges, by chunk. Only proves that edges are recorded: differences need a closer look.
#[derive(Default)]
pub(super) struct RecordedEdges {
    chunks: HashMap<(u8, u64), Fingerprint>,
    /// Whether each row is valid and after the one before it.
    is_complete: bool,
}

impl RecordedEdges {
    /// Whether exactly the edges with these fingerprints are recorded for these chunks of `camera`.
    pub(super) fn contain(&self, camera: CameraId, decoded: &[(u64, Fingerprint)]) -> bool {
        let none = fingerprint(&[]);
        self.is_complete
            && decoded.iter().all(|(seq, edges)| {
                self.chunks.get(&(camera.number(), *seq)).unwrap_or(&none) == edges
            })
    }
}

/// Fingerprint of the edges of one chunk, in stream order.
pub(super) fn fingerprint(edges: &[TriggerEdge]) -> Fingerprint {
    let mut hash = Sha256::new();
    for edge in edges {
        let mut bytes = [0; 10];
        bytes[..8].copy_from_slice(&edge.t_us.to_le_bytes());
        bytes[8] = edge.channel;
        bytes[9] = edge.rising.into();
        hash.update(bytes);
    }
    hash.finalize().into()
}

/// Reads the table through a connection of its own; sends its digest, or `None` if it cannot be read.
pub(super) fn read(reader: &SessionReader, digest: &Sender<Option<TableDigest>>) -> RecordedEdges {
    let mut pass = Pass {
        recorded: RecordedEdges {
            is_complete: true,
            ..RecordedEdges::default()
        },
        last: None,
        edges: Vec::new(),
    };
    let table = reader.reopen().and_then(|reader| {
        reader.query("reading trigger edges", async |conn| {
            digest_table(conn, "trigger_edge", |row| pass.take(row)).await
        })
    });
    pass.finish_chunk();
    pass.recorded.is_complete &= table.is_ok();
    // The receiver ends early for a session without a seal.
    let _ = digest.send(table.ok().flatten());
    pass.recorded
}

/// A pass over the rows of `trigger_edge`.
struct Pass {
    recorded: RecordedEdges,
    /// Camera, chunk and position of the last row.
    last: Option<(u8, u64, u64)>,
    /// Edges of the last row's chunk so far.
    edges: Vec<TriggerEdge>,
}

impl Pass {
    fn take(&mut self, row: &[u8]) {
        let Some((key, edge)) = edge_of(row).filter(|(key, _)| self.last < Some(*key)) else {
            self.recorded.is_complete = false;
            return;
        };
        let is_next = |last: (u8, u64, u64)| (last.0, last.1) != (key.0, key.1);
        if self.last.is_some_and(is_next) {
            self.finish_chunk();
        }
        self.last = Some(key);
        self.edges.push(edge);
    }

    fn finish_chunk(&mut self) {
        if let Some((camera, seq, _)) = self.last {
            let edges = fingerprint(&self.edges);
            self.recorded.chunks.insert((camera, seq), edges);
        }
        self.edges.clear();
    }
}

/// Camera, chunk, position and edge of an encoded row; `None` if a value has another type or range.
fn edge_of(row: &[u8]) -> Option<((u8, u64, u64), TriggerEdge)> {
    let (values, []) = row.as_chunks::<VALUE_BYTES>() else {
        return None;
    };
    let values: &[_; 6] = values.try_into().ok()?;
    if values.iter().any(|value| value[0] != INTEGER) {
        return None;
    }
    let [camera, seq, position, t_us, channel, rising] =
        values.map(|[_, value @ ..]| i64::from_le_bytes(value));
    let edge = TriggerEdge {
        t_us: t_us.try_into().ok()?,
        channel: channel.try_into().ok()?,
        rising: rising != 0,
    };
    let key = (
        camera.try_into().ok()?,
        seq.try_into().ok()?,
        position.try_into().ok()?,
    );
    Some((key, edge))
}
