//! A suite of checks for a bench: what is measured every night, and the limits that were stated before.

mod catalogue;
mod check;
mod file;
mod limits;

pub use check::{Check, Light, Measure, Metric};
pub use file::{Repeats, Suite};
