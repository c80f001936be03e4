//! Parsers of command line values with units and ranges.

use skinrig_settings::Dimension;
use skinrig_settings::quantity::{self, QuantityError};

/// Invalid value of a command line option.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum ValueError {
    /// Not a number, or not above 0.
    #[error("expected a number of mm above 0, found {found}")]
    Limit { found: String },
    /// Not a quantity of the dimension.
    #[error("expected {}, found {}", .0.expected, .0.found)]
    Quantity(QuantityError),
    /// 0 or below.
    #[error("expected {} above 0, found {found}", .dimension.name())]
    NotPositive { dimension: Dimension, found: String },
    /// Not a number, or not between 0 and 1.
    #[error("expected a probability between 0 and 1, found {found}")]
    Probability { found: String },
    /// Not a number, or not from 0 to 1.
    #[error("expected a share from 0 to 1, found {found}")]
    Share { found: String },
    /// Not a number, or not from 0 to 100.
    #[error("expected a share from 0% to 100%, found {found}")]
    Percent { found: String },
}

/// A limit above 0, mm.
pub(super) fn limit_mm(text: &str) -> Result<f64, ValueError> {
    match text.parse::<f64>() {
        Ok(mm) if mm > 0.0 && mm.is_finite() => Ok(mm),
        _ => Err(ValueError::Limit {
            found: text.to_owned(),
        }),
    }
}

/// A length above 0, mm.
pub(super) fn length_mm(text: &str) -> Result<f64, ValueError> {
    above_zero(text, Dimension::Length)
}

/// A time above 0, s.
pub(super) fn time_s(text: &str) -> Result<f64, ValueError> {
    above_zero(text, Dimension::Time)
}

fn above_zero(text: &str, dimension: Dimension) -> Result<f64, ValueError> {
    let quantity = quantity::parse(text, &[dimension]).map_err(ValueError::Quantity)?;
    if quantity.value > 0.0 {
        return Ok(quantity.value);
    }
    Err(ValueError::NotPositive {
        dimension,
        found: text.to_owned(),
    })
}

/// A probability, neither 0 nor 1.
pub(super) fn probability(text: &str) -> Result<f64, ValueError> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value < 1.0 => Ok(value),
        _ => Err(ValueError::Probability {
            found: text.to_owned(),
        }),
    }
}

/// A share from 0 to 1.
pub(super) fn share(text: &str) -> Result<f64, ValueError> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err(ValueError::Share {
            found: text.to_owned(),
        }),
    }
}

/// A percentage from 0 to 100.
pub(super) fn percent(text: &str) -> Result<f64, ValueError> {
    match text.trim_end_matches('%').trim().parse::<f64>() {
        Ok(value) if (0.0..=100.0).contains(&value) => Ok(value),
        _ => Err(ValueError::Percent {
            found: text.to_owned(),
        }),
    }
}
