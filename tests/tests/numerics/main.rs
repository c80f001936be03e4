//! Stable at the extremes: the fast code beside a slow, obvious reference of higher precision, within bounds that
//! `docs/reference/numerics.md` states and these tests hold. `-- --nocapture` prints the worst error seen against each bound.

#![expect(clippy::unwrap_used, reason = "tests")]

mod bounds;
mod calibration;
mod clocks;
mod laws;
mod lens;
mod precise;
mod presses;
mod rates;
mod rays;
mod reference_cases;
mod same_bits;
mod sums;
#[path = "../../../crates/analysis/tests/session/support.rs"]
mod support;
mod taken;
mod wild;
