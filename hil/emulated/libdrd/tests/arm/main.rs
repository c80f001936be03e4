//! The stand-in as a driver meets it: loaded at run time, its firmware in another process.
#![cfg(unix)]
#![expect(
    clippy::unwrap_used,
    reason = "a bench that does not come up must fail its test"
)]

mod faults;
mod host_death;
mod motion;
mod procedure;
mod processes;
mod strictness;
mod support;
