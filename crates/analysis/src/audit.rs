//! The plausibility audit: independent laws that every sane session obeys, and the fault that most likely broke one.

use crate::input::SessionInput;
use crate::result::{Analysis, Finding};

/// The laws that the session breaks.
#[must_use]
pub fn audit(_input: &SessionInput, _analysis: &Analysis) -> Vec<Finding> {
    Vec::new()
}
