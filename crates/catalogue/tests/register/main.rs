//! Catalogues of recorded sessions: what is registered, what is stale, kills, foreign files.
#![expect(clippy::unwrap_used, reason = "a test")]

#[path = "../../../recorder/tests/session/common.rs"]
#[expect(dead_code, reason = "only part of it is used here")]
mod common;
mod files;
mod kills;
mod migrations;
mod nights;
#[cfg(unix)]
mod postgres;
mod presses;
mod questions;
#[cfg(unix)]
mod server;
mod sessions;
mod support;
mod synthetic;
#[cfg(all(unix, feature = "tls"))]
mod tls;
