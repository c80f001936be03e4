//! The time base on emulated benches: labels, errors, intervals and limits, from edges and exchanges alone.

#![expect(clippy::unwrap_used, reason = "tests")]

mod bench;
mod calibration;
mod legs;
mod limits;
mod reach;
