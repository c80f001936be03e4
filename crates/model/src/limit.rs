//! A limit on a measured value, and the side of it that a value is on.

use serde::{Deserialize, Serialize};

/// A limit, set before the measurement. All fields in the unit of the value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limit {
    /// Smallest good value.
    pub at_least: Option<f64>,
    /// Largest good value.
    pub at_most: Option<f64>,
    /// A good value closer to a limit than this is marginal; 0: never.
    pub margin: f64,
}

/// Side of a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Good, and farther than the margin from the limit.
    Within,
    /// Good, but nearer to the limit than the margin.
    Near,
    /// Beyond the limit.
    Beyond,
}

impl Limit {
    /// An upper limit without a margin.
    #[must_use]
    pub const fn at_most(value: f64) -> Self {
        Self {
            at_least: None,
            at_most: Some(value),
            margin: 0.0,
        }
    }

    /// A lower limit without a margin.
    #[must_use]
    pub const fn at_least(value: f64) -> Self {
        Self {
            at_least: Some(value),
            at_most: None,
            margin: 0.0,
        }
    }

    /// The same limit with this margin.
    #[must_use]
    pub const fn with_margin(self, margin: f64) -> Self {
        Self { margin, ..self }
    }

    /// Side of `value`. A value on the limit is good; NaN is beyond every limit.
    #[must_use]
    pub fn side(&self, value: f64) -> Side {
        let room_below = self.at_least.map_or(f64::INFINITY, |least| value - least);
        let room_above = self.at_most.map_or(f64::INFINITY, |most| most - value);
        let room = room_below.min(room_above);
        if value.is_nan() || room < 0.0 {
            Side::Beyond
        } else if room < self.margin {
            Side::Near
        } else {
            Side::Within
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_on_the_limit_is_good_and_nan_never_is() {
        let limit = Limit {
            at_least: Some(1.0),
            at_most: Some(3.0),
            margin: 0.5,
        };
        for (value, side) in [
            (0.999, Side::Beyond),
            (1.0, Side::Near),
            (1.49, Side::Near),
            (1.5, Side::Within),
            (2.5, Side::Within),
            (2.51, Side::Near),
            (3.0, Side::Near),
            (3.001, Side::Beyond),
            (f64::NAN, Side::Beyond),
            (f64::INFINITY, Side::Beyond),
        ] {
            assert_eq!(limit.side(value), side, "{value}");
        }
        assert_eq!(Limit::at_most(0.0).side(0.0), Side::Within);
        assert_eq!(Limit::at_least(1.0).side(1e300), Side::Within);
    }
}
