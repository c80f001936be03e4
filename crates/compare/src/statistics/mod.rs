//! The statistics of comparing skins: intervals, tests, verdicts and sample sizes, with locations as clusters.
//!
//! Presses at one location share its error and are not independent: whatever is computed here draws, or counts, whole
//! locations. `docs/explanation/comparison.md` says which interval and which test serves which kind of metric, why, and how they
//! behave on simulated skins.
//!
//! A [`Sample`] is what one prototype contributes for one metric. [`estimate`] gives its value, [`compare`] the
//! difference between two, [`compare_all`] the differences between several, corrected for their number, and
//! [`power::plan`] what to press to find a difference of a given size.

mod bootstrap;
mod compare;
mod comparison;
mod components;
mod family;
mod inference;
mod influence;
mod measure;
mod mover;
mod needed;
mod notes;
pub mod power;
mod quantiles;
mod question;
mod ranked;
mod refusal;
mod sample;
mod scores;
mod spread;

pub use compare::{compare, estimate};
pub use comparison::{
    Comparison, Components, Design, Enough, Interval, Needed, Note, Tost, Verdict,
};
pub use family::{Adjusted, Against, Pair, compare_all};
pub use question::{Better, Pairing, Question, Settings};
pub use refusal::{Refusal, Side};
pub use sample::{Count, Kind, Position, Sample, SampleFault};
