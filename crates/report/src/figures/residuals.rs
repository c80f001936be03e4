//! Owns the figure of calibration residuals, before and after.

use skinrig_model::Point2;

use super::origin::foot;
use super::skin::Layout;
use crate::derive::{self, Residual};
use crate::format::number;
use crate::input::ReportInput;
use crate::plot::{Figure, Plot, Sheet, WIDE};
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
    let layout = Layout::new(input);
    let side = |name: &str, id: &str, class: &'static str, estimate: Estimate| {
        let (layout, rows) = (&layout, &rows);
        let (x, y) = layout.axes();
        Plot::new(x, y)
            .title(name)
            .clipped(id)
            .draw(move |svg, place| {
                svg.path("skin", &layout.skin(place));
                let vector = |r: &Residual| {
                    let ends = [layout.px(place, r.truth), layout.px(place, estimate(r)?)];
                    Some(polyline(ends, false))
                };
                let vectors: String = rows.iter().filter_map(vector).collect();
                svg.path(class, &vectors);
                svg.path(
                    "dots tips",
                    &dots(rows.iter().map(|r| layout.px(place, r.truth))),
                );
            })
            .over(move |svg, place| layout.cameras(svg, place, input))
    };
    let plots = [
        side("A   before", "residuals-before", "vector strong c2", |r| {
            r.before
        }),
        side("B   after", "residuals-after", "vector strong c1", |r| {
            r.after
        }),
    ];
    let title = "Calibration: residuals before and after";
    let sheet = Sheet::new("residuals", title, caption, WIDE)
        .columns(&[1.0, 1.0])
        .row(layout.height(538.0), plots);
    let n = format!("n = {} calibration presses", rows.len());
    Some(sheet.finish(&foot(input), &n, "residuals"))
}
