//! Reasons of verdicts on presses and of stopped runs.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::fault::{CUT_OFF, Causes, PressFault, RunFault, Suspension};
use crate::press_fault::PressFaultKind;
use crate::run_end::{RunEnd, StopReason};

/// Why an attempt at a press is invalid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InvalidReason {
    /// The program ended before the outcome: whether the robot pressed is unknown.
    LegEnded {
        /// Leg of the session that made the attempt.
        leg: u32,
    },
    /// The attempt has faults.
    Faults(Causes<PressFault>),
    /// A session of an older schema has only this text and the kinds of the faults.
    Recorded {
        /// All faults.
        text: String,
        /// Their kinds; empty before schema 8.
        kinds: Vec<PressFaultKind>,
        /// True if the attempt did not finish.
        is_cut_off: bool,
    },
}

impl InvalidReason {
    /// True if the attempt did not finish: the state of its press is unknown.
    #[must_use]
    pub fn is_cut_off(&self) -> bool {
        match self {
            Self::LegEnded { .. } => true,
            Self::Faults(faults) => {
                matches!(faults.as_slice().first(), Some(PressFault::RunEnded(_)))
            }
            Self::Recorded { is_cut_off, .. } => *is_cut_off,
        }
    }

    /// Kinds of the faults, in order; empty for an attempt recorded before schema 8.
    #[must_use]
    pub fn kinds(&self) -> Vec<PressFaultKind> {
        match self {
            Self::LegEnded { .. } => vec![PressFaultKind::RunEnded],
            Self::Faults(faults) => faults.iter().map(PressFault::kind).collect(),
            Self::Recorded { kinds, .. } => kinds.clone(),
        }
    }
}

impl fmt::Display for InvalidReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LegEnded { leg } => write!(
                f,
                "{CUT_OFF}leg {leg} of the session ended without its outcome"
            ),
            Self::Faults(faults) => faults.fmt(f),
            Self::Recorded { text, .. } => f.write_str(text),
        }
    }
}

/// Why a press was never attempted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MissedReason {
    /// The run ended before it.
    RunEnded(RunEnd),
    /// The session holds no attempt.
    NeverAttempted,
    /// A session of an older schema has only this text.
    Recorded {
        /// Why the run ended.
        text: String,
    },
}

impl fmt::Display for MissedReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::RunEnded(end) => f.write_str(&end.reason().unwrap_or_default()),
            Self::NeverAttempted => f.write_str("never attempted"),
            Self::Recorded { text } => f.write_str(text),
        }
    }
}

/// Why a press that was done does not count.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ExcludedReason {
    /// The schedule of an imported data set does not use it.
    NotUsed {
        /// The presses that the schedule uses, as written there.
        presses_used: String,
    },
    /// A session of an older schema has only this text.
    Recorded {
        /// The rule.
        text: String,
    },
}

impl fmt::Display for ExcludedReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotUsed { presses_used } => {
                write!(f, "not used: presses_used is {presses_used}")
            }
            Self::Recorded { text } => f.write_str(text),
        }
    }
}

/// Why a run deviated from its plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum InterruptionReason {
    /// The operator paused it after the press.
    Pause,
    /// The operator paused it at once.
    PauseNow,
    /// The operator continued it.
    Resume,
    /// A condition suspended it.
    Suspended(Suspension),
    /// The conditions are back to normal after this suspension.
    Calm(Suspension),
    /// The run ends.
    End(RunEnd),
    /// A session of an older schema has only this text.
    Recorded {
        /// The reason.
        text: String,
    },
}

impl fmt::Display for InterruptionReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pause => f.write_str("operator: pause"),
            Self::PauseNow => f.write_str("operator: pause now"),
            Self::Resume => f.write_str("operator: resume"),
            Self::Suspended(suspension) => suspension.fmt(f),
            Self::Calm(suspension) => write!(f, "no longer {suspension}"),
            Self::End(end) => f.write_str(&end.reason().unwrap_or_default()),
            Self::Recorded { text } => f.write_str(text),
        }
    }
}

/// Borrowed reason of a verdict or of an end, as JSON has it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ReasonRef<'a> {
    /// Of a press that was never attempted.
    Missed(&'a MissedReason),
    /// Of an invalid attempt.
    Invalid(&'a InvalidReason),
    /// Of a press that does not count.
    Excluded(&'a ExcludedReason),
    /// Of a run that stopped.
    Stopped(&'a StopReason),
    /// Of a run that failed.
    Faulted(&'a Causes<RunFault>),
}

impl RunEnd {
    /// The reason, for JSON; `None` for a completed run.
    #[must_use]
    pub const fn cause(&self) -> Option<ReasonRef<'_>> {
        match self {
            Self::Completed => None,
            Self::Stopped(reason) => Some(ReasonRef::Stopped(reason)),
            Self::Faulted(causes) => Some(ReasonRef::Faulted(causes)),
        }
    }
}
