//! Owns the heat map of the calibration's correlation matrix.

use super::canvas::{Canvas, Figure};
use crate::format::number;
use crate::input::ReportInput;
use crate::svg::{Px, Svg};

/// Correlation of each pair of calibrated parameters. `None` without a correlation matrix.
#[must_use]
pub fn correlation(input: &ReportInput<'_>) -> Option<Figure> {
    let fit = input.analysis.calibration.as_ref()?;
    let n = fit.names.len();
    if n == 0 || fit.correlation.len() != n || fit.correlation.iter().any(|r| r.len() != n) {
        return None;
    }
    let undetermined = (0..n).filter(|i| fit.correlation[*i][*i].is_none()).count();
    let mut caption = String::from(
        "Correlation of the calibrated parameters. Blue: positive, orange: negative; darker is stronger. Strongly \
         correlated parameters can compensate each other: their standard errors are large although the fit is good.",
    );
    if undetermined > 0 {
        caption += &format!(" Dash: the data do not determine {undetermined} of {n} parameters.");
    }
    let mut canvas = Canvas::new(
        input,
        "correlation",
        "Calibration: correlation of parameters",
        caption,
        (620.0, 540.0),
        &[],
    );
    let (left, top, side) = (196.0, 20.0, 340.0);
    let step = side / n as f64;
    let svg = &mut canvas.svg;
    for (i, row) in fit.correlation.iter().enumerate() {
        let y = top + step * i as f64;
        svg.text(
            (left - 8.0, y + step / 2.0 + 4.0),
            "tick",
            "end",
            &fit.names[i],
        );
        for (k, value) in row.iter().enumerate() {
            cell(
                svg,
                (left + step * k as f64, y),
                step,
                value.filter(|v| v.is_finite()),
            );
        }
        let (x, below) = (left + step * (i as f64 + 0.5), top + side + 15.0);
        svg.holding(
            "text",
            &[
                ("class", &"tick"),
                ("text-anchor", &"end"),
                (
                    "transform",
                    &format_args!("translate({} {}) rotate(-40)", Px(x + 3.0), Px(below)),
                ),
            ],
            &fit.names[i],
        );
    }
    let n = format!("n = {} presses", fit.n);
    Some(canvas.finish(&n, "correlation", ""))
}

fn cell(svg: &mut Svg, (x, y): (f64, f64), step: f64, value: Option<f64>) {
    let class = match value {
        Some(v) if v < 0.0 => "f2",
        Some(_) => "f1",
        None => "tile",
    };
    svg.leaf(
        "rect",
        &[
            ("class", &class),
            ("x", &Px(x + 0.5)),
            ("y", &Px(y + 0.5)),
            ("width", &Px(step - 1.0)),
            ("height", &Px(step - 1.0)),
            (
                "fill-opacity",
                &Px(value.map_or(1.0, |v| 0.75 * v.abs().min(1.0))),
            ),
        ],
    );
    if step >= 26.0 {
        let text = number(value, 2).replace('-', "−");
        let class = if step >= 36.0 {
            "tick ink"
        } else {
            "tick ink small"
        };
        svg.text(
            (x + step / 2.0, y + step / 2.0 + 4.0),
            class,
            "middle",
            &text,
        );
    }
}
