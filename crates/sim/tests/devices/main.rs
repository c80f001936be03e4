//! The simulated and replayed devices, from outside.
#![expect(clippy::unwrap_used, reason = "tests")]

mod common;
mod contract;
mod determinism;
mod faults;
mod replay;
mod stream;
