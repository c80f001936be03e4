//! Owns the figure of the compared calibration models.

use skinrig_model::CalibrationModel;

use super::canvas::{Canvas, Figure, nice_above};
use super::legend::{self, Sample};
use crate::axes::{Axes, Scale};
use crate::format::number;
use crate::input::ReportInput;
use crate::svg::{Px, dots};

/// Display name of a model.
pub(crate) const fn model_name(model: CalibrationModel) -> &'static str {
    match model {
        CalibrationModel::None => "nominal geometry",
        CalibrationModel::Positions => "positions",
        CalibrationModel::PositionsSkews => "with skews",
        CalibrationModel::Full => "with distortions (paper)",
        CalibrationModel::FullScale => "with scales",
        CalibrationModel::Auto => "automatic",
    }
}

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
    let mut canvas = Canvas::new(
        input,
        "models",
        "Calibration: choice of the model",
        caption,
        (620.0, 480.0),
        &[],
    );
    let finite = |v: Option<f64>| v.filter(|v| v.is_finite());
    let most = rows
        .iter()
        .filter_map(|r| finite(r.rmse_mm.high.or(r.rmse_mm.value)))
        .fold(0.0, f64::max);
    let axes = Axes {
        x: Scale::new((-0.6, rows.len() as f64 - 0.4), (66.0, 604.0)),
        y: Scale::new((0.0, nice_above(most)), (390.0, 44.0)),
        x_label: String::new(),
        y_label: "RMSE (mm)".into(),
        tick_count: (0, 6),
    };
    let svg = &mut canvas.svg;
    axes.draw(svg);
    for (i, row) in rows.iter().enumerate() {
        let x = axes.x.at(i as f64);
        let name = format!(
            "{} ({})",
            model_name(row.model).replace(" (paper)", ""),
            row.parameters
        );
        // Alternate label heights: five names do not fit side by side.
        svg.text((x, 407.0 + 14.0 * (i % 2) as f64), "tick", "middle", &name);
        if let (Some(low), Some(high)) = (finite(row.rmse_mm.low), finite(row.rmse_mm.high)) {
            svg.line("whisker c1", (x, axes.y.at(low)), (x, axes.y.at(high)));
        }
        match finite(row.rmse_mm.value) {
            Some(value) => {
                let y = axes.y.at(value);
                svg.path("dots strong c1", &dots([(x, y)]));
                svg.text(
                    (x + 12.0, y + 4.0),
                    "tick halo",
                    "start",
                    &number(Some(value), 2),
                );
                if row.chosen {
                    svg.leaf(
                        "circle",
                        &[
                            ("class", &"ring"),
                            ("cx", &Px(x)),
                            ("cy", &Px(y)),
                            ("r", &"8"),
                        ],
                    );
                }
            }
            None => {
                svg.text((x, 372.0), "note", "middle", "not fitted");
            }
        }
        if let Some(value) = finite(row.bounded_rmse_mm) {
            let y = axes.y.at(value);
            svg.line("ref", (x - 22.0, y), (x - 4.0, y));
        }
        if let Some(value) = finite(row.fitted_rmse_mm) {
            svg.path("dots mid c2", &dots([(x - 12.0, axes.y.at(value))]));
        }
    }
    legend::line(
        svg,
        (66.0, 18.0),
        &[
            (Sample::Dot("dots strong c1"), "held-out locations"),
            (Sample::Dot("dots mid c2"), "fitted presses"),
            (Sample::Line("ref"), "held out, bounded"),
        ],
    );
    let n = rows.iter().map(|r| r.rmse_mm.n).max().unwrap_or(0);
    Some(canvas.finish(&format!("n = {n} presses"), "models", ""))
}
