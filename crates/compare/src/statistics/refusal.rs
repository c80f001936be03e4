//! Owns the reasons for which there is nothing to compare.

use serde::{Deserialize, Serialize};

use super::Kind;

/// One of the two that are compared.
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

/// Why a question has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error, Serialize, Deserialize)]
#[serde(tag = "reason", rename_all = "snake_case")]
pub enum Refusal {
    /// The two are not of the same metric.
    #[error("expected two samples of one kind, found {a:?} and {b:?}")]
    Kinds {
        /// Of A.
        a: Kind,
        /// Of B.
        b: Kind,
    },
    /// A sample without a value.
    #[error("{side} has no value of this metric: no press of it gave one")]
    Empty {
        /// Which.
        side: Side,
    },
    /// Both have values, but at different places.
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
    /// One location tells nothing about the others.
    #[error(
        "expected values at 2 locations at the least, found {locations}; one place says nothing about the rest of the skin"
    )]
    TooFewLocations {
        /// How many there are.
        locations: u32,
    },
    /// Every location says the very same.
    #[error(
        "expected locations that differ, found the same difference ({b} - {a}) at each of {locations}: without any spread there \
         is no interval and no test"
    )]
    NoSpread {
        /// Value of A.
        a: f64,
        /// Value of B.
        b: f64,
        /// Locations.
        locations: u32,
    },
    /// The percentile asked for lies among the misses.
    #[error(
        "the {percentile} % percentile of {side} lies beyond the window: {missed} of {trials} trials were missed; compare the \
         detected share instead, or widen the window"
    )]
    BeyondWindow {
        /// Which.
        side: Side,
        /// Which percentile, %.
        percentile: f64,
        /// Trials missed.
        missed: u32,
        /// Trials.
        trials: u32,
    },
    /// A function of the RMSE that is not defined at an error of 0.
    #[error("every error of {side} is 0: no number of taxels follows")]
    NoError {
        /// Which.
        side: Side,
    },
    /// A setting out of its range.
    #[error("expected {expected} for `{name}`, found {found}")]
    Setting {
        /// Its name.
        name: String,
        /// What is allowed.
        expected: String,
        /// What was given.
        found: f64,
    },
}

impl Refusal {
    pub(super) fn setting(name: &str, expected: &str, found: f64) -> Self {
        Self::Setting {
            name: name.to_owned(),
            expected: expected.to_owned(),
            found,
        }
    }
}
