//! Types for the value of a key, and structs that declare the keys of a mapping.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::diagnostic::Collector;
use crate::field::{Field, Value};
use crate::shape::{Shape, Table, Word};
use crate::source::Span;
use crate::yaml::join;

/// A struct whose fields are the keys of a mapping; see the [crate] for how `#[derive(Settings)]` declares them.
pub trait Settings: Sized {
    /// Its keys.
    const TABLE: &'static Table;

    /// Converts a mapping that was read by [`Settings::TABLE`]. `None` if a required key is missing or a check fails; the
    /// reasons are in `out`.
    fn from_mapping(field: &Field, out: &mut Collector) -> Option<Self>;

    /// Adds one row per value, nested mappings included. `path` is the key path of this mapping, empty for a whole file.
    fn add_rows(&self, path: &str, rows: &mut Vec<Row>);

    /// One row per value, in the order of the declaration.
    #[must_use]
    fn rows(&self) -> Vec<Row> {
        let mut rows = Vec::new();
        self.add_rows("", &mut rows);
        rows
    }

    /// The first value outside its declared range, for a value built in code.
    #[must_use]
    fn out_of_range(&self) -> Option<OutOfRange> {
        self.rows().into_iter().find_map(|row| {
            Some(OutOfRange {
                expected: row.expected?,
                key: row.key,
                found: row.value,
            })
        })
    }
}

/// A value as typed in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Key path, for example `latency.bin`.
    pub key: String,
    /// Documentation of the key.
    pub doc: &'static str,
    /// The value with its unit, for example `0.2 ms`; empty for an optional key that is absent.
    pub value: String,
    /// The declared range, if the value is outside it.
    pub expected: Option<String>,
}

/// A value outside its declared range.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutOfRange {
    /// Key path.
    pub key: String,
    /// The range, for example `more than 0 px and at most 50 px`.
    pub expected: String,
    /// The value with its unit.
    pub found: String,
}

/// A type for the value of a key.
pub trait Setting: Sized {
    /// The form of the value.
    const SHAPE: Shape;

    /// Converts a field that was read by [`Setting::SHAPE`]. `None` if a check fails; the reason is in `out`.
    fn from_field(field: &Field, out: &mut Collector) -> Option<Self>;

    /// The value as typed.
    fn text(&self) -> String;

    /// Adds the rows of the value at the key path `key`: one, or several for a mapping.
    fn add_rows(&self, key: &str, doc: &'static str, rows: &mut Vec<Row>) {
        rows.push(Row {
            key: key.to_owned(),
            doc,
            value: self.text(),
            expected: None,
        });
    }
}

/// A choice of words: an enum with `#[derive(Choice)]`. A variant's word is its name in snake case, its documentation the
/// meaning of the word.
pub trait Choice: Copy + 'static {
    /// Every variant, in the order of the declaration.
    const ALL: &'static [Self];
    /// The words and their meanings, in the same order.
    const WORDS: &'static [Word];

    /// The variant's word.
    fn word(self) -> &'static str;

    /// The variant of a word.
    #[must_use]
    fn from_word(word: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|v| v.word() == word)
    }
}

impl Setting for String {
    const SHAPE: Shape = Shape::Text;

    fn from_field(field: &Field, _: &mut Collector) -> Option<Self> {
        field.as_text().map(str::to_owned)
    }

    fn text(&self) -> String {
        self.clone()
    }
}

impl Setting for PathBuf {
    const SHAPE: Shape = Shape::Text;

    fn from_field(field: &Field, _: &mut Collector) -> Option<Self> {
        field.as_text().map(Self::from)
    }

    fn text(&self) -> String {
        self.display().to_string()
    }
}

impl Setting for bool {
    const SHAPE: Shape = Shape::Flag;

    fn from_field(field: &Field, _: &mut Collector) -> Option<Self> {
        field.as_flag()
    }

    fn text(&self) -> String {
        self.to_string()
    }
}

/// Values with free names, such as biases.
impl Setting for BTreeMap<String, i64> {
    const SHAPE: Shape = Shape::Named(&Shape::Whole {
        min: i32::MIN as i64,
        max: i32::MAX as i64,
    });

    fn from_field(field: &Field, _: &mut Collector) -> Option<Self> {
        let entries = field.entries().iter();
        entries
            .map(|(name, value)| Some((name.clone(), value.as_whole()?)))
            .collect()
    }

    fn text(&self) -> String {
        let entries: Vec<String> = self.iter().map(|(k, v)| format!("{k}: {v}")).collect();
        format!("{{{}}}", entries.join(", "))
    }
}

/// Numbers counted from 1 and spans of them, such as `[1, 3-5]`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Numbers(pub Vec<NumberSpan>);

/// The numbers from `first` to `last`, and the location of their text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NumberSpan {
    /// First number, at least 1.
    pub first: u32,
    /// Last number, at least `first`.
    pub last: u32,
    /// Location of the text.
    pub span: Span,
}

impl Setting for Numbers {
    const SHAPE: Shape = Shape::Numbers;

    fn from_field(field: &Field, _: &mut Collector) -> Option<Self> {
        let Value::Numbers(spans) = &field.value else {
            return None;
        };
        let spans = spans.iter();
        let spans = spans.map(|&(first, last, span)| NumberSpan { first, last, span });
        Some(Self(spans.collect()))
    }

    fn text(&self) -> String {
        let spans = self.0.iter().map(|s| match s.first == s.last {
            true => s.first.to_string(),
            false => format!("{}-{}", s.first, s.last),
        });
        format!("[{}]", spans.collect::<Vec<_>>().join(", "))
    }
}

/// Converts a quantity from its dimension's own unit to another unit, of which `per` make one: seconds to milliseconds with 1000.
/// Times are rounded to whole nanoseconds, which removes the last-bit noise of the factor.
#[must_use]
pub fn in_unit(value: f64, per: f64) -> f64 {
    const STEPS: f64 = 1e9;
    if per == 1.0 {
        value
    } else {
        (value * STEPS).round() / (STEPS / per)
    }
}

/// A quantity as a whole number of a unit, of which `per` make one of the dimension's own. `None` with a finding for a fraction.
pub fn whole_units(field: &Field, unit: &str, per: f64, out: &mut Collector) -> Option<i64> {
    let Value::Quantity(value, _) = field.value else {
        return None;
    };
    let found = value * per;
    if (found - found.round()).abs() > 1e-6 {
        out.error(
            field.span,
            field.path.as_str(),
            "not a whole number of its unit",
        )
        .expected(format!("whole {unit}, such as `{} {unit}`", found.ceil()))
        .found(format!("{found} {unit}"));
        return None;
    }
    Some(found.round() as i64)
}

/// The key path of `name` in the mapping at `path`.
#[doc(hidden)]
#[must_use]
pub fn key_path(path: &str, name: &str) -> String {
    join(path, name)
}
