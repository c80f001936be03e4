//! Preflight checks: made before a run is armed.

use serde::{Deserialize, Serialize};

use crate::device_role::DeviceRole;

/// Verdict of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CheckVerdict {
    /// As expected.
    Passed,
    /// Failed: the run is not armed.
    Failed,
    /// Not checked; `found` states the reason.
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

/// Subject of a preflight check, for programs that determine causes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CheckKind {
    /// Anything else.
    #[default]
    Other,
    /// Free space where the session is written.
    Disk,
    /// The session file.
    Recorder,
    /// The pose of the skin.
    Frame,
    /// Identity and versions of a device.
    Identity(DeviceRole),
    /// Settings that read back as written.
    ReadBack(DeviceRole),
    /// Required state of a device.
    State(DeviceRole),
    /// A camera's clock.
    Clock(DeviceRole),
    /// The path of a trigger mark to a camera.
    Trigger(DeviceRole),
}

impl CheckKind {
    const fn is_other(&self) -> bool {
        matches!(self, Self::Other)
    }
}

/// One check before a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct PreflightCheck {
    /// Name of the check, for example `trigger loop-back, camera 1`.
    pub check: String,
    /// Expected value.
    pub expected: String,
    /// Found value, or reason why it was not checked.
    pub found: String,
    /// Result of the check.
    pub verdict: CheckVerdict,
    /// Next step after a failed check; empty for others.
    pub next_step: String,
    /// Subject; sessions store it only for the failed checks that ended the run.
    #[serde(default, skip_serializing_if = "CheckKind::is_other")]
    pub kind: CheckKind,
}

impl PreflightCheck {
    /// A check that passed if `ok`; the next step is kept only for failures.
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

    /// A skipped check.
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

    /// The same check with this subject.
    #[must_use]
    pub fn about(self, kind: CheckKind) -> Self {
        Self { kind, ..self }
    }

    /// True if it failed.
    #[must_use]
    pub const fn failed(&self) -> bool {
        matches!(self.verdict, CheckVerdict::Failed)
    }
}
