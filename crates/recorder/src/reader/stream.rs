//! Reading camera bytes and their metadata, chunk by chunk.

use std::collections::BTreeMap;

use skinrig_model::{CameraId, LostTime, TriggerEdge};

use super::SessionReader;
use crate::error::RecorderError;
use crate::from_row::chunk_from;
use crate::query::{blob, each_row, has_table, int, num, opt_num};
use crate::rows::{ChunkMeta, Loss};
use skinrig_formats::codec::{self, Codec};

/// Metadata of all chunks, with their stored size.
const INDEX: &str = "SELECT camera, seq, host_ns, lost_before, codec, raw_bytes, raw_crc32, first_us, last_us, cd_events,
       on_events, trigger_edges, length(stored) AS stored_bytes
     FROM chunk WHERE camera = ? ORDER BY seq";

/// The same for the last chunks.
const TAIL: &str = "SELECT camera, seq, host_ns, lost_before, codec, raw_bytes, raw_crc32, first_us, last_us, cd_events,
       on_events, trigger_edges, length(stored) AS stored_bytes
     FROM chunk WHERE camera = ? ORDER BY seq DESC LIMIT ?";

/// The same for one chunk, with its stored bytes.
const NEXT: &str = "SELECT camera, seq, host_ns, lost_before, codec, raw_bytes, raw_crc32, first_us, last_us, cd_events,
       on_events, trigger_edges, length(stored) AS stored_bytes, stored
     FROM chunk WHERE camera = ? AND seq >= ? ORDER BY seq LIMIT 1";

impl SessionReader {
    /// Metadata of every chunk of `camera`, in stream order.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn chunk_index(&self, camera: CameraId) -> Result<Vec<ChunkMeta>, RecorderError> {
        let restarts = self.restarts(camera)?;
        let lost = self.lost_times(camera)?;
        self.query("reading the chunk index", async |conn| {
            let query = sqlx::query(INDEX).bind(camera.number());
            let mut index = Vec::new();
            each_row(query, conn, |row| {
                let mut meta = chunk_from(row)?;
                meta.restart_us = restarts.get(&meta.seq).copied();
                meta.lost_time = lost.get(&meta.seq).copied();
                index.push(meta);
                Ok(())
            })
            .await?;
            Ok(index)
        })
    }

    /// Metadata of the last `most` chunks of `camera`, in stream order. Reads no other chunks.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn last_chunks(
        &self,
        camera: CameraId,
        most: u32,
    ) -> Result<Vec<ChunkMeta>, RecorderError> {
        let restarts = self.restarts(camera)?;
        self.query("reading the chunk index", async |conn| {
            let query = sqlx::query(TAIL).bind(camera.number()).bind(most);
            let mut last = Vec::new();
            each_row(query, conn, |row| {
                let mut meta = chunk_from(row)?;
                meta.restart_us = restarts.get(&meta.seq).copied();
                last.push(meta);
                Ok(())
            })
            .await?;
            last.reverse();
            Ok(last)
        })
    }

    /// Raw bytes of one chunk, verified by checksum.
    ///
    /// # Errors
    /// [`RecorderError::NotFound`] beyond the last chunk; [`RecorderError::Damaged`].
    pub fn chunk_bytes(&self, camera: CameraId, seq: u64) -> Result<Vec<u8>, RecorderError> {
        match self.chunk_at_or_after(camera, seq)? {
            Some((meta, bytes)) if meta.seq == seq => Ok(bytes),
            _ => Err(RecorderError::NotFound {
                path: self.path.clone(),
                expected: format!("{camera} chunk {seq}"),
            }),
        }
    }

    /// The first chunk from `seq` on, with its verified raw bytes. The caller fills in whether it begins a leg and
    /// which time was lost before it.
    pub(crate) fn chunk_at_or_after(
        &self,
        camera: CameraId,
        seq: u64,
    ) -> Result<Option<(ChunkMeta, Vec<u8>)>, RecorderError> {
        let Ok(from) = i64::try_from(seq) else {
            return Ok(None);
        };
        let found = self.query("reading a chunk", async |conn| {
            let query = sqlx::query(NEXT).bind(camera.number()).bind(from);
            let row = query.fetch_optional(conn).await?;
            row.map(|row| Ok((chunk_from(&row)?, blob(&row, "stored")?)))
                .transpose()
        })?;
        let Some((meta, stored)) = found else {
            return Ok(None);
        };
        // In a damaged file, the search may find an earlier chunk again and again.
        if meta.seq < seq {
            let place = format!("{camera} chunk {}", meta.seq);
            return Err(self.damaged(
                place,
                "chunks in order",
                "this one after a later one".into(),
            ));
        }
        let mut buffer = Vec::new();
        self.unpack(&meta, &stored, &mut buffer)?;
        let bytes = match meta.codec {
            Codec::None => stored,
            Codec::TimeHighRuns => {
                buffer.truncate(meta.raw_bytes as usize);
                buffer
            }
        };
        Ok(Some((meta, bytes)))
    }

    /// Verified raw bytes of a chunk from its stored ones; `buffer` serves several chunks.
    pub(crate) fn unpack<'a>(
        &self,
        meta: &ChunkMeta,
        stored: &'a [u8],
        buffer: &'a mut Vec<u8>,
    ) -> Result<&'a [u8], RecorderError> {
        let place = || format!("{} chunk {}", meta.camera, meta.seq);
        let bytes = match meta.codec {
            Codec::None => stored,
            Codec::TimeHighRuns => codec::unfold_into(stored, meta.raw_bytes as usize, buffer)
                .map_err(|e| self.damaged(place(), "bytes that can be unfolded", e.to_string()))?,
        };
        if bytes.len() as u64 != meta.raw_bytes {
            let expected = format!("{} bytes", meta.raw_bytes);
            return Err(self.damaged(place(), &expected, bytes.len().to_string()));
        }
        let crc = crc32fast::hash(bytes);
        if crc != meta.raw_crc32 {
            let expected = format!("CRC-32 {:#010x}", meta.raw_crc32);
            return Err(self.damaged(place(), &expected, format!("{crc:#010x}")));
        }
        Ok(bytes)
    }

    /// Calls `each` with every chunk of `camera` from number `from_seq` on, in stream order, with its raw bytes.
    /// One chunk is in memory at a time. `each` may use this reader.
    ///
    /// # Errors
    /// At the first damaged chunk, after passing on all earlier ones.
    pub fn for_each_chunk(
        &self,
        camera: CameraId,
        from_seq: u64,
        mut each: impl FnMut(ChunkMeta, &[u8]),
    ) -> Result<(), RecorderError> {
        self.for_each_chunk_while(camera, from_seq, |meta, bytes| {
            each(meta, bytes);
            true
        })
    }

    /// [`Self::for_each_chunk`] that ends after the first chunk for which `each` returns false.
    ///
    /// # Errors
    /// At the first damaged chunk, after passing on all earlier ones.
    pub fn for_each_chunk_while(
        &self,
        camera: CameraId,
        from_seq: u64,
        mut each: impl FnMut(ChunkMeta, &[u8]) -> bool,
    ) -> Result<(), RecorderError> {
        let restarts = self.restarts(camera)?;
        let lost = self.lost_times(camera)?;
        let mut next = from_seq;
        while let Some((mut meta, bytes)) = self.chunk_at_or_after(camera, next)? {
            meta.restart_us = restarts.get(&meta.seq).copied();
            meta.lost_time = lost.get(&meta.seq).copied();
            next = meta.seq + 1;
            if !each(meta, &bytes) {
                break;
            }
        }
        Ok(())
    }

    /// Contents of the gap table by chunk; empty before schema 6.
    fn lost_times(&self, camera: CameraId) -> Result<BTreeMap<u64, LostTime>, RecorderError> {
        self.query("reading the gaps", async |conn| {
            let mut times = BTreeMap::new();
            if !has_table(conn, "gap").await? {
                return Ok(times);
            }
            let query =
                sqlx::query("SELECT seq, from_us, to_us FROM gap WHERE camera = ? ORDER BY seq");
            each_row(query.bind(camera.number()), conn, |row| {
                let time = LostTime {
                    from_us: opt_num(row, "from_us")?,
                    to_us: opt_num(row, "to_us")?,
                };
                times.insert(num(row, "seq")?, time);
                Ok(())
            })
            .await?;
            Ok(times)
        })
    }

    /// Losses of `camera` in stream order, also across legs: from the last valid time before to the first time after.
    /// Losses with no time between them are merged.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn losses(&self, camera: CameraId) -> Result<Vec<Loss>, RecorderError> {
        let mut losses = Vec::new();
        let (mut last_us, mut open) = (None, None::<Loss>);
        for chunk in self.chunk_index(camera)? {
            if chunk.lost_before > 0 {
                let reported_us = chunk.lost_time.and_then(|t| t.from_us);
                let loss = open.get_or_insert(Loss {
                    seq: chunk.seq,
                    bytes: 0,
                    time: LostTime {
                        from_us: last_us,
                        to_us: None,
                    },
                });
                loss.bytes = loss.bytes.saturating_add(chunk.lost_before);
                // A device may report an earlier start of the loss.
                let from_us = [loss.time.from_us, reported_us];
                loss.time.from_us = from_us.into_iter().flatten().min();
            }
            if let (Some(first), Some(last)) = (chunk.facts.first_us, chunk.facts.last_us) {
                if let Some(mut loss) = open.take() {
                    loss.time.to_us = Some(first);
                    losses.push(loss);
                }
                last_us = Some(last);
            }
        }
        losses.extend(open);
        Ok(losses)
    }

    /// Camera-time intervals `(from_us, to_us)` of lost bytes of `camera`, like [`Self::losses`]; 0 and `u64::MAX` for an
    /// unknown end.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn gaps(&self, camera: CameraId) -> Result<Vec<(u64, u64)>, RecorderError> {
        let losses = self.losses(camera)?;
        Ok(losses.iter().map(|loss| loss.time.bounds_us()).collect())
    }

    /// Camera-time intervals `(from_us, to_us)` in which `camera` was recording: one per leg, from the first to the last time in
    /// its stream.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn recorded_intervals(&self, camera: CameraId) -> Result<Vec<(u64, u64)>, RecorderError> {
        let mut spans: Vec<(u64, u64)> = Vec::new();
        let mut is_new = true;
        for chunk in self.chunk_index(camera)? {
            is_new |= chunk.restart_us.is_some();
            if let (Some(first), Some(last)) = (chunk.facts.first_us, chunk.facts.last_us) {
                match spans.last_mut().filter(|_| !is_new) {
                    Some(span) => *span = (span.0.min(first), span.1.max(last)),
                    None => spans.push((first, last)),
                }
                is_new = false;
            }
        }
        Ok(spans)
    }

    /// The trigger edges of `camera`, in stream order, all channels.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn trigger_edges(&self, camera: CameraId) -> Result<Vec<TriggerEdge>, RecorderError> {
        self.edges(camera, 0, i64::MAX)
    }

    /// The trigger edges of one chunk.
    pub(crate) fn edges(
        &self,
        camera: CameraId,
        from_seq: i64,
        to_seq: i64,
    ) -> Result<Vec<TriggerEdge>, RecorderError> {
        self.query("reading trigger edges", async |conn| {
            let query = sqlx::query(
                "SELECT t_us, channel, rising FROM trigger_edge
                 WHERE camera = ? AND seq BETWEEN ? AND ? ORDER BY seq, position",
            );
            let mut edges = Vec::new();
            let query = query.bind(camera.number()).bind(from_seq).bind(to_seq);
            each_row(query, conn, |row| {
                edges.push(TriggerEdge {
                    t_us: num(row, "t_us")?,
                    channel: num(row, "channel")?,
                    rising: int(row, "rising")? != 0,
                });
                Ok(())
            })
            .await?;
            Ok(edges)
        })
    }
}
