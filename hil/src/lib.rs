//! The nightly suite on a bench: what is measured on each device, in which order, and for how long.
//!
//! A check ([`checks::make`]) asks a [`Bench`] for devices, which it knows by their traits alone, and fills a [`Findings`]: values, and
//! evidence of whatever kept it from measuring. It never judges: limits, verdicts and causes are `skinrig-nightly`'s.

pub mod arm;
pub mod bench;
pub mod cause;
pub mod checks;
pub mod findings;
pub mod history;
pub mod lease;
pub mod room;
pub mod runner;
mod streams;
pub mod trouble;

pub use bench::{Bench, Devices, Drilled, GoldenRun, Slot, Trouble};
pub use findings::{Findings, GoldenKept};
pub use runner::{Onlooker, Tonight};
