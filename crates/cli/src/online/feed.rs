//! A recorded session as a live source: the bytes of both cameras in packets, as they would arrive.

use skinrig_analysis::result::ClockFit;
use skinrig_model::CameraId;
use skinrig_recorder::{ChunkMeta, RecorderError, SessionReader};

/// Bytes of a packet: at most 16 ms of an idle camera.
const PACKET: usize = 4096;

/// Stream of one camera.
struct CameraFeed {
    camera: CameraId,
    chunks: std::vec::IntoIter<ChunkMeta>,
    bytes: Vec<u8>,
    at: usize,
    lost: u64,
}

impl CameraFeed {
    fn open(reader: &SessionReader, camera: CameraId) -> Result<Self, RecorderError> {
        Ok(Self {
            camera,
            chunks: reader.chunk_index(camera)?.into_iter(),
            bytes: Vec::new(),
            at: 0,
            lost: 0,
        })
    }

    /// Reads the next chunk if the current one is used up; false at the end.
    fn fill(&mut self, reader: &SessionReader) -> Result<bool, RecorderError> {
        while self.at == self.bytes.len() {
            let Some(chunk) = self.chunks.next() else {
                return Ok(false);
            };
            self.lost += chunk.lost_before;
            (self.bytes, self.at) = (reader.chunk_bytes(self.camera, chunk.seq)?, 0);
        }
        Ok(true)
    }
}

/// Both cameras.
pub(super) struct Feed<'a> {
    reader: &'a SessionReader,
    cameras: [CameraFeed; 2],
    clocks: [ClockFit; 2],
}

/// The next bytes of a camera.
pub(super) struct Packet<'a> {
    pub(super) camera: CameraId,
    /// Bytes lost before it.
    pub(super) lost: u64,
    pub(super) bytes: &'a [u8],
}

impl<'a> Feed<'a> {
    pub(super) fn open(
        reader: &'a SessionReader,
        clocks: [ClockFit; 2],
    ) -> Result<Self, RecorderError> {
        let cameras = [
            CameraFeed::open(reader, CameraId::One)?,
            CameraFeed::open(reader, CameraId::Two)?,
        ];
        Ok(Self {
            reader,
            cameras,
            clocks,
        })
    }

    /// The next packet of the camera that is behind in host time, by the newest times of the cameras so far, µs; `None` when a camera
    /// has ended.
    pub(super) fn next(
        &mut self,
        newest_us: [Option<u64>; 2],
    ) -> Result<Option<Packet<'_>>, RecorderError> {
        let host_us = |k: usize| {
            newest_us[k].map_or(f64::NEG_INFINITY, |us| {
                self.clocks[k].host_us_of_camera(us as f64)
            })
        };
        let behind = usize::from(host_us(1) < host_us(0));
        let own = &mut self.cameras[behind];
        if !own.fill(self.reader)? {
            return Ok(None);
        }
        let from = own.at;
        own.at = (from + PACKET).min(own.bytes.len());
        Ok(Some(Packet {
            camera: own.camera,
            lost: std::mem::take(&mut own.lost),
            bytes: &own.bytes[from..own.at],
        }))
    }
}
