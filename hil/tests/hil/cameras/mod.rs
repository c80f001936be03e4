//! Tests the checks of cameras, trigger box and disk on simulated devices: results close to the
//! true values, and each fault with the right cause.
#![expect(clippy::unwrap_used, reason = "tests")]

mod bench;
mod disk;
mod identity;
mod pixels;
mod trigger_line;
