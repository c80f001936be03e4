//! Terminal text of true digits: the metrics, the results with the fewest digits, and decisions on the edge.

use skinrig_analysis::digits::{Digits, FigureDigits};
use skinrig_text::Column;

use crate::format::number;

/// Metrics in display order: path and name.
const METRICS: [(&str, &str); 8] = [
    ("scored.rmse_mm", "RMSE, mm"),
    ("scored.rmse_x_mm", "RMSE along x, mm"),
    ("scored.rmse_y_mm", "RMSE along y, mm"),
    ("scored.bias_x_mm", "bias along x, mm"),
    ("scored.bias_y_mm", "bias along y, mm"),
    ("scored.median_mm", "median error, mm"),
    ("scored.p95_mm", "95th percentile, mm"),
    ("scored.repeat_std_mm", "std between repetitions, mm"),
];
/// Decimals of a printed metric.
const PRINTED: i32 = 2;
/// Results with the fewest digits that are shown.
const FEWEST: usize = 5;

/// See [`crate::digits_text`].
pub(crate) fn text(digits: &Digits) -> String {
    let columns = [Column::left(28), Column::right(20), Column::right(13)];
    let line = |cells: [&str; 3]| {
        let cells = columns.iter().zip(cells).map(|(c, text)| c.cell(text));
        cells.collect::<String>() + "\n"
    };
    let mut out = line(["metric", "value", "true digits"]);
    let mut short = Vec::new();
    for (path, name) in METRICS {
        let Some(figure) = digits.of(&format!("{path}.value")) else {
            continue;
        };
        if figure.digits < printed_digits(figure.value) {
            short.push(name);
        }
        out += &line([name, &exact(figure), &number(Some(figure.digits), 1)]);
    }
    if !short.is_empty() {
        out += &format!("fewer true digits than printed: {}\n", short.join(", "));
    }
    let mut order: Vec<&FigureDigits> = digits.figures.iter().collect();
    order.sort_by(|a, b| a.digits.total_cmp(&b.digits));
    out += "fewest digits\n";
    for figure in order.iter().take(FEWEST) {
        out += &format!("  {:4.1}  {}\n", figure.digits, figure.path);
    }
    out += &match &digits.changed[..] {
        [] => "no word, count or missing value changed\n".to_owned(),
        [first, ..] => format!(
            "changed: {} words, counts or missing values, first {first}\n",
            digits.changed.len()
        ),
    };
    out + &format!(
        "{} repetitions; measured positions, depths, forces and the drawn geometry moved by\none unit in the last place\n",
        digits.repetitions
    )
}

/// Significant digits of a value with [`PRINTED`] decimals.
fn printed_digits(value: f64) -> f64 {
    f64::from(PRINTED) + libm::log10(value.abs().max(1e-2)).floor() + 1.0
}

/// The value with the digits that it has.
fn exact(figure: &FigureDigits) -> String {
    let before = libm::log10(figure.value.abs().max(1e-300)).floor() as i32 + 1;
    let decimals = (figure.digits.floor() as i32 - before).clamp(0, 15);
    format!("{:.*}", decimals as usize, figure.value)
}
