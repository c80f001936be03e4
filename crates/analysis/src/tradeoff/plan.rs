//! Which choices to measure, and how far the measurement is.

use super::rows::Row;

/// Choices to try.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// Try every combination instead of single changes, draws and promising combinations.
    pub full: bool,
    /// Further random combinations, whose predictions are compared with what they measure.
    pub checks: usize,
    /// Timed runs per choice, at least 1.
    pub repeats: u32,
    /// Minimum located rate to compete, 0..=1; `None`: that of the session's own settings minus 1 %.
    pub least_located: Option<f64>,
}

/// State of a measurement.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Choices measured so far.
    pub measured: usize,
    /// The competing choice with the smallest RMSE so far.
    pub best: Option<&'a Row>,
}
