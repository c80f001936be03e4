//! How a run ended.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::fault::{Causes, RunFault};
use crate::stopping::Look;

/// Why a run stopped without a fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// The operator stopped it after a press.
    Stop,
    /// The operator aborted it: the tip retracted immediately.
    Abort,
    /// The operator switched the motors off: the tip stayed in place.
    Halt,
    /// A look decided the campaign's question.
    Decided(Box<Look>),
    /// A session of an older schema, or another program, has only this text.
    Recorded {
        /// The reason.
        text: String,
    },
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stop => f.write_str("operator: stop"),
            Self::Abort => f.write_str("operator: abort"),
            Self::Halt => f.write_str(
                "operator: halt; the tip stayed where it was: check it before you power the robot again",
            ),
            Self::Decided(look) => write!(f, "its question is decided: {look}"),
            Self::Recorded { text } => f.write_str(text),
        }
    }
}

/// End of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunEnd {
    /// Every step of the plan was executed.
    Completed,
    /// The operator, or the answer to its question, stopped it.
    Stopped(StopReason),
    /// A device, a limit or the recorder ended it. The first cause comes first.
    Faulted(Causes<RunFault>),
}

impl RunEnd {
    /// A run that ended with one fault.
    #[must_use]
    pub fn fault(fault: impl Into<RunFault>) -> Self {
        Self::Faulted(Causes::one(fault.into()))
    }

    /// The same end with one more fault.
    #[must_use]
    pub fn and_fault(self, fault: impl Into<RunFault>) -> Self {
        match self {
            Self::Completed => Self::fault(fault),
            Self::Stopped(reason) => Self::fault(RunFault::Stopped(reason)).and_fault(fault),
            Self::Faulted(mut causes) => {
                causes.push(fault.into());
                Self::Faulted(causes)
            }
        }
    }

    /// `completed`, `stopped` or `faulted`.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::Completed => "completed",
            Self::Stopped(_) => "stopped",
            Self::Faulted(_) => "faulted",
        }
    }

    /// True if nothing of the plan is left to do: it was executed, or its question is decided.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.decision().is_some() || matches!(self, Self::Completed)
    }

    /// The look that decided the campaign's question and so ended the run.
    #[must_use]
    pub fn decision(&self) -> Option<&Look> {
        match self {
            Self::Stopped(StopReason::Decided(look)) => Some(look),
            _ => None,
        }
    }

    /// The faults that ended it; empty for other ends.
    #[must_use]
    pub fn faults(&self) -> &[RunFault] {
        match self {
            Self::Completed | Self::Stopped(_) => &[],
            Self::Faulted(causes) => causes.as_slice(),
        }
    }

    /// Text of the reason, of any end but `Completed`.
    #[must_use]
    pub fn reason(&self) -> Option<String> {
        match self {
            Self::Completed => None,
            Self::Stopped(reason) => Some(reason.to_string()),
            Self::Faulted(causes) => Some(causes.to_string()),
        }
    }
}
