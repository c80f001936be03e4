//! Rows of a session as plain values.

use serde::Serialize;
use skinrig_model::{
    AttemptId, CameraId, ChunkFacts, DeviceIdentity, DeviceRole, HostTime, InterruptionKind,
    LostTime, MotionCommand, PressOutcome, ResumeHeader, RunEnd, Setting,
};

use crate::codec::Codec;

/// A device as it introduced itself, with its settings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceRow {
    /// What it is for.
    pub role: DeviceRole,
    /// Who it says it is.
    pub identity: DeviceIdentity,
    /// Its settings, asked for and read back, in the order in which they were written.
    pub settings: Vec<Setting>,
}

/// One leg of a session: one life of the process that ran it. The first has number 1 and begins at zero of everything.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LegRow {
    /// 1, 2, 3, ...
    pub number: u32,
    /// Who began it, when, with what.
    pub began: ResumeHeader,
    /// Where its host clock begins on the session's. No time of an earlier leg is at or after it.
    pub origin: HostTime,
    /// Where each camera's clock begins on the session's, µs.
    pub camera_origin_us: [u64; 2],
    /// Number of each camera's first chunk; there is none of that number when the leg ended before it.
    pub first_seq: [u64; 2],
    /// How many of [`devices`](crate::SessionReader::devices) belong to earlier legs.
    pub devices_before: usize,
    /// How many of [`preflight`](crate::SessionReader::preflight) belong to earlier legs.
    pub preflight_before: usize,
    /// When and how it ended; `None`: under way or cut off.
    pub end: Option<(HostTime, RunEnd)>,
    /// The tree hash that it was sealed with before the next leg took the seal off, or that the session has.
    pub tree_sha256: Option<[u8; 32]>,
}

/// One attempt at a press.
#[derive(Debug, Clone, PartialEq)]
pub struct AttemptRow {
    /// Which.
    pub id: AttemptId,
    /// Number of the attempt that it repeats.
    pub previous: Option<u32>,
    /// When it was about to begin; `None` for a press that was never attempted.
    pub intent: Option<HostTime>,
    /// How it ended; `None` while it runs, and for ever when it was cut off.
    pub outcome: Option<PressOutcome>,
}

/// A motion command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandRow {
    /// When.
    pub t: HostTime,
    /// What.
    pub command: MotionCommand,
}

/// Something that broke the normal course.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InterruptionRow {
    /// When.
    pub t: HostTime,
    /// What.
    pub kind: InterruptionKind,
    /// In words.
    pub reason: String,
}

/// A remark.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoteRow {
    /// When.
    pub t: HostTime,
    /// The remark.
    pub text: String,
}

/// A chunk without its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChunkMeta {
    /// Which camera.
    pub camera: CameraId,
    /// Its number, from 0.
    pub seq: u64,
    /// When its last byte reached the host.
    pub host_time: HostTime,
    /// Bytes lost before it.
    pub lost_before: u64,
    /// The time that was lost with them. `None` without a loss, and where the session does not tell: one of a schema before 6, and a
    /// place that a salvage left empty. When it is there, the facts are those of a decoder that carried nothing over.
    pub lost_time: Option<LostTime>,
    /// How it is stored.
    pub codec: Codec,
    /// Bytes as they came.
    pub raw_bytes: u64,
    /// Bytes in the file.
    pub stored_bytes: u64,
    /// CRC-32 (zlib) of the bytes as they came.
    pub raw_crc32: u32,
    /// What one decoding in stream order found.
    pub facts: ChunkFacts,
    /// Set on the first chunk of a further leg: these bytes do not go on from those before. Their decoder starts anew, and the
    /// times that it finds are moved by this, µs.
    pub restart_us: Option<u64>,
}

/// Bytes of a camera that were lost, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loss {
    /// The chunk before which they were lost.
    pub seq: u64,
    /// How many; together with those of the chunks that follow without a time.
    pub bytes: u64,
    /// When, on the camera's clock, joined over the legs.
    pub time: LostTime,
}

/// How presses ended, each counted once by its last attempt.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct PressTally {
    /// In the plan.
    pub planned: u64,
    /// Last attempt valid.
    pub valid: u64,
    /// Never attempted.
    pub missed: u64,
    /// Last attempt invalid.
    pub invalid: u64,
    /// Last attempt left out by a rule.
    pub excluded: u64,
}

impl PressTally {
    /// Presses without a verdict yet: none of a finished session.
    #[must_use]
    pub const fn open(&self) -> u64 {
        self.planned
            .saturating_sub(self.valid + self.missed + self.invalid + self.excluded)
    }
}

/// Sizes and counts of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct SessionTotals {
    /// Calibrating and scored presses.
    pub presses: PressTally,
    /// Sync presses.
    pub sync: PressTally,
    /// Chunks of both cameras.
    pub chunks: u64,
    /// Camera bytes as they came.
    pub raw_bytes: u64,
    /// Camera bytes in the file.
    pub stored_bytes: u64,
    /// Camera bytes known to be lost.
    pub lost_bytes: u64,
    /// CD events of both cameras.
    pub cd_events: u64,
    /// Trigger edges of both cameras.
    pub trigger_edges: u64,
    /// Pose samples.
    pub pose_samples: u64,
}

/// What a session was sealed with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seal {
    /// Final counts.
    pub totals: SessionTotals,
    /// SHA-256 of the content.
    pub tree_sha256: [u8; 32],
    /// SHA-256 of the file, these 32 bytes taken as zero.
    pub file_sha256: [u8; 32],
}
