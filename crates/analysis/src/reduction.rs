//! Localisation on thinned events.

use crate::kept::Kept;
use crate::result::{Analysis, Reduction};

/// Localisation on thinned events.
#[must_use]
pub fn study(_analysis: &Analysis, _kept: &Kept) -> Option<Reduction> {
    None
}
