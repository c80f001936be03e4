//! The statistics of comparing skins, on skins whose truth is known.
#![expect(clippy::unwrap_used, reason = "a test that cannot compare must fail")]

mod family;
mod laws;
mod levels;
mod populations;
mod power;
mod refusals;
