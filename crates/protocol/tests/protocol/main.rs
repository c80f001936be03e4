//! Tests of the protocol crate through its public API, in one binary.
#![expect(clippy::unwrap_used, reason = "tests")]

mod common;
mod design;
mod errors;
mod laws;
mod limits;
mod missing;
mod notify;
mod online;
mod remaining;
mod rewritten;
mod rig;
mod scene;
mod schedules;
mod selection;
mod shipped;
mod stop;
mod suite;
mod surface_check;
mod validate;
