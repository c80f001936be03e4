//! Observations during a check besides its measurements, from which the rules derive a cause.

use serde::{Deserialize, Serialize};

/// An observation during a check.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// What kind of observation.
    pub kind: EvidenceKind,
    /// Device or part, named as in the parts of a check: `robot`, `camera1`, `camera2`, `trigger box`, `computer`, `skin`.
    pub subject: String,
    /// Description with expected and found values.
    pub what: String,
    /// What to do next, if known.
    pub next: Option<String>,
}

/// Kind of observation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EvidenceKind {
    /// A device is missing: not connected, or without power.
    Absent,
    /// The operating system denies this user access.
    NotPermitted,
    /// Another program uses the device.
    Busy,
    /// A device stopped responding, or responds with invalid data.
    DeviceLost,
    /// A device has another identity or firmware than the rig file expects.
    OtherDevice,
    /// A setting reads back with another value than was written.
    ReadBack,
    /// A device is in the wrong state for a request: not initialised, forces off.
    State,
    /// A device rejected a request that is within its capabilities.
    Refused,
    /// A camera's bytes were lost in transfer.
    DataLost,
    /// Trigger pulses are missing, doubled or spurious.
    TriggerFault,
    /// A force, speed or position limit switched the robot's motors off.
    Trip,
    /// The disk is full, slow or read-only.
    Disk,
    /// This computer did not poll its devices in time: overloaded, suspended, or blocked by its disk.
    HostLate,
    /// The time limit of the check or of the suite expired.
    TimeOut,
    /// The suite was stopped with ctrl-C or SIGTERM.
    Stopped,
    /// The bench is in use by another program, or another program took it over.
    Lease,
    /// A session could not be analysed, or its plausibility audit has findings.
    Audit,
    /// Fewer samples than the check needs.
    TooLittle,
    /// A bug in skinrig.
    Software,
}

impl EvidenceKind {
    /// All kinds.
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

    /// Display name.
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
            Self::TimeOut => "timed out",
            Self::Stopped => "stopped",
            Self::Lease => "lease",
            Self::Audit => "audit",
            Self::TooLittle => "too few samples",
            Self::Software => "software",
        }
    }
}

impl Evidence {
    /// New evidence about `subject`.
    #[must_use]
    pub fn new(kind: EvidenceKind, subject: impl Into<String>, what: impl Into<String>) -> Self {
        Self {
            kind,
            subject: subject.into(),
            what: what.into(),
            next: None,
        }
    }

    /// Adds the next step.
    #[must_use]
    pub fn next(self, step: impl Into<String>) -> Self {
        Self {
            next: Some(step.into()),
            ..self
        }
    }
}
