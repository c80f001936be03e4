//! Owns the compression of table columns, which the page's script unpacks.

use serde_json::{Value, json};

/// Denominators for which a column may consist of whole numbers.
const UNITS: [f64; 5] = [1.0, 10.0, 100.0, 1e3, 1e4];
/// Whole numbers above this are not exact in a double.
const EXACT: f64 = 9e15;

/// The shortest of three forms: the cells; `{"runs": [value, count, ...]}`, runs of equal cells; and for numbers `{"steps":
/// column, "per": n}`, the first cell and the differences in units of 1 / n, as cells or runs. Unpacking restores every
/// double exactly: sums of whole numbers are exact, and so is the rounding of their quotient.
pub(super) fn packed(cells: Vec<Value>) -> Value {
    let steps = steps(&cells).map(|(steps, per)| json!({ "steps": in_runs(steps), "per": per }));
    let plain = in_runs(cells);
    match steps {
        Some(steps) if length(&steps) < length(&plain) => steps,
        _ => plain,
    }
}

fn length(value: &Value) -> usize {
    value.to_string().len()
}

fn in_runs(cells: Vec<Value>) -> Value {
    let runs: Vec<&[Value]> = cells.chunk_by(|a, b| a == b).collect();
    if 2 * runs.len() >= cells.len() {
        return Value::Array(cells);
    }
    let pairs = runs.iter().flat_map(|r| [r[0].clone(), json!(r.len())]);
    json!({ "runs": pairs.collect::<Vec<_>>() })
}

/// `None` if a cell is not a number, or has more decimals than the page gives.
fn steps(cells: &[Value]) -> Option<(Vec<Value>, u32)> {
    let numbers: Vec<f64> = cells.iter().map(Value::as_f64).collect::<Option<_>>()?;
    let whole = |unit: f64| {
        let each = numbers.iter();
        each.map(|v| (v * unit).round())
            .zip(&numbers)
            .all(|(w, v)| w.abs() < EXACT && w / unit == *v)
    };
    let unit = UNITS.into_iter().find(|unit| whole(*unit))?;
    let mut last = 0;
    let steps = numbers.iter().map(|v| {
        let now = (v * unit).round() as i64;
        let step = now - last;
        last = now;
        json!(step)
    });
    Some((steps.collect(), unit as u32))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Same algorithm as the page's script.
    fn unpacked(column: &Value) -> Vec<Value> {
        if let Some(cells) = column.as_array() {
            return cells.clone();
        }
        if let Some(runs) = column["runs"].as_array() {
            let count = |c: &Value| c.as_u64().unwrap() as usize;
            return runs
                .chunks(2)
                .flat_map(|r| vec![r[0].clone(); count(&r[1])])
                .collect();
        }
        let (mut sum, per) = (0.0, column["per"].as_f64().unwrap());
        unpacked(&column["steps"])
            .iter()
            .map(|step| {
                sum += step.as_f64().unwrap();
                json!(sum / per)
            })
            .collect()
    }

    #[test]
    fn every_form_holds_every_cell_to_the_last_bit() {
        let columns: [(Vec<Value>, &str); 5] = [
            (
                (0..90).map(|k| json!(f64::from(k) * 190.0 / 1e3)).collect(),
                "steps",
            ),
            (
                (0..90)
                    .map(|k| json!(f64::from(k * k % 7919) / 1e4 + 100.0))
                    .collect(),
                "steps",
            ),
            (vec![json!("located"); 40], "runs"),
            (vec![json!(0.1 + 0.2), Value::Null, json!(1e300)], ""),
            (vec![], ""),
        ];
        for (cells, form) in columns {
            let column = packed(cells.clone());
            assert!(form.is_empty() || column.get(form).is_some(), "{column}");
            let back = unpacked(&column);
            assert_eq!(back.len(), cells.len());
            for (a, b) in cells.iter().zip(&back) {
                assert!(a == b || a.as_f64() == b.as_f64(), "{a} {b}");
            }
        }
    }
}
