//! Shapes in words, for "expected", and as examples that are ready to type.

use crate::diagnostic::one_of;
use crate::quantity::{self, Dimension};
use crate::range::ValueRange;
use crate::shape::{Key, Need, Shape, Table};

/// The keys of a table for "expected".
pub(crate) fn key_names(table: &Table) -> String {
    match table.keys {
        [only] => format!("the key `{}`", only.name),
        keys => format!(
            "the keys {}",
            one_of(keys.iter().map(|k| k.name)).replace(" or `", " and `")
        ),
    }
}

/// Description of a shape, for "expected".
#[must_use]
pub fn expectation(shape: &Shape) -> String {
    match shape {
        Shape::Text => "a text".to_owned(),
        Shape::Whole { min, max: i64::MAX } => {
            format!("a whole number of at least {min}, without a unit")
        }
        Shape::Whole { min, max } if min == max => format!("`{min}`, nothing else"),
        Shape::Whole { min, max } => format!("a whole number from {min} to {max}, without a unit"),
        Shape::Number(range) => format!("a number without a unit, {}", range.describe("")),
        Shape::Flag => "`true` or `false`".to_owned(),
        Shape::Quantity(dimensions, _) => dimensions
            .iter()
            .map(|d| format!("{} such as `{}`", d.name(), d.example()))
            .collect::<Vec<_>>()
            .join(" or "),
        Shape::Choice(words) => one_of(words.iter().map(|(w, _)| *w)),
        Shape::Tuple(of, names) => {
            format!("a list [{}], each {}", names.join(", "), expectation(of))
        }
        Shape::List { of, .. } => format!("a list, each item {}", expectation(of)),
        Shape::Map(table) => format!("a mapping with {}", key_names(table)),
        Shape::WordOr(words, table) => format!(
            "{}, or a mapping with {}",
            one_of(words.iter().map(|(w, _)| *w)),
            key_names(table)
        ),
        Shape::Named(of) => format!("a mapping from names to values, each {}", expectation(of)),
        Shape::Numbers => "a list of numbers counted from 1 or spans such as `2-10`".to_owned(),
    }
}

/// An entry of a mapping, ready to type: `depth: 4 mm`.
pub(crate) fn entry_example(key: &Key) -> String {
    let declared = key.example.map(str::to_owned);
    let value = declared.unwrap_or_else(|| example(&key.shape));
    format!("{}: {value}", key.name)
}

/// A value of this shape, ready to type.
#[must_use]
pub fn example(shape: &Shape) -> String {
    match shape {
        Shape::Text => "example".to_owned(),
        Shape::Whole { min, max } => 0.clamp(*min, *max).to_string(),
        Shape::Number(range) => plain_number(range).to_string(),
        Shape::Flag => "true".to_owned(),
        Shape::Quantity(dimensions, range) => dimensions
            .first()
            .map_or_else(String::new, |d| quantity_example(*d, range)),
        Shape::Choice(words) | Shape::WordOr(words, _) => {
            words.first().map_or("", |(w, _)| *w).to_owned()
        }
        Shape::Tuple(of, names) => format!("[{}]", vec![example(of); names.len()].join(", ")),
        Shape::List { of, min, .. } => {
            format!("[{}]", vec![example(of); (*min).max(1)].join(", "))
        }
        Shape::Map(table) => {
            let first_of = |group: &[&str]| {
                let mut keys = table.keys.iter();
                keys.find(|k| group.contains(&k.name)).map(|k| k.name)
            };
            let any: Vec<&str> = table.at_least_one().collect();
            let groups = table.exactly_one.iter().copied().chain([any.as_slice()]);
            let chosen: Vec<&str> = groups.filter_map(first_of).collect();
            let needed = |k: &&Key| k.need == Need::Required || chosen.contains(&k.name);
            let entries: Vec<String> = table
                .keys
                .iter()
                .filter(needed)
                .map(entry_example)
                .collect();
            format!("{{{}}}", entries.join(", "))
        }
        Shape::Named(_) => "{}".to_owned(),
        Shape::Numbers => "[1]".to_owned(),
    }
}

/// A short number inside a range.
fn plain_number(range: &ValueRange) -> f64 {
    let candidates = [1.0, 0.5, 0.1, 0.01, range.max];
    let inside = candidates.into_iter().find(|n| range.contains(*n));
    inside.unwrap_or(range.min)
}

/// The usual example of a dimension where the range allows it.
fn quantity_example(dimension: Dimension, range: &ValueRange) -> String {
    let usual = dimension.example();
    match quantity::parse(usual, &[dimension]) {
        Ok(q) if range.contains(q.value) => usual.to_owned(),
        _ => format!("{} {}", plain_number(range), dimension.usual_unit()),
    }
}
