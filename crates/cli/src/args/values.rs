//! Values with units and ranges, as the command line takes them.

use skinrig_settings::{Dimension, quantity};

/// A limit that something can be above or below.
pub(super) fn limit_mm(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(mm) if mm > 0.0 && mm.is_finite() => Ok(mm),
        _ => Err(format!("expected a number of mm above 0, found {text}")),
    }
}

/// A length above 0, mm.
pub(super) fn length_mm(text: &str) -> Result<f64, String> {
    above_zero(text, Dimension::Length)
}

/// A time above 0, s.
pub(super) fn time_s(text: &str) -> Result<f64, String> {
    above_zero(text, Dimension::Time)
}

fn above_zero(text: &str, dimension: Dimension) -> Result<f64, String> {
    match quantity::parse(text, &[dimension]) {
        Ok(found) if found.value > 0.0 => Ok(found.value),
        Ok(_) => Err(format!(
            "expected {} above 0, found {text}",
            dimension.name()
        )),
        Err(e) => Err(format!("expected {}, found {}", e.expected, e.found)),
    }
}

/// A probability, neither 0 nor 1.
pub(super) fn probability(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value < 1.0 => Ok(value),
        _ => Err(format!(
            "expected a probability between 0 and 1, found {text}"
        )),
    }
}

/// A share from 0 to 1.
pub(super) fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err(format!("expected a share from 0 to 1, found {text}")),
    }
}

/// A share of presses.
pub(super) fn percent(text: &str) -> Result<f64, String> {
    match text.trim_end_matches('%').trim().parse::<f64>() {
        Ok(value) if (0.0..=100.0).contains(&value) => Ok(value),
        _ => Err(format!("expected a share from 0% to 100%, found {text}")),
    }
}
