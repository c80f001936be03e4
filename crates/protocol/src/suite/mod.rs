//! Suites of checks for a bench, with limits set before the measurement.

mod catalogue;
mod check;
mod file;
mod limits;

pub use check::{Check, Light, Measure, Metric};
pub use file::{Repeats, Suite};
