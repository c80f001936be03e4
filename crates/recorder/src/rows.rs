//! Rows of a session as plain values.

use serde::Serialize;
use skinrig_model::{
    AttemptId, CameraId, ChunkFacts, DeviceIdentity, DeviceRole, HostTime, InterruptionKind,
    InterruptionReason, LostTime, MotionCommand, PressOutcome, ResumeHeader, RunEnd, Setting,
};

use skinrig_formats::codec::Codec;

use crate::hex::hex;

/// Identity of a session: its header without the texts of protocol, plan and rig.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Headline {
    /// Identifier of the session, independent of the file's name.
    pub session_id: String,
    /// Civil time of the start, RFC 3339.
    pub started_at: String,
    /// Name of the pressed prototype.
    pub prototype: String,
    /// Name of the protocol file.
    pub protocol_name: String,
    /// Lower-case hex SHA-256 of the protocol's text.
    pub protocol_sha256: String,
    /// Lower-case hex SHA-256 of the plan.
    pub plan_sha256: String,
    /// Values overridden on the command line, a JSON array of `key=value`.
    pub overrides_json: String,
    /// Seed of the run, decimal.
    pub seed: String,
    /// `simulated`, `replayed`, `imported`, `emulated` or `bench`.
    pub rig_kind: String,
    /// Name of the rig.
    pub rig_name: String,
}

/// A device with its settings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DeviceRow {
    /// Purpose in the rig.
    pub role: DeviceRole,
    /// Identity that the device reported.
    pub identity: DeviceIdentity,
    /// Requested and read-back settings, in the order of writing.
    pub settings: Vec<Setting>,
}

/// One leg of a session: the part recorded by one process. The first has number 1, and all its origins are zero.
#[derive(Debug, Clone, PartialEq)]
pub struct LegRow {
    /// 1, 2, 3, ...
    pub number: u32,
    /// Operator, start time and software.
    pub began: ResumeHeader,
    /// Start of its host clock on the session's. All times of earlier legs are before it.
    pub origin: HostTime,
    /// Start of each camera's clock on the session's, µs.
    pub camera_origin_us: [u64; 2],
    /// Number of each camera's first chunk. That chunk is missing if the leg ended before it.
    pub first_seq: [u64; 2],
    /// How many of [`devices`](crate::SessionReader::devices) belong to earlier legs.
    pub devices_before: usize,
    /// How many of [`preflight`](crate::SessionReader::preflight) belong to earlier legs.
    pub preflight_before: usize,
    /// Time and kind of its end; `None` while in progress or after a crash.
    pub end: Option<(HostTime, RunEnd)>,
    /// Tree hash of its seal, including one that the next leg removed.
    pub tree_sha256: Option<[u8; 32]>,
}

/// One attempt at a press.
#[derive(Debug, Clone, PartialEq)]
pub struct AttemptRow {
    /// Press and attempt number.
    pub id: AttemptId,
    /// Number of the attempt that this one repeats.
    pub previous: Option<u32>,
    /// Start of the attempt; `None` for a press that was never attempted.
    pub intent: Option<HostTime>,
    /// Result; `None` while it runs, and permanently if it was interrupted.
    pub outcome: Option<PressOutcome>,
}

/// A motion command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandRow {
    /// Host time at which it was sent.
    pub t: HostTime,
    /// Target and speed.
    pub command: MotionCommand,
}

/// A deviation from the planned course of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct InterruptionRow {
    /// Host time at which it began.
    pub t: HostTime,
    /// Type of the deviation.
    pub kind: InterruptionKind,
    /// Its reason.
    pub reason: InterruptionReason,
}

/// An operator note.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NoteRow {
    /// Host time of the note.
    pub t: HostTime,
    /// Content of the note.
    pub text: String,
}

/// Metadata of a chunk, without its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChunkMeta {
    /// Camera that sent it.
    pub camera: CameraId,
    /// Position in the camera's stream, from 0.
    pub seq: u64,
    /// Host time at which its last byte arrived.
    pub host_time: HostTime,
    /// Bytes lost immediately before it.
    pub lost_before: u64,
    /// Camera time lost with them. `None` without a loss, before schema 6, and for chunks that a salvage replaced. If it is set,
    /// a decoder that carried no state across the loss computed the facts.
    pub lost_time: Option<LostTime>,
    /// Storage encoding.
    pub codec: Codec,
    /// Raw bytes.
    pub raw_bytes: u64,
    /// Bytes in the file.
    pub stored_bytes: u64,
    /// CRC-32 (zlib) of the raw bytes.
    pub raw_crc32: u32,
    /// Results of decoding the stream in order.
    pub facts: ChunkFacts,
    /// Set on the first chunk of a further leg, where the decoder restarts: the offset of its times, µs.
    pub restart_us: Option<u64>,
}

/// A loss of camera bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loss {
    /// Number of the chunk after the loss.
    pub seq: u64,
    /// Bytes lost, including those before following chunks without a time.
    pub bytes: u64,
    /// Lost interval on the camera's clock, continuous over all legs.
    pub time: LostTime,
}

/// Verdict counts of presses, each by its last attempt.
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
    /// Last attempt excluded by a rule.
    pub excluded: u64,
}

impl PressTally {
    /// Presses that were made, whatever their verdict.
    #[must_use]
    pub const fn made(&self) -> u64 {
        self.valid + self.invalid + self.excluded
    }

    /// Presses without a verdict; 0 in a finished session.
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
    /// Raw camera bytes.
    pub raw_bytes: u64,
    /// Camera bytes as stored in the file.
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

/// Seal of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seal {
    /// Final counts.
    pub totals: SessionTotals,
    /// SHA-256 of the content.
    pub tree_sha256: [u8; 32],
    /// SHA-256 of the file, with these 32 bytes as zero.
    pub file_sha256: [u8; 32],
}

impl Seal {
    /// SHA-256 of the content in lower-case hex, which identifies what was recorded.
    #[must_use]
    pub fn content_sha256(&self) -> String {
        hex(&self.tree_sha256)
    }
}
