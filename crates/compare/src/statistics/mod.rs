//! Statistics for comparing skins: intervals, tests, verdicts and sample sizes, with locations as clusters.
//!
//! Presses at one location share an error and are not independent, so everything here resamples or counts whole locations.
//! `docs/explanation/comparison.md` explains which interval and test serves which kind of metric, and how they perform on
//! simulated skins.
//!
//! A [`Sample`] holds the data of one prototype for one metric. [`estimate`] gives its value, [`compare`] the difference
//! between two samples, [`compare_all`] the corrected differences between several, and [`power::plan`] the presses needed to
//! detect a given difference.

mod bootstrap;
mod compare;
mod comparison;
mod components;
mod error;
mod family;
mod inference;
mod influence;
mod measure;
mod mover;
mod notes;
mod percentile;
pub mod power;
mod presses_needed;
mod quantiles;
mod question;
mod sample;
mod scores;
mod spread;

pub use compare::{compare, estimate};
pub use comparison::{
    Comparison, Components, Design, Interval, Note, PressesNeeded, RequiredDesign, Tost, Verdict,
};
pub use error::{ComparisonError, Side};
pub use family::{AdjustedComparison, Pair, PairSelection, compare_all};
pub use question::{Better, ComparisonTarget, Pairing, Settings};
pub use sample::{Count, Kind, Position, Sample, SampleFault};
