//! Owns the JSON document of a report.

use serde_json::{Value, json as object};

use crate::{ReportInput, comparison};

/// Value of the document's `format` field.
pub const JSON_FORMAT: &str = "skinrig-report";
/// Version of the document's layout.
pub const JSON_VERSION: u32 = 1;

/// Fields of the analysis that are bulk data for figures.
const BULK: [&str; 5] = ["rates", "pictures", "zooms", "activity", "motion"];

/// See [`crate::json`].
pub(crate) fn json(input: &ReportInput<'_>) -> Value {
    // Both are plain data with string keys; JSON has a place for everything in them (NaN becomes null).
    let mut analysis = serde_json::to_value(input.analysis).unwrap_or(Value::Null);
    if let Some(map) = analysis.as_object_mut() {
        for field in BULK {
            map.remove(field);
        }
        if let Some(alignment) = map.get_mut("alignment").and_then(Value::as_object_mut) {
            alignment.remove("residuals");
        }
    }
    object!({
        "format": JSON_FORMAT,
        "format_version": JSON_VERSION,
        "valid": input.analysis.alignment.is_usable(),
        "provenance": input.provenance,
        "analysis": analysis,
        "comparison": comparison::rows(input.analysis),
    })
}
