//! What counts as a difference between skins: the margins of a comparison, from a file or one by one.

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::build::hex;
use crate::keys::{count, default, optional, required};
use crate::shape::{Field, Key, Keys, Need, Range, Shape, Table, Value};
use skinrig_settings::expectation;
use skinrig_settings::open;
use skinrig_settings::{Diagnostics, did_you_mean, one_of};
use skinrig_settings::{Dimension, quantity};

/// The version of the language of limits that this crate reads.
const VERSION: i64 = 1;

const LENGTH: Shape = Shape::Quantity(&[Dimension::Length], Range::above_zero(1000.0));
const SHARE: Shape = Shape::Quantity(&[Dimension::Share], Range::above_zero(100.0));
const TIME: Shape = Shape::Quantity(&[Dimension::Time], Range::above_zero(60.0));
const FREQUENCY: Shape = Shape::Quantity(&[Dimension::Frequency], Range::above_zero(1e6));
const EVENTS: Shape = Shape::Quantity(&[Dimension::EventRate], Range::above_zero(1e12));
const BYTES: Shape = Shape::Quantity(&[Dimension::DataRate], Range::above_zero(1e12));
const PLACES: Shape = Shape::Number(Range::above_zero(1e9));

/// The whole file.
pub(crate) static LIMITS: Table = Table {
    name: "limits",
    doc: "Limits of a comparison of skins: what is within a margin is no difference to care about.",
    keys: &[
        required(
            "skinrig_limits",
            count(VERSION, VERSION),
            "Version of the language of limits: 1.",
        ),
        required(
            "name",
            Shape::Text,
            "Name of these limits. It stands in every comparison made with them.",
        ),
        optional(
            "within",
            LENGTH,
            "The error that `within_rate` asks about; absent: that of the first skin's analysis.",
        ),
        default(
            "margins",
            Shape::Map(&MARGINS),
            "{}",
            "Per metric, the largest difference that is none. A metric without one is shown and not judged.",
        ),
    ],
    exactly_one: &[],
};

static MARGINS: Table = Table {
    name: "margins",
    doc: "The largest difference that counts as none, by metric.",
    keys: &[
        optional("rmse", LENGTH, "Of the RMSE."),
        optional("rmse_x", LENGTH, "Of the RMSE along x."),
        optional("rmse_y", LENGTH, "Of the RMSE along y."),
        optional(
            "bias_x",
            LENGTH,
            "Of the mean error along x, whatever its sign.",
        ),
        optional(
            "bias_y",
            LENGTH,
            "Of the mean error along y, whatever its sign.",
        ),
        optional(
            "repeat_std",
            LENGTH,
            "Of the standard deviation between repetitions.",
        ),
        optional(
            "located_rate",
            SHARE,
            "Of the share of presses that are located, in percentage points.",
        ),
        optional(
            "within_rate",
            SHARE,
            "Of the share of presses located within `within`, in percentage points.",
        ),
        optional(
            "latency",
            TIME,
            "Of the median time from contact to detection.",
        ),
        optional(
            "latency_width",
            TIME,
            "Of the time from the 5th to the 95th percentile of the detections.",
        ),
        optional(
            "false_alarms",
            FREQUENCY,
            "Of the false alarms per second without a touch.",
        ),
        optional(
            "idle_events",
            EVENTS,
            "Of the events per second between presses, both cameras together.",
        ),
        optional(
            "press_events",
            EVENTS,
            "Of the events per second during presses, both cameras together.",
        ),
        optional(
            "press_bytes",
            BYTES,
            "Of the bytes per second during presses, both cameras together.",
        ),
        optional(
            "taxels",
            PLACES,
            "Of the number of places that the skin tells apart.",
        ),
    ],
    exactly_one: &[],
};

/// A margin: the name of its metric, and how large.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Margin {
    /// As typed, for example `rmse`.
    pub metric: &'static str,
    /// mm, s, 1/s, events per second, bytes per second, a number of places, or percentage points.
    pub value: f64,
}

impl Margin {
    /// A margin as typed on the command line: `rmse=0.5mm`.
    ///
    /// # Errors
    /// What is wrong, in one line: no `=`, no such metric, or no quantity that fits it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let names = || MARGINS.keys.iter().map(|k| k.name);
        let (name, value) = text.split_once('=').ok_or_else(|| {
            format!("expected METRIC=MARGIN, for example rmse=0.5mm, found `{text}`")
        })?;
        let name = name.trim();
        let key = MARGINS
            .keys
            .iter()
            .find(|k| k.name == name)
            .ok_or_else(|| {
                let near =
                    did_you_mean(name, names()).map_or(String::new(), |text| format!("; {text}"));
                format!("expected one of {}, found `{name}`{near}", one_of(names()))
            })?;
        let wrong = |found: String| format!("expected {}, found {found}", expected(key));
        let (value, range, unit) = match &key.shape {
            Shape::Quantity(wanted, range) => {
                let found = quantity::parse(value, wanted).map_err(|e| wrong(e.found))?;
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
            return Err(format!(
                "expected {}, found {value} {unit}",
                range.describe(unit)
            ));
        }
        let metric = key.name;
        Ok(Self { metric, value })
    }
}

fn expected(key: &Key) -> String {
    debug_assert!(matches!(key.need, Need::Optional));
    expectation(&key.shape)
}

/// The limits of a comparison, read and checked.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limits {
    /// The file's name as given to [`Limits::parse`].
    pub file_name: String,
    /// Lower-case hex SHA-256 of its text.
    pub sha256: String,
    /// Their name.
    pub name: String,
    /// The error that a press may have to be within, mm.
    pub within_mm: Option<f64>,
    /// The margins, each metric at most once.
    pub margins: Vec<Margin>,
}

impl Limits {
    /// Reads limits from the bytes of a file named `name`.
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, Diagnostics> {
        let (out, root) = open(name, bytes, &[], &LIMITS)?;
        let read = root.and_then(|root| {
            Some(Self {
                file_name: name.to_owned(),
                sha256: hex(&Sha256::digest(bytes)),
                name: root.text("name")?,
                within_mm: root.quantity("within"),
                margins: root.get("margins").map(margins).unwrap_or_default(),
            })
        });
        match read {
            Some(limits) if out.is_clean() => Ok(limits),
            _ => Err(out.finish()),
        }
    }

    /// Puts a margin in the place of the file's, if it has one.
    pub fn set(&mut self, margin: Margin) {
        self.margins.retain(|m| m.metric != margin.metric);
        self.margins.push(margin);
    }
}

fn margins(of: &Field) -> Vec<Margin> {
    let value = |key: &Key| match of.get(key.name)?.value {
        Value::Quantity(value, _) | Value::Number(value) => Some(value),
        _ => None,
    };
    MARGINS
        .keys
        .iter()
        .filter_map(|key| {
            Some(Margin {
                metric: key.name,
                value: value(key)?,
            })
        })
        .collect()
}
