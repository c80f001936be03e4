//! Records: all events of a run, in order.
//!
//! The controller emits them; terminal, log and recorder consume them. They are the only interface
//! between the running experiment and its storage.

use serde::{Deserialize, Serialize};

use crate::device_role::DeviceRole;
use crate::frame::{Point3, RigidTransform, Robot, Skin};
use crate::id::AttemptId;
use crate::notification::Notification;
use crate::pose::PoseSample;
use crate::preflight::PreflightCheck;
use crate::press::{PlannedPress, PressOutcome};
use crate::pulse::SentMark;
use crate::reason::{InterruptionReason, MissedReason};
use crate::run_end::RunEnd;
use crate::stream::{RawChunk, StreamFormat};
use crate::time::HostTime;
use crate::touch::TouchEstimate;
use crate::trigger_box::BoxReport;

/// Identity of a device.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DeviceIdentity {
    /// Maker and model, for example `Prophesee EVK1 Gen3.1`; simulated and replayed devices are marked as such.
    pub model: String,
    /// Serial number as reported by the device.
    pub serial: String,
    /// Firmware or library version.
    pub firmware: String,
}

/// A setting as written and as read back.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setting {
    /// For example `bias_fo`.
    pub name: String,
    /// Requested value.
    pub requested: String,
    /// Value read back from the device.
    pub read_back: String,
}

impl Setting {
    /// In place of a requested value: the value was only read.
    pub const AS_FOUND: &str = "as found";

    /// In place of a requested value: an accepted mismatch; `read_back` contains the expected and the found value, and `name` the
    /// setting that accepts it.
    pub const TOLERATED: &str = "tolerated";

    /// Whether a value was requested, so that a different read-back is a mismatch.
    #[must_use]
    pub fn was_requested(&self) -> bool {
        self.requested != Self::AS_FOUND && self.requested != Self::TOLERATED
    }
}

/// Header of a run, known before anything moves. Written first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunHeader {
    /// The protocol as the user wrote it, byte for byte.
    pub protocol_text: String,
    /// Its source (a file name, or `built-in`).
    pub protocol_name: String,
    /// Lower-case hex SHA-256 of `protocol_text`.
    pub protocol_sha256: String,
    /// Values overridden on the command line, in order, as `key=value`.
    pub overrides: Vec<String>,
    /// The plan as JSON.
    pub plan_json: String,
    /// Lower-case hex SHA-256 of the plan's canonical JSON.
    pub plan_sha256: String,
    /// The seed of everything random in this run.
    pub seed: u64,
    /// `simulated`, `replayed`, `imported`, `emulated` or `bench`.
    pub rig_kind: String,
    /// Name of the rig; for the simulated rig with its level, for example `simulated (geometric)`.
    pub rig_name: String,
    /// The geometry and other constants of the rig as JSON.
    pub rig_json: String,
    /// Pose of the skin in the robot's frame.
    pub robot_from_skin: RigidTransform<Robot, Skin>,
    /// Stream format of each camera (index 0: camera 1).
    pub stream_formats: [StreamFormat; 2],
    /// The prototype under test.
    pub prototype: String,
    /// The operator.
    pub operator: String,
    /// Civil time of the start, RFC 3339; for display.
    pub started_at: String,
    /// Host name.
    pub host: String,
    /// Version of skinrig.
    pub software: String,
    /// The command line.
    pub command_line: String,
    /// Every planned press, in plan order.
    pub presses: Vec<PlannedPress>,
}

impl RunHeader {
    /// True for a rig that can press again; false for an import and for a replay of an earlier recording.
    #[must_use]
    pub fn is_of_a_rig(&self) -> bool {
        !matches!(self.rig_kind.as_str(), "imported" | "replayed")
    }
}

/// Header of a further leg, written when an interrupted or unfinished session is resumed. Protocol, plan, seed and frame are
/// the session's own; everything here may differ from its first leg.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ResumeHeader {
    /// Operator of this leg.
    pub operator: String,
    /// Civil time of this leg's start, RFC 3339; for display.
    pub started_at: String,
    /// Host name.
    pub host: String,
    /// Version of skinrig.
    pub software: String,
    /// The command line.
    pub command_line: String,
}

/// A motion command from the controller to the indenter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MotionCommand {
    /// Straight-line target, skin frame, mm.
    pub target: Point3<Skin>,
    /// Speed along the line, mm/s.
    pub speed_mm_s: f64,
}

/// Kinds of interruptions of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InterruptionKind {
    /// Waits after the current press.
    Pause,
    /// Interrupt the current press, retract, and wait.
    PauseNow,
    /// Continues after a pause.
    Resume,
    /// Finish cleanly after the current press.
    Stop,
    /// Retract now, disarm, keep the data.
    Abort,
    /// Motors off immediately, without retraction; keep the data.
    Halt,
    /// A device or the recorder failed.
    Fault,
}

impl InterruptionKind {
    /// All kinds.
    pub const ALL: [Self; 7] = [
        Self::Pause,
        Self::PauseNow,
        Self::Resume,
        Self::Stop,
        Self::Abort,
        Self::Halt,
        Self::Fault,
    ];

    /// The name used in sessions.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pause => "pause",
            Self::PauseNow => "pause_now",
            Self::Resume => "resume",
            Self::Stop => "stop",
            Self::Abort => "abort",
            Self::Halt => "halt",
            Self::Fault => "fault",
        }
    }
}

/// An event in a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// The first record of every run.
    Started(Box<RunHeader>),
    /// The first record of every further *leg*: another process resumes the session. Its host clock, its cameras' clocks
    /// and its chunk numbers start again; the recorder joins them to the earlier ones.
    Resumed(Box<ResumeHeader>),
    /// A device responded and was configured.
    Device {
        /// Its role.
        role: DeviceRole,
        /// Identity reported by the device.
        identity: DeviceIdentity,
        /// Its settings as read back.
        settings: Vec<Setting>,
    },
    /// Checks before the robot is armed; if one of them failed, nothing is armed.
    Preflight(Vec<PreflightCheck>),
    /// A press is about to be attempted. Durable before the robot moves for it.
    Intent {
        /// The attempt.
        attempt: AttemptId,
        /// Time.
        t: HostTime,
    },
    /// A motion command was given.
    Command {
        /// Time.
        t: HostTime,
        /// The command.
        command: MotionCommand,
    },
    /// Samples of the pose stream, in time order.
    Poses(Vec<PoseSample>),
    /// The trigger box sent a mark.
    MarkSent(SentMark),
    /// Reports of the trigger box on its own clock, in the order of arrival.
    BoxReports {
        /// Time at which they were read from the box.
        t: HostTime,
        /// The reports.
        reports: Vec<BoxReport>,
    },
    /// Camera bytes.
    Chunk(RawChunk),
    /// An attempt ended. Durable together with all chunks up to its end.
    Outcome(PressOutcome),
    /// A press of the plan that was not attempted, and the reason. Emitted at the end of an interrupted run.
    Missed(AttemptId, MissedReason),
    /// The run deviated from its plan.
    Interruption {
        /// Kind.
        kind: InterruptionKind,
        /// Time.
        t: HostTime,
        /// Reason.
        reason: InterruptionReason,
    },
    /// A note by the operator or by skinrig.
    Note {
        /// Time.
        t: HostTime,
        /// The note.
        text: String,
    },
    /// A touch was felt, or a press reacted to it.
    Touch(TouchEstimate),
    /// A message about the run was sent, or not. The only record that may follow [`Record::Ended`].
    Notification(Box<Notification>),
    /// The last record, except for notifications.
    Ended {
        /// Time.
        t: HostTime,
        /// End of the run.
        end: RunEnd,
    },
}
