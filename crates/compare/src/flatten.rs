//! Flattens structured values to (path, text) pairs.

use serde::Serialize;
use serde_json::Value;

/// Leaves of `value` as (path, text): maps by key, lists of scalars as one text, other lists by 1-based index.
pub fn flatten(path: &str, value: &Value, into: &mut Vec<(String, String)>) {
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                flatten(&format!("{path}.{key}"), value, into);
            }
        }
        Value::Array(items) if items.iter().any(|i| i.is_object() || i.is_array()) => {
            for (i, value) in (1..).zip(items) {
                flatten(&format!("{path}.{i}"), value, into);
            }
        }
        Value::Array(items) => {
            let items: Vec<String> = items.iter().map(leaf).collect();
            into.push((path.to_owned(), format!("[{}]", items.join(", "))));
        }
        value => into.push((path.to_owned(), leaf(value))),
    }
}

fn leaf(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "none".to_owned(),
        Value::Number(number) if number.is_f64() => {
            let shortest = number.to_string();
            let value = number.as_f64().unwrap_or_default();
            match shortest.len() {
                0..=8 => shortest,
                _ if value.abs() < 1e-2 => format!("{value:.4e}"),
                _ => format!("{value:.4}"),
            }
        }
        other => other.to_string(),
    }
}

/// Serialised name of a unit variant.
pub(crate) fn variant_name<T: Serialize>(variant: &T) -> String {
    serde_json::to_value(variant).map_or_else(|_| String::new(), |v| leaf(&v))
}
