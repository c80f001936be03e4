//! Owns the errors of a comparison.

use serde::{Deserialize, Serialize};

use super::Kind;

/// One side of a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The first.
    A,
    /// The second.
    B,
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::A => "A",
            Self::B => "B",
        })
    }
}

/// Why two samples cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error, Serialize, Deserialize)]
#[serde(tag = "reason", rename_all = "snake_case")]
pub enum ComparisonError {
    /// The samples are of different kinds.
    #[error("expected two samples of one kind, found {a:?} and {b:?}")]
    Kinds {
        /// Kind of A.
        a: Kind,
        /// Kind of B.
        b: Kind,
    },
    /// The sample has no value.
    #[error("{side} has no value of this metric: none of its presses yields one")]
    Empty {
        /// Side without a value.
        side: Side,
    },
    /// Both have values, but at different locations.
    #[error(
        "expected locations that A and B share, found none among {a} and {b}; press the same locations, or compare the samples \
         as independent"
    )]
    NoSharedLocation {
        /// Locations of A.
        a: u32,
        /// Locations of B.
        b: u32,
    },
    /// One location is not a sample of the skin.
    #[error(
        "expected values at 2 or more locations, found {locations}; one location does not represent the skin"
    )]
    TooFewLocations {
        /// Number of locations found.
        locations: u32,
    },
    /// All locations have the same difference.
    #[error(
        "expected locations that differ, found the same difference ({b:.4} - {a:.4}) at each of {locations}: without any spread there \
         is no interval and no test"
    )]
    NoSpread {
        /// Value of A.
        a: f64,
        /// Value of B.
        b: f64,
        /// Number of locations.
        locations: u32,
    },
    /// The percentile lies among the misses.
    #[error(
        "the {percentile} % percentile of {side} lies beyond the window: {missed} of {trials} trials were missed; compare the \
         detected share instead, or widen the window"
    )]
    BeyondWindow {
        /// Side with the misses.
        side: Side,
        /// In %.
        percentile: f64,
        /// Missed trials.
        missed: u32,
        /// All trials.
        trials: u32,
    },
    /// Taxels are undefined for an RMSE of 0.
    #[error("every error of {side} is 0: the number of taxels is undefined")]
    NoError {
        /// Side without an error.
        side: Side,
    },
    /// A setting is out of range.
    #[error("expected {expected} for `{name}`, found {found}")]
    Setting {
        /// Name of the setting.
        name: String,
        /// Allowed values.
        expected: String,
        /// Given value.
        found: f64,
    },
}

impl ComparisonError {
    pub(super) fn setting(name: &str, expected: &str, found: f64) -> Self {
        Self::Setting {
            name: name.to_owned(),
            expected: expected.to_owned(),
            found,
        }
    }
}
