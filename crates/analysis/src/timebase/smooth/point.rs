//! Points of a map, and values with their error.

use skinrig_statistics::distributions::student_quantile;

/// Simultaneous times on two clocks, µs, relative to their references.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Point {
    pub from_us: f64,
    pub to_us: f64,
    /// Standard deviation of its noise, in units of that of a usual point; above 0.
    pub spread: f64,
}

impl Point {
    /// A point with typical noise.
    pub(crate) fn new(from_us: f64, to_us: f64) -> Self {
        Self {
            from_us,
            to_us,
            spread: 1.0,
        }
    }
}

/// A value with its standard error and degrees of freedom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Figure {
    pub value: f64,
    pub se: f64,
    pub free: f64,
}

impl Figure {
    /// Difference to another value with independent error: degrees of freedom after Welch (1947).
    pub(crate) fn less(self, other: Self) -> Self {
        let (a, b) = (self.se * self.se, other.se * other.se);
        let free = (a + b) * (a + b) / (a * a / self.free + b * b / other.free);
        Self {
            value: self.value - other.value,
            se: (a + b).sqrt(),
            free: if free.is_finite() {
                free
            } else {
                self.free.min(other.free)
            },
        }
    }

    /// Standard error such that 1.96 of it are half of the 95 % interval, also for few degrees of freedom.
    pub(crate) fn stated_se(self) -> f64 {
        self.se * student_quantile(0.975, self.free) / 1.96
    }
}
