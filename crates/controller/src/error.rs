//! Problems at the end of a run, and why its steps end early.

use skinrig_model::RunFault;

/// A problem besides the cause of a run's end, mostly while bringing the robot to rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Failed operation of the run's end, for example `disarm`; empty if the error is clear without it.
    pub doing: &'static str,
    /// The failure.
    pub error: RunFault,
}

impl std::fmt::Display for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.doing {
            "" => self.error.fmt(f),
            doing => write!(f, "{doing}: {}", self.error),
        }
    }
}

/// Reason why the steps of a plan end early.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Halt {
    /// The operator requested a stop; nothing is in progress.
    Stopped,
    /// The operator requested an abort.
    Aborted,
    /// The operator requested a halt: motors off, wherever the tip is.
    Halted,
    /// The operator requested an immediate pause off the skin. The code that commanded the motion handles it; the run continues.
    PausedNow,
    /// Something failed.
    Fault(RunFault),
}

impl<E: Into<RunFault>> From<E> for Halt {
    fn from(e: E) -> Self {
        Self::Fault(e.into())
    }
}
