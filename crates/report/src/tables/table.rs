//! Owns a table of the page's script data.

use serde::Serialize;
use serde_json::{Value, json};
use skinrig_analysis::result::Estimate;

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

/// A table under construction: its rows, and column-wise what is shown of them.
pub(crate) struct Table<R> {
    rows: Vec<R>,
    columns: Vec<String>,
    data: Vec<Value>,
}

impl<R> Table<R> {
    pub(crate) fn of(rows: impl IntoIterator<Item = R>) -> Self {
        Self {
            rows: rows.into_iter().collect(),
            columns: vec![],
            data: vec![],
        }
    }

    /// A column of anything.
    pub(crate) fn any<C: Serialize>(
        mut self,
        name: impl Into<String>,
        cell: impl Fn(&R) -> C,
    ) -> Self {
        let cells = self.rows.iter().map(|row| json!(cell(row)));
        self.data.push(packed(cells.collect()));
        self.columns.push(name.into());
        self
    }

    /// A column of numbers with this many decimals; missing and non-finite ones become null.
    pub(super) fn number<N: Into<Option<f64>>>(
        self,
        name: &'static str,
        digits: i32,
        cell: impl Fn(&R) -> N,
    ) -> Self {
        self.any(name, |row| rounded(cell(row).into(), digits))
    }

    /// A column of 0 and 1.
    pub(super) fn flag(self, name: &'static str, cell: impl Fn(&R) -> bool) -> Self {
        self.any(name, |row| u8::from(cell(row)))
    }

    /// Columns of value, low and high end.
    pub(super) fn estimate(
        self,
        [value, low, high]: [&'static str; 3],
        digits: i32,
        cell: impl Fn(&R) -> &Estimate,
    ) -> Self {
        self.number(value, digits, |row| cell(row).value)
            .number(low, digits, |row| cell(row).low)
            .number(high, digits, |row| cell(row).high)
    }

    pub(crate) fn finish(self) -> Value {
        json!({ "columns": self.columns, "data": self.data })
    }
}
