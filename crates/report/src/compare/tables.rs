//! Owns the data behind the figures of a comparison, for the page's CSV downloads.

use serde_json::{Value, json};
use skinrig_compare::Comparison;

/// Named tables in column-wise layout.
pub(super) fn script_data(result: &Comparison) -> Value {
    json!({
        "session": "comparison",
        "tables": {
            "locations": locations(result),
            "metrics": metrics(result),
            "causes": causes(result),
        },
    })
}

fn table(columns: Vec<String>, rows: &[Vec<Value>]) -> Value {
    let data: Vec<Vec<&Value>> = (0..columns.len())
        .map(|c| rows.iter().map(|r| &r[c]).collect())
        .collect();
    json!({ "columns": columns, "data": data })
}

fn locations(result: &Comparison) -> Value {
    let mut columns = vec!["x_mm".to_owned(), "y_mm".to_owned()];
    for skin in &result.skins {
        for name in [
            "error_mm",
            "vector_x_mm",
            "vector_y_mm",
            "presses",
            "attempted",
            "rank",
            "difference_mm",
            "difference_low_mm",
            "difference_high_mm",
        ] {
            columns.push(format!("{}_{name}", skin.letter));
        }
    }
    let rows: Vec<Vec<Value>> = result
        .locations
        .iter()
        .map(|l| {
            let mut row = vec![json!(l.at.x_mm), json!(l.at.y_mm)];
            for here in &l.skins {
                let d = here.difference_mm;
                row.extend([
                    json!(here.error_mm),
                    json!(here.vector_mm.map(|v| v[0])),
                    json!(here.vector_mm.map(|v| v[1])),
                    json!(here.presses[0]),
                    json!(here.presses[1]),
                    json!(here.rank),
                    json!(d.map(|d| d.value)),
                    json!(d.and_then(|d| d.low)),
                    json!(d.and_then(|d| d.high)),
                ]);
            }
            row
        })
        .collect();
    table(columns, &rows)
}

fn metrics(result: &Comparison) -> Value {
    let columns = [
        "metric",
        "unit",
        "skin",
        "a",
        "b",
        "difference",
        "low",
        "high",
        "margin",
        "verdict",
    ];
    let mut rows = Vec::new();
    for row in &result.table {
        for found in &row.against_first {
            let c = found.comparison.as_ref();
            rows.push(vec![
                json!(row.metric.key()),
                json!(row.unit),
                json!(result.skins[found.subject].letter),
                json!(c.map(|c| c.a.value)),
                json!(c.map(|c| c.b.value)),
                json!(c.map(|c| c.difference.value)),
                json!(c.and_then(|c| c.difference.low)),
                json!(c.and_then(|c| c.difference.high)),
                json!(row.margin),
                json!(found.verdict),
            ]);
        }
    }
    table(columns.map(str::to_owned).to_vec(), &rows)
}

fn causes(result: &Comparison) -> Value {
    let columns = ["skin", "factor", "mm2", "low_mm2", "high_mm2"];
    let mut rows = Vec::new();
    for (skin, causes) in result.skins.iter().skip(1).zip(&result.causes) {
        for c in causes.iter().flat_map(|c| &c.contributions) {
            rows.push(vec![
                json!(skin.letter),
                json!(c.factor),
                json!(c.mm2.value),
                json!(c.mm2.low),
                json!(c.mm2.high),
            ]);
        }
    }
    table(columns.map(str::to_owned).to_vec(), &rows)
}
