//! Owns the heat map of the calibration's correlation matrix.

use super::origin::foot;
use crate::format::number;
use crate::input::ReportInput;
use crate::markup::Markup;
use crate::plot::{Canvas, Figure, HALF};
use crate::svg::Px;

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
    let head = [
        "correlation",
        "Calibration: correlation of parameters",
        &caption,
    ];
    let mut canvas = Canvas::new(head.map(str::to_owned), (HALF, 540.0), None);
    let (left, top, side) = (196.0, 20.0, 340.0);
    let step = side / n as f64;
    let svg = &mut canvas.svg;
    for (i, (row, name)) in fit.correlation.iter().zip(&fit.names).enumerate() {
        let y = top + step * i as f64;
        svg.text((left - 8.0, y + step / 2.0 + 4.0), "tick", "end", name);
        for (k, value) in row.iter().enumerate() {
            let at = (left + step * k as f64, y);
            cell(svg, at, step, value.filter(|v| v.is_finite()));
        }
        let below = (left + step * (i as f64 + 0.5) + 3.0, top + side + 15.0);
        svg.turned(below, "tick", "end", -40.0, name);
    }
    Some(canvas.finish(
        &foot(input),
        &format!("n = {} presses", fit.n),
        "correlation",
    ))
}

fn cell(svg: &mut Markup, (x, y): (f64, f64), step: f64, value: Option<f64>) {
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
        let middle = (x + step / 2.0, y + step / 2.0 + 4.0);
        svg.text(middle, class, "middle", &text);
    }
}
