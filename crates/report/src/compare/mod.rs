//! Owns the presentation of a skin comparison: terminal table, JSON, HTML page with figures.

mod figures;
mod looks;
mod metrics;
mod page;
mod tables;
mod terminal;
mod text;

pub use page::html;
pub use terminal::terminal_table;

use serde_json::Value;
use skinrig_compare::Comparison;

/// Value of the document's `format` field.
pub(crate) const JSON_FORMAT: &str = "skinrig-comparison";
/// Version of the document's layout.
pub const JSON_VERSION: u32 = 1;

/// The comparison as JSON for programs: `format`, `format_version`, and the fields of [`Comparison`]. Absent values are
/// `null`.
#[must_use]
pub fn json(result: &Comparison) -> Value {
    let mut document = serde_json::to_value(result).unwrap_or(Value::Null);
    if let Some(map) = document.as_object_mut() {
        map.insert("format".into(), JSON_FORMAT.into());
        map.insert("format_version".into(), JSON_VERSION.into());
        let blocked = result.blocking().next().is_some();
        map.insert("blocked".into(), blocked.into());
    }
    document
}
