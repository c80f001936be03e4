//! Reason for a missing value or comparison.

use serde::{Serialize, Serializer};
use skinrig_statistics::{ComparisonError, SampleFault};

/// Why samples have no value, or cannot be compared. In JSON: its text.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoResult {
    /// The values of a skin form no sample.
    #[error(transparent)]
    Sample(#[from] SampleFault),
    /// A look at one session of a skin that has several.
    #[error(
        "only one session of a skin that has several, which does not tell how much sessions vary"
    )]
    OneSession,
    /// The samples have no interval, or cannot be compared.
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
}

impl Serialize for NoResult {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(self)
    }
}
