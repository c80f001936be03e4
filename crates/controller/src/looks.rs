//! Looks at the data of a running campaign, taken outside the controller.

use skinrig_model::{HostTime, Look};

/// Takes the looks that a plan declares. The controller polls and never waits for one.
pub trait Looks {
    /// Starts look `number`: every press up to it has an outcome, and its records are durable. May block only on rigs whose
    /// time stands still meanwhile.
    fn begin(&mut self, number: u32);

    /// The next finished look, if any; never blocks. `now` is the time of the run.
    fn poll(&mut self, now: HostTime) -> Option<LookOutcome>;
}

/// Outcome of one look.
#[derive(Debug, Clone, PartialEq)]
pub enum LookOutcome {
    /// The look.
    Taken(Look),
    /// The look failed; the run continues.
    NotTaken {
        /// Number of the look.
        number: u32,
        /// Why not.
        why: LookFault,
    },
}

/// Why a look was not taken. Its share of alpha is lost; the other looks stay valid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LookFault {
    /// The analysis of an earlier look took until the next one was due.
    #[error("the analysis of an earlier look was still running")]
    Overtaken,
    /// The analysis failed.
    #[error("{0}")]
    Failed(String),
}

/// For plans that declare no looks.
pub(crate) struct NoLooks;

impl Looks for NoLooks {
    fn begin(&mut self, _: u32) {}

    fn poll(&mut self, _: HostTime) -> Option<LookOutcome> {
        None
    }
}
