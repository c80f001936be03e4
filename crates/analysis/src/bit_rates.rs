//! Data rates at press and idle.

use crate::result::{Analysis, BitRates};

/// Data rates at press and idle.
#[must_use]
pub fn bit_rates(_analysis: &Analysis) -> Option<BitRates> {
    None
}
