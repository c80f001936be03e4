//! Looks at the data of a running campaign, taken outside the controller.

use skinrig_model::{HostTime, Look};

/// Takes the looks that a plan declares. The controller never waits for an answer that [`poll`](Self::poll) does not have.
pub trait Looks {
    /// Look `number` is due: every press up to it has an outcome, and its records are durable. A look that blocks here is
    /// for rigs whose time stands still meanwhile.
    fn begin(&mut self, number: u32);

    /// The next look that is done, if any; never waits. `now` is the time of the run.
    fn poll(&mut self, now: HostTime) -> Option<LookOutcome>;
}

/// Outcome of one look.
#[derive(Debug, Clone, PartialEq)]
pub enum LookOutcome {
    /// It was taken.
    Taken(Look),
    /// It was not; the run continues.
    NotTaken {
        /// Number of the look.
        number: u32,
        /// Why not.
        why: LookFault,
    },
}

/// Why a look was not taken. Alpha spent on it is lost, which makes the others no less valid.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LookFault {
    /// The analysis of an earlier look took until the next one was due.
    #[error("the analysis of an earlier look was still running")]
    Overtaken,
    /// The analysis failed.
    #[error("{0}")]
    Failed(String),
}

/// No looks: for plans that declare none.
pub(crate) struct NoLooks;

impl Looks for NoLooks {
    fn begin(&mut self, _: u32) {}

    fn poll(&mut self, _: HostTime) -> Option<LookOutcome> {
        None
    }
}
