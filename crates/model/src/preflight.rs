//! What was checked before a run was armed.

use serde::{Deserialize, Serialize};

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
        }
    }

    /// True when it failed.
    #[must_use]
    pub const fn failed(&self) -> bool {
        matches!(self.verdict, CheckVerdict::Failed)
    }
}
