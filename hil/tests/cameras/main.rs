//! Checks of cameras, trigger box and disk on simulated devices: results close to the truth, and each fault attributed correctly.
#![expect(clippy::unwrap_used, reason = "tests")]

mod bench;
mod disk;
mod identity;
mod pixels;
mod trigger_line;
