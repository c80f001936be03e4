//! Whole session files: round trips, detection of damage, and access by other programs.
#![expect(clippy::unwrap_used, reason = "tests")]

mod cause_examples;
mod causes;
mod chain;
mod common;
mod crash;
mod damage;
mod displaced;
mod gaps;
mod legs;
mod python;
mod readers;
mod round_trip;
mod salvage;
