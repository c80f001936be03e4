//! Owns the reasons for which a camera has no clock from the trains of the trigger box.

use serde::{Deserialize, Serialize};

/// Why the edges that a camera saw give no clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum CameraClockError {
    /// The box sent nothing.
    #[error("the box reported no train")]
    NoTrain,
    /// No sent train is recognisable.
    #[error("none of {sent} sent trains can be identified among {edges} edges")]
    Unidentified {
        /// Trains sent.
        sent: usize,
        /// Edges seen on the channel.
        edges: usize,
    },
    /// The trains contradict each other, or their clock drifts too fast.
    #[error(
        "{identified} of {sent} sent trains can be identified, but they are not on a plausible clock line"
    )]
    NoLine {
        /// Trains identified by their bits.
        identified: usize,
        /// Trains sent.
        sent: usize,
    },
    /// Too few trains at their predicted positions.
    #[error("only {seen} trains were seen")]
    FewSeen {
        /// Trains seen.
        seen: usize,
    },
}
