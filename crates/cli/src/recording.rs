//! A session file as the recording that a replayed rig reads.

use std::collections::VecDeque;
use std::path::Path;

use skinrig_formats::Scanner;
use skinrig_model::{
    BoxReport, CameraId, DeviceIdentity, DeviceRole, HostDuration, HostTime, MotionCommand,
    PoseSample, RawChunk, RunHeader, SentMark, Setting,
};
use skinrig_recorder::{ChunkMeta, DeviceRow, RecorderError, SessionReader};
use skinrig_sim::replay::{Recording, RecordingError};

/// Poses are read in pieces of this length.
const POSE_WINDOW: HostDuration = HostDuration::from_millis(2_000);
/// In a session without an end, poses are read up to this long after the last command.
const UNENDED: HostDuration = HostDuration::from_millis(60_000);

/// A session file, streamed.
pub(crate) struct SessionRecording {
    reader: SessionReader,
    devices: Vec<DeviceRow>,
    commands: VecDeque<(HostTime, MotionCommand)>,
    marks: VecDeque<SentMark>,
    reports: VecDeque<(HostTime, BoxReport)>,
    chunks: [VecDeque<ChunkMeta>; 2],
    scanners: [Scanner; 2],
    poses_from: HostTime,
    poses_end: HostTime,
}

impl SessionRecording {
    /// Opens the session at `path`.
    ///
    /// # Errors
    /// [`RecorderError`] when it cannot be read.
    pub(crate) fn open(path: &Path, header: &RunHeader) -> Result<Self, RecorderError> {
        let reader = SessionReader::open(path)?;
        let [one, two] = CameraId::ALL;
        // A session that was cut off has no end; nothing of interest is long after its last command.
        let poses_end = match reader.end()? {
            Some((t, _)) => t,
            None => reader.commands()?.last().map_or(HostTime::ZERO, |c| c.t) + UNENDED,
        };
        Ok(Self {
            devices: reader.devices()?,
            commands: reader
                .commands()?
                .into_iter()
                .map(|c| (c.t, c.command))
                .collect(),
            marks: reader.marks_sent()?.into(),
            reports: reader.box_reports()?.into(),
            chunks: [
                reader.chunk_index(one)?.into(),
                reader.chunk_index(two)?.into(),
            ],
            scanners: header.stream_formats.map(Scanner::new),
            poses_from: HostTime::ZERO,
            poses_end,
            reader,
        })
    }

    fn device(&self, role: DeviceRole) -> Option<&DeviceRow> {
        self.devices.iter().find(|d| d.role == role)
    }
}

fn unreadable(e: RecorderError) -> RecordingError {
    RecordingError(e.to_string())
}

impl Recording for SessionRecording {
    fn identity(&self, role: DeviceRole) -> Option<DeviceIdentity> {
        self.device(role).map(|d| d.identity.clone())
    }

    fn settings(&self, role: DeviceRole) -> Vec<Setting> {
        self.device(role)
            .map(|d| d.settings.clone())
            .unwrap_or_default()
    }

    fn next_command(&mut self) -> Result<Option<(HostTime, MotionCommand)>, RecordingError> {
        Ok(self.commands.pop_front())
    }

    fn next_poses(&mut self) -> Result<Option<Vec<PoseSample>>, RecordingError> {
        while self.poses_from <= self.poses_end {
            let to = self.poses_from + POSE_WINDOW;
            let poses = self.reader.poses(self.poses_from, to).map_err(unreadable)?;
            // A piece includes both ends.
            self.poses_from = to + HostDuration(1);
            if !poses.is_empty() {
                return Ok(Some(poses));
            }
        }
        Ok(None)
    }

    fn next_mark(&mut self) -> Result<Option<SentMark>, RecordingError> {
        Ok(self.marks.pop_front())
    }

    fn next_box_report(&mut self) -> Result<Option<(HostTime, BoxReport)>, RecordingError> {
        Ok(self.reports.pop_front())
    }

    fn next_chunk(&mut self, camera: CameraId) -> Result<Option<RawChunk>, RecordingError> {
        let Some(meta) = self.chunks[camera.index()].pop_front() else {
            return Ok(None);
        };
        let bytes = self
            .reader
            .chunk_bytes(camera, meta.seq)
            .map_err(unreadable)?;
        // The stored facts are those of the first decoding; the edges come from decoding again.
        let scanner = &mut self.scanners[camera.index()];
        if meta.lost_time.is_some() {
            scanner.lost(meta.lost_before);
        }
        let (_, triggers) = scanner.push(&bytes);
        Ok(Some(RawChunk {
            camera,
            seq: meta.seq,
            host_time: meta.host_time,
            lost_before: meta.lost_before,
            lost_from_us: meta.lost_time.and_then(|t| t.from_us),
            bytes,
            facts: meta.facts,
            triggers,
        }))
    }
}
