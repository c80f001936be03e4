//! Statistics of the comparison, on skins with a known truth.
#![expect(clippy::unwrap_used, reason = "a test that cannot compare must fail")]

mod family;
mod laws;
mod levels;
mod populations;
mod power;
mod refusals;
