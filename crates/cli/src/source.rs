//! Events of a session for the analysis, and the decoder that the recorder's check borrows.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use skinrig_analysis::{EventSource, LegStart};
use skinrig_formats::{Decoder, Scanner};
use skinrig_model::{CameraId, CdEvent, ChunkFacts, StreamFormat, TriggerEdge};
use skinrig_recorder::{ChunkScanner, SessionReader};

/// The events of a session file, decoded chunk by chunk. Each pass opens the file anew, so that both cameras
/// can be read at once.
pub struct SessionEvents {
    path: PathBuf,
    formats: [StreamFormat; 2],
    /// By how much the times of each further leg are moved, by where they were recorded.
    moves: [BTreeMap<u64, i64>; 2],
}

impl SessionEvents {
    /// The events of `path`, whose cameras send `formats`, in the camera times of its aligned `legs`.
    #[must_use]
    pub fn new(path: &Path, formats: [StreamFormat; 2], legs: &[LegStart]) -> Self {
        // Of legs that begin at the same camera time only the last has events.
        let recorded = |leg: &LegStart, k: usize| (leg.recorded_us[k], leg.moved_us[k]);
        Self {
            path: path.to_owned(),
            formats,
            moves: [0, 1].map(|k| legs.iter().map(|leg| recorded(leg, k)).collect()),
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
        let moves = &self.moves[camera.index()];
        let mut decoder = Decoder::new(self.formats[camera.index()]);
        reader
            .for_each_chunk(camera, 0, |meta, bytes| {
                if let Some(origin_us) = meta.restart_us {
                    let by = moves.get(&origin_us).copied().unwrap_or_default();
                    decoder.restart(origin_us.saturating_add_signed(by));
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
