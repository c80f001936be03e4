//! Margins of a comparison between skins, from a file or one by one.

use std::fmt;

use serde::Serialize;
use sha2::{Digest, Sha256};
use skinrig_settings::{
    Collector, Diagnostics, Field, Setting, Settings, Shape, Value, ValueRange, did_you_mean,
    expectation, one_of, open, quantity,
};

use crate::file::hex;

const LENGTH: ValueRange = ValueRange::above_zero(1000.0);
const SHARE: ValueRange = ValueRange::above_zero(100.0);
const TIME: ValueRange = ValueRange::above_zero(60.0);
const RATE: ValueRange = ValueRange::above_zero(1e12);

/// Limits of a comparison of skins: differences within a margin count as equal.
#[derive(Debug, Clone, PartialEq, Serialize, Settings)]
#[settings(name = "limits", version = "skinrig_limits")]
pub struct Limits {
    /// The file's name as given to [`Limits::parse`].
    #[setting(skip)]
    pub file_name: String,
    /// Lower-case hex SHA-256 of its text.
    #[setting(skip)]
    pub sha256: String,
    /// Name of these limits. Every comparison made with them shows it.
    #[setting(example = "mine")]
    pub name: String,
    /// Error bound of `within_rate`; absent: that of the first skin's analysis.
    #[setting(range = LENGTH)]
    pub within_mm: Option<f64>,
    /// Largest difference per metric that counts as equal. A metric without a margin is shown but not judged.
    #[setting(default = "{}", value = Vec::new(), shape = Margins::SHAPE, read = Margins::list)]
    pub margins: Vec<Margin>,
}

/// Largest difference per metric that counts as equal.
#[derive(Settings)]
struct Margins {
    /// Of the RMSE.
    #[setting(range = LENGTH)]
    rmse_mm: Option<f64>,
    /// Of the RMSE along x.
    #[setting(range = LENGTH)]
    rmse_x_mm: Option<f64>,
    /// Of the RMSE along y.
    #[setting(range = LENGTH)]
    rmse_y_mm: Option<f64>,
    /// Of the mean error along x, whatever its sign.
    #[setting(range = LENGTH)]
    bias_x_mm: Option<f64>,
    /// Of the mean error along y, whatever its sign.
    #[setting(range = LENGTH)]
    bias_y_mm: Option<f64>,
    /// Of the standard deviation between repetitions.
    #[setting(range = LENGTH)]
    repeat_std_mm: Option<f64>,
    /// Of the share of presses that are located, in percentage points.
    #[setting(range = SHARE)]
    located_rate_percent: Option<f64>,
    /// Of the share of presses located within `within`, in percentage points.
    #[setting(range = SHARE)]
    within_rate_percent: Option<f64>,
    /// Of the median time from contact to detection.
    #[setting(range = TIME)]
    latency_s: Option<f64>,
    /// Of the time from the 5th to the 95th percentile of the detections.
    #[setting(range = TIME)]
    latency_width_s: Option<f64>,
    /// Of the false alarms per second without a touch.
    #[setting(above = 0, max = 1e6)]
    false_alarms_hz: Option<f64>,
    /// Of the events per second between presses, both cameras together.
    #[setting(range = RATE)]
    idle_events_ev_s: Option<f64>,
    /// Of the events per second during presses, both cameras together.
    #[setting(range = RATE)]
    press_events_ev_s: Option<f64>,
    /// Of the bytes per second during presses, both cameras together.
    #[setting(range = RATE)]
    press_bytes_b_s: Option<f64>,
    /// Of the number of locations that the skin can distinguish.
    #[setting(above = 0, max = 1e9)]
    taxels: Option<f64>,
}

impl Margins {
    /// The margins of a file, in the order of the keys.
    fn list(f: &Field, _: &mut Collector) -> Option<Vec<Margin>> {
        let value = |field: &Field| match field.value {
            Value::Quantity(value, _) | Value::Number(value) => Some(value),
            _ => None,
        };
        let keys = Self::TABLE.keys.iter().map(|key| key.name);
        let given = keys.filter_map(|metric| Some((metric, f.get(metric)?)));
        given
            .map(|(metric, field)| {
                Some(Margin {
                    metric,
                    value: value(field)?,
                })
            })
            .collect()
    }
}

/// Reason why a text is not a margin.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MarginError {
    /// There is no `=`.
    NoAssignment(String),
    /// No metric has this name.
    UnknownMetric {
        /// The name.
        name: String,
        /// All metrics.
        known: String,
        /// Suggestion for a misspelt name.
        help: Option<String>,
    },
    /// The value is not a valid margin of the metric.
    Value {
        /// Valid values.
        expected: String,
        /// Actual value.
        found: String,
    },
}

impl fmt::Display for MarginError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoAssignment(text) => write!(
                f,
                "expected METRIC=MARGIN, for example rmse=0.5mm, found `{text}`"
            ),
            Self::UnknownMetric { name, known, help } => {
                write!(f, "expected one of {known}, found `{name}`")?;
                help.iter().try_for_each(|help| write!(f, "; {help}"))
            }
            Self::Value { expected, found } => write!(f, "expected {expected}, found {found}"),
        }
    }
}

impl std::error::Error for MarginError {}

/// A margin of one metric.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Margin {
    /// As typed, for example `rmse`.
    pub metric: &'static str,
    /// In the metric's unit: mm, s, Hz, ev/s, B/s, percentage points, or a bare number.
    pub value: f64,
}

impl Margin {
    /// A margin as typed on the command line: `rmse=0.5mm`.
    ///
    /// # Errors
    /// A missing `=`, an unknown metric, or a quantity of the wrong kind.
    pub fn parse(text: &str) -> Result<Self, MarginError> {
        let names = || Margins::TABLE.keys.iter().map(|k| k.name);
        let (name, value) = text
            .split_once('=')
            .ok_or_else(|| MarginError::NoAssignment(text.to_owned()))?;
        let name = name.trim();
        let key = Margins::TABLE
            .keys
            .iter()
            .find(|k| k.name == name)
            .ok_or_else(|| MarginError::UnknownMetric {
                name: name.to_owned(),
                known: one_of(names()),
                help: did_you_mean(name, names()),
            })?;
        let wrong = |found: String| MarginError::Value {
            expected: expectation(&key.shape),
            found,
        };
        let (value, range, unit) = match &key.shape {
            Shape::Quantity(dimensions, range) => {
                let found = quantity::parse(value, dimensions).map_err(|e| wrong(e.found))?;
                (found.value, range, found.dimension.usual_unit())
            }
            Shape::Number(range) => {
                let number = value
                    .trim()
                    .parse()
                    .map_err(|_| wrong(format!("`{value}`")))?;
                (number, range, "")
            }
            _ => return Err(wrong(format!("`{value}`"))),
        };
        if !range.contains(value) {
            return Err(MarginError::Value {
                expected: range.describe(unit),
                found: format!("{value} {unit}"),
            });
        }
        let metric = key.name;
        Ok(Self { metric, value })
    }
}

impl Limits {
    /// Reads limits from the bytes of a file named `name`.
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, Diagnostics> {
        let (mut out, root) = open(name, bytes, &[], Self::TABLE)?;
        match root.and_then(|root| Self::from_mapping(&root, &mut out)) {
            Some(limits) if out.is_clean() => Ok(Self {
                file_name: name.to_owned(),
                sha256: hex(&Sha256::digest(bytes)),
                ..limits
            }),
            _ => Err(out.finish()),
        }
    }

    /// Sets one margin; replaces that of the file.
    pub fn set(&mut self, margin: Margin) {
        self.margins.retain(|m| m.metric != margin.metric);
        self.margins.push(margin);
    }
}
