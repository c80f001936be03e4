//! Stable at the extremes: the fast code beside a slow, obvious reference of higher precision, within bounds that
//! `docs/numerics.md` states and these tests hold. `-- --nocapture` prints the worst error seen against each bound.

#![expect(clippy::unwrap_used, reason = "tests")]

mod bounds;
mod laws;
mod lens;
mod precise;
mod presses;
mod rays;
