//! The session file as a whole: what goes in comes out, damage is found, other programs can read it.
#![expect(clippy::unwrap_used, reason = "tests")]

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
