//! Parsers of command line values with units and ranges.

use std::fmt;

use super::files::Exclude;
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
    /// Not a number, not from 0 to 100, or a fraction without its unit.
    #[error(
        "expected a share from 0% to 100%, found {found}{}",
        fraction_tip(found)
    )]
    Percent { found: String },
    /// Not a number, or not above 0.
    #[error("expected a number per second above 0, found {found}")]
    PerSecond { found: String },
    /// No presses, or no reason.
    #[error("expected PRESSES=REASON, for example `7,12-14=the lamp failed`, found `{found}`")]
    Exclude { found: String },
    /// Not two whole numbers above 0.
    #[error("expected WIDTHxHEIGHT in pixels, for example `64x48`, found {found}")]
    Grid { found: String },
    /// Neither a factor above 0 nor `max`.
    #[error("expected a factor above 0 or `max`, found {found}")]
    Speed { found: String },
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

/// Size of a grid of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Grid {
    width: u16,
    height: u16,
}

impl Grid {
    /// Its number of pixels.
    #[must_use]
    pub(crate) fn pixels(self) -> u32 {
        u32::from(self.width) * u32::from(self.height)
    }
}

impl fmt::Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// A grid of pixels, as `WIDTHxHEIGHT`.
pub(super) fn grid(text: &str) -> Result<Grid, ValueError> {
    let side = |side: &str| side.trim().parse().ok().filter(|n| *n > 0);
    let sides = text.split_once('x').map(|(w, h)| (side(w), side(h)));
    match sides {
        Some((Some(width), Some(height))) => Ok(Grid { width, height }),
        _ => Err(ValueError::Grid {
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

/// A rate above 0, per second.
pub(super) fn per_second(text: &str) -> Result<f64, ValueError> {
    number_above_zero(text).ok_or_else(|| ValueError::PerSecond {
        found: text.to_owned(),
    })
}

fn number_above_zero(text: &str) -> Option<f64> {
    let value = text.parse::<f64>().ok()?;
    (value > 0.0 && value.is_finite()).then_some(value)
}

/// Speed of a replay relative to the recording; `None`: as fast as possible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ReplaySpeed(pub(crate) Option<f64>);

/// A factor above 0, or `max`.
pub(super) fn replay_speed(text: &str) -> Result<ReplaySpeed, ValueError> {
    if text == "max" {
        return Ok(ReplaySpeed(None));
    }
    let factor = number_above_zero(text.trim_end_matches('x'));
    let found = || ValueError::Speed {
        found: text.to_owned(),
    };
    factor.map(|f| ReplaySpeed(Some(f))).ok_or_else(found)
}

/// When a press may end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum StopRule {
    /// The longer semi-axis of the region is at most this, mm.
    Region(f64),
    /// This long after the touch was felt, ms.
    After(f64),
}

/// A length above 0 or a time above 0.
pub(super) fn stop_rule(text: &str) -> Result<StopRule, ValueError> {
    let either = [Dimension::Length, Dimension::Time];
    quantity::parse(text, &either).map_err(ValueError::Quantity)?;
    match quantity::parse(text, &[Dimension::Length]) {
        Ok(_) => length_mm(text).map(StopRule::Region),
        Err(_) => time_s(text).map(|s| StopRule::After(s * 1e3)),
    }
}

/// Presses and a reason.
pub(super) fn exclude(text: &str) -> Result<Exclude, ValueError> {
    let is_number = |c: char| c.is_ascii_digit() || ", -".contains(c);
    let parts = text
        .split_once('=')
        .map(|(presses, reason)| (presses.trim(), reason.trim()));
    let good = parts.filter(|(presses, reason)| {
        !presses.is_empty() && presses.chars().all(is_number) && !reason.is_empty()
    });
    let (presses, reason) = good.ok_or_else(|| ValueError::Exclude {
        found: text.to_owned(),
    })?;
    Ok(Exclude {
        presses: presses.to_owned(),
        reason: reason.to_owned(),
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

/// What to write instead of a fraction without a unit.
fn fraction_tip(found: &str) -> String {
    match found.trim().parse::<f64>() {
        Ok(share) if share > 0.0 && share <= 1.0 => {
            let percent = (1e10 * share).round() / 1e8;
            format!(": write `{percent}%` or `{share}%`")
        }
        _ => String::new(),
    }
}

/// A percentage from 0 to 100.
pub(super) fn percent(text: &str) -> Result<f64, ValueError> {
    let number = text.strip_suffix('%');
    match number.unwrap_or(text).trim().parse::<f64>() {
        // 0.99 may mean 99 % or 0.99 %.
        Ok(value) if number.is_none() && value > 0.0 && value <= 1.0 => Err(ValueError::Percent {
            found: text.to_owned(),
        }),
        Ok(value) if (0.0..=100.0).contains(&value) => Ok(value),
        _ => Err(ValueError::Percent {
            found: text.to_owned(),
        }),
    }
}
