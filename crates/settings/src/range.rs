//! Ranges of values.

/// The allowed values of a setting, in the unit of the setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ValueRange {
    /// Smallest value.
    pub min: f64,
    /// True if `min` itself is excluded.
    pub above: bool,
    /// Largest value, included.
    pub max: f64,
}

impl ValueRange {
    /// From `min` to `max`, both included.
    #[must_use]
    pub const fn between(min: f64, max: f64) -> Self {
        Self {
            min,
            above: false,
            max,
        }
    }

    /// More than `min`, up to `max`.
    #[must_use]
    pub const fn above(min: f64, max: f64) -> Self {
        Self {
            min,
            above: true,
            max,
        }
    }

    /// More than 0, up to `max`.
    #[must_use]
    pub const fn above_zero(max: f64) -> Self {
        Self::above(0.0, max)
    }

    /// From 0 to `max`, both included.
    #[must_use]
    pub const fn from_zero(max: f64) -> Self {
        Self::between(0.0, max)
    }

    /// True for an allowed value; never for NaN.
    #[must_use]
    pub const fn contains(&self, value: f64) -> bool {
        value <= self.max
            && if self.above {
                value > self.min
            } else {
                value >= self.min
            }
    }

    /// The same range in a unit that is `factor` times as large.
    #[must_use]
    pub const fn in_units_of(self, factor: f64) -> Self {
        Self {
            min: self.min / factor,
            above: self.above,
            max: self.max / factor,
        }
    }

    /// Description for messages: `more than 0 px and at most 50 px`. `unit` may be empty.
    #[must_use]
    pub fn describe(&self, unit: &str) -> String {
        let unit = if unit.is_empty() {
            String::new()
        } else {
            format!(" {unit}")
        };
        let low = if self.above { "more than" } else { "at least" };
        // Without the rounding of a change of units.
        let round = |limit: f64| format!("{limit:.11e}").parse().unwrap_or(limit);
        let (min, max): (f64, f64) = (round(self.min), round(self.max));
        format!("{low} {min}{unit} and at most {max}{unit}")
    }
}
