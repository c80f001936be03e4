//! The checks of cameras, trigger box and disk over simulated devices: near the truth when all is well, and each fault where it
//! belongs.
#![expect(clippy::unwrap_used, reason = "tests")]

mod bench;
mod disk;
mod identity;
mod line;
mod pixels;
