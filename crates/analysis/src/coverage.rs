//! Areas: skin, seen by both cameras, probed; effective taxels.

use crate::result::{Analysis, Coverage};

/// Areas: skin, seen by both cameras, probed; effective taxels.
#[must_use]
pub fn coverage(_analysis: &Analysis) -> Option<Coverage> {
    None
}
