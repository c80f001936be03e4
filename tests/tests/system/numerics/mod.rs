//! Numerical stability at extremes: fast code compared with slow, simple references of higher precision, within the bounds
//! stated in `README.md`. `-- --nocapture` prints the worst error observed for each bound.

#![expect(clippy::unwrap_used, reason = "tests")]

mod bounds;
mod calibration;
mod clocks;
mod hostile;
mod laws;
mod lens;
mod precise;
mod presses;
mod rates;
mod rays;
mod reference_cases;
mod same_bits;
mod settings;
mod sums;
