//! Contact map reconstruction error.

use crate::result::{Analysis, Cmre};

/// Contact map reconstruction error.
#[must_use]
pub fn cmre(_analysis: &Analysis) -> Option<Cmre> {
    None
}
