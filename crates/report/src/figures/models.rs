//! Owns the figure of the compared calibration models.

use super::origin::foot;
use crate::format::number;
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, HALF, Plot, Sample, Sheet};
use crate::svg::dots;

/// Cross-validated RMSE of the nested models with interval, the bounded RMSE used to compare them, and the error on the
/// fitted presses. `None` without a comparison.
#[must_use]
pub fn models(input: &ReportInput<'_>) -> Option<Figure> {
    let rows = &input.analysis.calibration.as_ref()?.compared;
    if rows.is_empty() {
        return None;
    }
    let caption = "Choice of the calibration model. Dots: RMSE on held-out locations, with its 95 % interval over \
        locations; bars: the same with the longest errors bounded, which is the criterion for choosing (paired by \
        location; the table below gives the differences). Small dots: RMSE on the fitted presses, always more \
        optimistic. Ring: the model used."
        .to_owned();
    let finite = |v: Option<f64>| v.filter(|v| v.is_finite());
    let highest = rows
        .iter()
        .filter_map(|r| r.rmse_mm.high.or(r.rmse_mm.value));
    // Alternate heights: five names do not fit side by side.
    let names = rows.iter().enumerate().map(|(i, row)| {
        let name = row.model.label().replace(" (paper)", "");
        let (lead, tail) = if i % 2 == 1 { ("\n", "") } else { ("", "\n") };
        format!("{lead}{name} ({}){tail}", row.parameters)
    });
    let y = Axis::from_zero(highest, "RMSE (mm)").ticks(6);
    let mut plot = Plot::new(Axis::categories(names, ""), y);
    for (x, row) in (0..).map(f64::from).zip(rows) {
        if let Some(ends) = finite(row.rmse_mm.low).zip(finite(row.rmse_mm.high)) {
            plot = plot.line("whisker c1", [(x, ends.0), (x, ends.1)]);
        }
        plot = match finite(row.rmse_mm.value) {
            None => plot.draw(move |svg, place| {
                let at = (place.x.at(x), place.y.px.0 - 18.0);
                svg.text(at, "note", "middle", "not fitted");
            }),
            Some(value) => {
                let plot = plot
                    .dots("dots strong c1", [(x, value)])
                    .draw(move |svg, place| {
                        let (x, y) = place.at((x, value));
                        let text = number(Some(value), 2);
                        svg.text((x + 12.0, y + 4.0), "tick halo", "start", &text);
                    });
                if row.chosen {
                    plot.ring("ring", (x, value))
                } else {
                    plot
                }
            }
        };
        let (bounded, fitted) = (finite(row.bounded_rmse_mm), finite(row.fitted_rmse_mm));
        plot = plot.draw(move |svg, place| {
            if let Some((x, y)) = bounded.map(|v| place.at((x, v))) {
                svg.line("ref", (x - 22.0, y), (x - 4.0, y));
            }
            if let Some((x, y)) = fitted.map(|v| place.at((x, v))) {
                svg.path("dots mid c2", &dots([(x - 12.0, y)]));
            }
        });
    }
    let sheet = Sheet::new("models", "Calibration: choice of the model", caption, HALF)
        .legend([
            (Sample::Dot("dots strong c1"), "held-out locations"),
            (Sample::Dot("dots mid c2"), "fitted presses"),
            (Sample::Line("ref"), "held out, bounded"),
        ])
        .row(346.0, [plot]);
    let n = rows.iter().map(|r| r.rmse_mm.n).max().unwrap_or(0);
    Some(sheet.finish(&foot(input), &format!("n = {n} presses"), "models"))
}
