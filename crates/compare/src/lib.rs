//! Whether one skin is better than another.
//!
//! Numbers in, numbers out: no files, no SQL, no devices, no randomness but the seed in the settings.

pub mod statistics;
