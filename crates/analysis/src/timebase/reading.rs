//! A time on one clock for a time on another, with its uncertainty.

use super::smooth::Figure;
use skinrig_statistics::distributions::{student_cdf, student_quantile};

/// A time on one clock, converted from another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// The time, µs.
    pub us: f64,
    /// Standard error from the noise of the ties, µs.
    pub se_us: f64,
    /// Degrees of freedom of that error.
    pub free: f64,
    /// Systematic bound, µs: not reduced by more ties.
    pub bound_us: f64,
}

/// Mean rate of one clock over another, minus 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// The rate difference, ppm.
    pub ppm: f64,
    /// Its standard error, ppm.
    pub se_ppm: f64,
    /// Degrees of freedom of that error.
    pub free: f64,
}

impl Drift {
    pub(super) fn new(figure: Figure) -> Self {
        Self {
            ppm: figure.value * 1e6,
            se_ppm: figure.se * 1e6,
            free: figure.free,
        }
    }

    /// Half width of the interval with this coverage (0..1), ppm.
    #[must_use]
    pub fn half_width_ppm(&self, level: f64) -> f64 {
        self.se_ppm * student_quantile(0.5 * (1.0 + level), self.free)
    }
}

impl Reading {
    pub(super) const fn new(figure: Figure, bound_us: f64) -> Self {
        Self {
            us: figure.value,
            se_us: figure.se,
            free: figure.free,
            bound_us,
        }
    }

    pub(super) fn later(self, by_us: u64) -> Self {
        Self {
            us: self.us + by_us as f64,
            ..self
        }
    }

    /// Half width of the interval for random error with this coverage (0..1), µs.
    #[must_use]
    pub fn half_width_us(&self, level: f64) -> f64 {
        self.se_us * student_quantile(0.5 * (1.0 + level), self.free)
    }

    /// Probability of a smaller random error than this, 0.5 for none.
    #[must_use]
    pub fn rank(&self, error_us: f64) -> f64 {
        student_cdf(error_us / self.se_us, self.free)
    }

    /// Total half width, µs: the 95 % interval plus the systematic bound.
    #[must_use]
    pub fn within_us(&self) -> f64 {
        self.half_width_us(0.95) + self.bound_us
    }
}
