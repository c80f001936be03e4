//! The rule that excludes most presses, for warnings.

use serde::{Deserialize, Serialize};

use crate::exclusion::Exclusion;

/// The rule that excludes most presses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CommonExclusion {
    /// Presses that it excludes.
    pub presses: usize,
    /// Why the first of them does not count.
    pub example: Exclusion,
}

/// `most` in the text of a warning.
pub(super) fn most(common: Option<&CommonExclusion>) -> String {
    common.map_or_else(String::new, |common| {
        let (n, label) = (common.presses, common.example.label());
        format!(" (most often, {n} times: {label})")
    })
}
