//! The emulated libdrd as used by a driver: loaded at run time, with its firmware in another process.
#![cfg(unix)]
#![expect(
    clippy::unwrap_used,
    reason = "a bench that does not start must fail its test"
)]

mod faults;
mod host_death;
mod motion;
mod procedure;
mod processes;
mod strictness;
mod support;
