//! What was checked before a run was armed.

use serde::{Deserialize, Serialize};

use crate::device_role::DeviceRole;

/// How a check ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CheckVerdict {
    /// Found as expected.
    Passed,
    /// Found otherwise: the run is not armed.
    Failed,
    /// Not checked; `found` says why.
    Skipped,
}

impl CheckVerdict {
    /// All verdicts.
    pub const ALL: [Self; 3] = [Self::Passed, Self::Failed, Self::Skipped];

    /// `passed`, `failed` or `skipped`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "failed",
            Self::Skipped => "skipped",
        }
    }
}

/// What a check before a run is about, for programs that name causes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CheckKind {
    /// Anything else.
    #[default]
    Other,
    /// Free space where the session is written.
    Disk,
    /// The session file.
    Recorder,
    /// The place of the skin.
    Frame,
    /// Who a device says it is, and its versions.
    Identity(DeviceRole),
    /// Settings that read back as written.
    ReadBack(DeviceRole),
    /// The state in which a device has to be.
    State(DeviceRole),
    /// A camera's clock.
    Clock(DeviceRole),
    /// The way of a trigger mark to a camera.
    Trigger(DeviceRole),
}

/// One check before a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PreflightCheck {
    /// What was checked, for example `trigger loop-back, camera 1`.
    pub check: String,
    /// What a run needs.
    pub expected: String,
    /// What there was, or why it was not checked.
    pub found: String,
    /// How it ended.
    pub verdict: CheckVerdict,
    /// What to do about a failed check; empty for others.
    pub next_step: String,
    /// What it is about; not kept in sessions.
    #[serde(skip)]
    pub kind: CheckKind,
}

impl PreflightCheck {
    /// A check that passed when `ok`; what to do is kept only when it failed.
    #[must_use]
    pub fn new(
        check: impl Into<String>,
        expected: impl Into<String>,
        found: impl Into<String>,
        ok: bool,
        next_step: impl Into<String>,
    ) -> Self {
        Self {
            check: check.into(),
            expected: expected.into(),
            found: found.into(),
            verdict: if ok {
                CheckVerdict::Passed
            } else {
                CheckVerdict::Failed
            },
            next_step: if ok { String::new() } else { next_step.into() },
            kind: CheckKind::Other,
        }
    }

    /// A check that was not made.
    #[must_use]
    pub fn skipped(
        check: impl Into<String>,
        expected: impl Into<String>,
        why: impl Into<String>,
    ) -> Self {
        Self {
            check: check.into(),
            expected: expected.into(),
            found: why.into(),
            verdict: CheckVerdict::Skipped,
            next_step: String::new(),
            kind: CheckKind::Other,
        }
    }

    /// The same check, about this.
    #[must_use]
    pub fn about(self, kind: CheckKind) -> Self {
        Self { kind, ..self }
    }

    /// True when it failed.
    #[must_use]
    pub const fn failed(&self) -> bool {
        matches!(self.verdict, CheckVerdict::Failed)
    }
}
