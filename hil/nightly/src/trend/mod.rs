//! Trends: which metrics moved, since when, and the probable cause.
//!
//! Nights are never compared with each other. Each series has a reference ([`Reference`]); every
//! night is scored against it, and runs of outliers raise an alarm ([`chart()`]). [`judge`] charts
//! all series of a [`History`], with limits that keep the rate of false alarms over all series low
//! ([`run_length`]), and attributes each alarm to a change of that night ([`cause`]).

pub mod cause;
pub mod change;
pub mod chart;
pub mod derived;
mod drift;
pub mod history;
pub mod reference;
pub mod report;
pub mod run_length;
mod suites;

pub use cause::Attribution;
pub use change::ChangeWindow;
pub use chart::{Chart, ChartPoint, Direction, Excursion, SeriesState, chart};
pub use history::{Acceptance, History, NightSummary, Point, Series};
pub use reference::Reference;
pub use report::{Alarm, Report, is_charted, judge};
pub use suites::{Filter, NoSuchNights, SuiteNights};
