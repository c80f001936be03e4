//! Tests the statistics of the comparison on skins with known true values.
#![expect(clippy::unwrap_used, reason = "a failing test may panic")]

mod family;
mod laws;
mod levels;
mod populations;
mod power;
mod refusals;
mod sequential;
mod sessions;
mod stopping;
