//! Verification of one camera's chunks: their order, checksums, facts and trigger edges.

use sha2::{Digest, Sha256};
use skinrig_model::{CameraId, ChunkFacts, HostTime, StreamFormat, TriggerEdge};
use sqlx::Row;

use super::edges::{Fingerprint, fingerprint};
use super::report::VerifyReport;
use super::{ChunkScanner, gaps};
use crate::error::RecorderError;
use crate::query::sha;
use crate::reader::SessionReader;
use crate::rows::ChunkMeta;

/// The chunks of one camera.
pub(super) struct Stream {
    pub camera: CameraId,
    /// `None` without a readable header: the events are not decoded then.
    pub format: Option<StreamFormat>,
    pub index: Vec<ChunkMeta>,
}

impl Stream {
    /// Checks everything except the recorded trigger edges; returns the edges in the bytes of each chunk.
    pub(super) fn check<S: ChunkScanner>(
        &self,
        reader: &SessionReader,
        report: &mut VerifyReport,
    ) -> Vec<(u64, Fingerprint)> {
        let mut decoded = Vec::with_capacity(self.index.len());
        let result = self.check_with::<S>(reader, report, |meta, edges| {
            decoded.push((meta.seq, fingerprint(edges)));
            Ok(None)
        });
        report.ok_or_add(result);
        decoded
    }

    /// Checks everything, and looks up the recorded trigger edges of each chunk.
    pub(super) fn check_with_edges<S: ChunkScanner>(
        &self,
        reader: &SessionReader,
        report: &mut VerifyReport,
    ) {
        let result = self.check_with::<S>(reader, report, |meta, edges| {
            let recorded = reader.edges(self.camera, meta.seq as i64, meta.seq as i64)?;
            Ok((edges != recorded).then_some(recorded.len()))
        });
        report.ok_or_add(result);
    }

    /// `differ` returns the number of recorded edges if they differ from those in the bytes.
    fn check_with<S: ChunkScanner>(
        &self,
        reader: &SessionReader,
        report: &mut VerifyReport,
        mut differ: impl FnMut(&ChunkMeta, &[TriggerEdge]) -> Result<Option<usize>, RecorderError>,
    ) -> Result<(), RecorderError> {
        let camera = self.camera;
        let (mut previous, mut host) = (None, HostTime(i64::MIN));
        let mut scanner = self.format.map(S::new);
        let mut buffer = Vec::new();
        gaps::check(camera, &self.index, report);
        for meta in &self.index {
            let place = format!("{camera} chunk {}", meta.seq);
            let expected = previous.map_or(0, |p| p + 1);
            if meta.seq != expected {
                report.mismatch(
                    camera,
                    format!("chunk {expected}"),
                    format!("chunk {}", meta.seq),
                );
            }
            if meta.host_time < host {
                report.mismatch(&place, format!("host time from {host}"), meta.host_time);
            }
            (previous, host) = (Some(meta.seq), meta.host_time);
            let chunk = reader.query("checking a chunk", async |conn| {
                let sql = "SELECT stored, stored_sha256 FROM chunk WHERE camera = ? AND seq = ?";
                let query = sqlx::query(sql).bind(camera.number());
                let row = query.bind(meta.seq as i64).fetch_one(conn).await?;
                let stored: &[u8] = row.try_get("stored")?;
                let is_sound = Sha256::digest(stored).as_slice() == sha(&row, "stored_sha256")?;
                Ok((
                    is_sound,
                    reader
                        .unpack(meta, stored, &mut buffer)
                        .map(|raw| scanner.as_mut().map(|scanner| scan(scanner, meta, raw))),
                ))
            })?;
            let (is_sound, scanned) = chunk;
            if !is_sound {
                report.mismatch(&place, "the stored bytes of stored_sha256", "other bytes");
            }
            let Some(Some((facts, edges))) = report.ok_or_add(scanned) else {
                continue;
            };
            report.expect_equal(&format!("{place}: facts"), &facts, &meta.facts);
            if let Some(recorded) = differ(meta, &edges)? {
                report.mismatch(
                    &place,
                    format!("the {} trigger edges in its bytes", edges.len()),
                    format!("{recorded} different ones in trigger_edge"),
                );
            }
        }
        Ok(())
    }
}

/// Decodes a chunk, after the events before it.
fn scan<S: ChunkScanner>(
    scanner: &mut S,
    meta: &ChunkMeta,
    raw: &[u8],
) -> (ChunkFacts, Vec<TriggerEdge>) {
    if let Some(origin_us) = meta.restart_us {
        scanner.restart(origin_us);
    }
    if meta.lost_time.is_some() {
        scanner.lost(meta.lost_before);
    }
    scanner.scan(raw)
}
