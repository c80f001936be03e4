//! Trends: which metrics moved over the nights, since when, and the probable cause.
//!
//! Single nights are never compared with each other: each series has a reference ([`Reference`]), every night is scored against it,
//! and runs of outliers raise an alarm ([`chart()`]). [`judge`] charts all series of a [`History`] with limits that keep the rate of
//! false alarms low over all of them ([`run_length`]), and attributes each alarm to what changed in that night ([`cause`]).

pub mod cause;
pub mod change;
pub mod chart;
pub mod derived;
pub mod history;
pub mod reference;
pub mod report;
pub mod run_length;

pub use cause::Attribution;
pub use change::ChangeWindow;
pub use chart::{Chart, ChartPoint, Direction, Excursion, chart};
pub use history::{Acceptance, History, NightHead, Point, Series};
pub use reference::Reference;
pub use report::{Alarm, Report, judge};
