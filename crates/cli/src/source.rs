//! Events of a session for the analysis, and the decoder that the recorder's check borrows.

use std::path::{Path, PathBuf};

use skinrig_analysis::EventSource;
use skinrig_formats::{Decoder, Scanner};
use skinrig_model::{CameraId, CdEvent, ChunkFacts, StreamFormat, TriggerEdge};
use skinrig_recorder::{ChunkScanner, SessionReader};

/// The events of a session file, decoded chunk by chunk. Each pass opens the file anew, so that both cameras
/// can be read at once.
pub struct SessionEvents {
    path: PathBuf,
    formats: [StreamFormat; 2],
}

impl SessionEvents {
    /// The events of `path`, whose cameras send `formats`.
    #[must_use]
    pub fn new(path: &Path, formats: [StreamFormat; 2]) -> Self {
        Self {
            path: path.to_owned(),
            formats,
        }
    }
}

impl EventSource for SessionEvents {
    fn for_each_slice(
        &self,
        camera: CameraId,
        each: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), String> {
        let reader = SessionReader::open(&self.path).map_err(|e| e.to_string())?;
        let mut decoder = Decoder::new(self.formats[camera.index()]);
        reader
            .for_each_chunk(camera, 0, |meta, bytes| {
                if let Some(origin_us) = meta.restart_us {
                    decoder.restart(origin_us);
                }
                decoder.for_each_slice(bytes, &mut *each)
            })
            .map_err(|e| e.to_string())
    }
}

/// Decodes chunks again for `verify`.
#[derive(Default)]
pub struct Rescan {
    scanners: [Option<Scanner>; 2],
}

impl ChunkScanner for Rescan {
    fn scan(
        &mut self,
        camera: CameraId,
        format: StreamFormat,
        bytes: &[u8],
    ) -> (ChunkFacts, Vec<TriggerEdge>) {
        self.scanners[camera.index()]
            .get_or_insert_with(|| Scanner::new(format))
            .push(bytes)
    }

    fn restart(&mut self, camera: CameraId, format: StreamFormat, origin_us: u64) {
        self.scanners[camera.index()]
            .get_or_insert_with(|| Scanner::new(format))
            .restart(origin_us);
    }
}
