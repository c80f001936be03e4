//! Owns the figure of calibration residuals, before and after.

use skinrig_model::Point2;

use super::canvas::{Canvas, Figure};
use super::skin::Layout;
use crate::derive::{self, Residual};
use crate::format::number;
use crate::input::ReportInput;
use crate::svg::{dots, polyline};

/// Selects the estimate to draw.
type Estimate = fn(&Residual) -> Option<Point2>;

/// Vectors from truth to estimate of the calibration presses, before and after calibration, on one scale. `None` without a
/// calibration.
#[must_use]
pub fn residuals(input: &ReportInput<'_>) -> Option<Figure> {
    let fit = input.analysis.calibration.as_ref()?;
    let rows = derive::residuals(input.analysis);
    if rows.is_empty() {
        return None;
    }
    let caption = format!(
        "Residuals of the calibration presses, from measured position (dot) to estimate (end of the line). A: with the \
         geometry before calibration (RMSE {} mm); B: with the calibrated geometry (RMSE {} mm over the {} fitted \
         presses, {} of them with less than half weight). Patterns that remain in B are what the model cannot \
         describe.",
        number(Some(fit.rmse_before_mm), 2),
        number(Some(fit.rmse_after_mm), 2),
        fit.n,
        fit.outliers,
    );
    let mut canvas = Canvas::new(
        input,
        "residuals",
        "Calibration: residuals before and after",
        caption,
        (1240.0, 640.0),
        &[],
    );
    let sides: [(&str, &str, Estimate); 2] = [
        ("A   before", "vector strong c2", |r| r.before),
        ("B   after", "vector strong c1", |r| r.after),
    ];
    for (i, (name, class, estimate)) in sides.into_iter().enumerate() {
        let left = 66.0 + 620.0 * i as f64;
        let layout = Layout::within(input, (left, 34.0), (530.0, 530.0));
        let clip = ["residuals-before", "residuals-after"][i];
        let svg = &mut canvas.svg;
        layout.axes.draw(svg);
        svg.path("skin", &layout.skin());
        svg.text((left, 22.0), "panel", "start", name);
        svg.open("clipPath", &[("id", &clip)]);
        svg.leaf(
            "rect",
            &[
                ("x", &layout.axes.x.px.0),
                ("y", &layout.axes.y.px.1),
                ("width", &(layout.axes.x.px.1 - layout.axes.x.px.0)),
                ("height", &(layout.axes.y.px.0 - layout.axes.y.px.1)),
            ],
        );
        svg.close();
        svg.open("g", &[("clip-path", &format_args!("url(#{clip})"))]);
        let mut vectors = String::new();
        for row in &rows {
            if let Some(end) = estimate(row) {
                vectors += &polyline([layout.px(row.truth), layout.px(end)], false);
            }
        }
        svg.path(class, &vectors);
        svg.path("dots tips", &dots(rows.iter().map(|r| layout.px(r.truth))));
        svg.close();
        layout.cameras(svg, input);
    }
    let n = format!("n = {} calibration presses", rows.len());
    Some(canvas.finish(&n, "residuals", ""))
}
