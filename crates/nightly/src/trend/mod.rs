//! Trends: what moved over the nights, since when, and what probably moved it.
//!
//! Never one night against the last: each series has a reference stretch ([`Reference`]), every night is scored against it, and two
//! sums gather what stays off ([`chart()`]). [`judge`] makes the charts of a whole [`History`], sized so that all of them together
//! raise few false alarms ([`run_length`]), and says what changed in the night in which they moved ([`cause`]).

pub mod cause;
pub mod change;
pub mod chart;
pub mod derived;
pub mod history;
pub mod reference;
pub mod report;
pub mod run_length;

pub use cause::{Attribution, about};
pub use change::Between;
pub use chart::{Chart, Charted, Excursion, Way, chart};
pub use history::{Acceptance, History, NightHead, Point, Series};
pub use reference::Reference;
pub use report::{Alarm, Report, judge};
