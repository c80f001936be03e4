//! Owns a table of the page's script data.

use serde_json::{Value, json};

use super::packing::packed;

/// A number rounded to `digits` decimals; null if missing or non-finite.
pub(super) fn rounded(value: Option<f64>, digits: i32) -> Value {
    let Some(v) = value.filter(|v| v.is_finite()) else {
        return Value::Null;
    };
    let power = 10f64.powi(digits);
    let r = (v * power).round() / power;
    // Write whole numbers without ".0": they are most of the page's data.
    if r == r.trunc() && r.abs() < 1e15 {
        json!(r as i64)
    } else {
        json!(r)
    }
}

/// A table under construction: names and column-wise data, in order.
pub(super) struct Table {
    columns: Vec<&'static str>,
    data: Vec<Vec<Value>>,
}

impl Table {
    pub(super) const fn new() -> Self {
        Self {
            columns: vec![],
            data: vec![],
        }
    }

    pub(super) fn column(
        mut self,
        name: &'static str,
        cells: impl IntoIterator<Item = Value>,
    ) -> Self {
        self.columns.push(name);
        self.data.push(cells.into_iter().collect());
        self
    }

    pub(super) fn finish(self) -> Value {
        let data: Vec<Value> = self.data.into_iter().map(packed).collect();
        json!({ "columns": self.columns, "data": data })
    }
}
