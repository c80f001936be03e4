//! What was seen during a check besides its numbers: the facts from which causes are told.

use serde::{Deserialize, Serialize};

/// Something that was seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// What kind of thing.
    pub kind: EvidenceKind,
    /// Which device or part of the computer, as the parts of a check are called: `robot`, `camera1`, `camera2`, `trigger box`,
    /// `computer`, `skin`.
    pub subject: String,
    /// What exactly: expected, found.
    pub what: String,
    /// What to do next, when it is known.
    pub next: Option<String>,
}

/// What kind of thing was seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EvidenceKind {
    /// A device is not on its bus or port: not plugged in, or without power.
    Absent,
    /// The operating system does not let this user open it.
    NotPermitted,
    /// Another program holds it.
    Busy,
    /// A device that was there answers no more, or answers nonsense.
    DeviceLost,
    /// A device is another one than the rig file expects, or has another firmware.
    OtherDevice,
    /// A setting did not take.
    ReadBack,
    /// A device is in a state in which it cannot do what was asked of it: not initialised, forces off.
    State,
    /// A device refused a request that lies within what it can do.
    Refused,
    /// Bytes of a camera were lost on the way.
    DataLost,
    /// Trigger pulses were lost, doubled or invented.
    TriggerFault,
    /// The limit of force, speed or place took the power off the robot.
    Trip,
    /// The disk is full, slow or not writable.
    Disk,
    /// This computer did not look for too long: overloaded, asleep, or held up by its disk.
    HostLate,
    /// Time ran out: that of the check or that of the suite.
    TimeOut,
    /// Somebody ended the suite: ctrl-C, or the system's polite end.
    Stopped,
    /// The bench belongs to somebody else, or was taken away.
    Lease,
    /// A session could not be analysed, or the audit of its plausibility found something.
    Audit,
    /// Fewer samples than the check needs.
    TooLittle,
    /// A fault of this program.
    Software,
}

impl EvidenceKind {
    /// All of them.
    pub const ALL: [Self; 19] = [
        Self::Absent,
        Self::NotPermitted,
        Self::Busy,
        Self::DeviceLost,
        Self::OtherDevice,
        Self::ReadBack,
        Self::State,
        Self::Refused,
        Self::DataLost,
        Self::TriggerFault,
        Self::Trip,
        Self::Disk,
        Self::HostLate,
        Self::TimeOut,
        Self::Stopped,
        Self::Lease,
        Self::Audit,
        Self::TooLittle,
        Self::Software,
    ];

    /// As people read it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Absent => "absent",
            Self::NotPermitted => "not permitted",
            Self::Busy => "busy",
            Self::DeviceLost => "device lost",
            Self::OtherDevice => "other device",
            Self::ReadBack => "read back",
            Self::State => "state",
            Self::Refused => "refused",
            Self::DataLost => "data lost",
            Self::TriggerFault => "trigger fault",
            Self::Trip => "trip",
            Self::Disk => "disk",
            Self::HostLate => "computer late",
            Self::TimeOut => "time ran out",
            Self::Stopped => "stopped",
            Self::Lease => "lease",
            Self::Audit => "audit",
            Self::TooLittle => "too little",
            Self::Software => "software",
        }
    }
}

impl Evidence {
    /// Evidence of this kind about `subject`.
    #[must_use]
    pub fn new(kind: EvidenceKind, subject: impl Into<String>, what: impl Into<String>) -> Self {
        Self {
            kind,
            subject: subject.into(),
            what: what.into(),
            next: None,
        }
    }

    /// The same, with what to do next.
    #[must_use]
    pub fn next(self, step: impl Into<String>) -> Self {
        Self {
            next: Some(step.into()),
            ..self
        }
    }
}
