//! Presses that a selection excludes, and why.

use serde::{Deserialize, Serialize};

use crate::id::PressId;

/// A press that a selection excludes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SelectedOut {
    /// The press.
    pub press: PressId,
    /// Why.
    #[serde(flatten)]
    pub why: SelectionReason,
}

/// Why a selection excludes a press, and who decided it.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct SelectionReason {
    /// The reason, as its author wrote it.
    pub reason: String,
    /// Who decided.
    pub decided_by: String,
}
