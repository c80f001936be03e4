//! Owns the figure of the compared calibration models.

use skinrig_model::CalibrationModel;

use super::legend::{self, Sample};
use super::{Canvas, Figure, nice_above};
use crate::ReportInput;
use crate::axes::{Axes, Scale};
use crate::format::number;
use crate::svg::{Px, dots};

/// A model's name for people.
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

/// Cross-validated RMSE of the nested models with its interval, the error on the fitted presses beside it, and the
/// line of one standard error above the best. `None` where no models were compared.
#[must_use]
pub fn models(input: &ReportInput<'_>) -> Option<Figure> {
    let rows = &input.analysis.calibration.as_ref()?.compared;
    if rows.is_empty() {
        return None;
    }
    let caption = "Choice of the calibration model. Dots: RMSE on locations left out of the fit, with its 95 % interval \
                   over locations. Small dots: RMSE on the presses that were fitted, always more optimistic. Dashed: one \
                   standard error above the best. The smallest model below it is used (ring), unless the protocol names \
                   one."
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
    let best = rows
        .iter()
        .filter_map(|r| Some((finite(r.rmse_mm.value)?, finite(r.standard_error_mm)?)))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((value, error)) = best {
        let y = axes.y.at(value + error);
        svg.line("ref", (66.0, y), (604.0, y));
    }
    // A value on the line of one standard error is written below it.
    let near_line = |value: f64| {
        let line = best.map(|(value, error)| axes.y.at(value + error));
        line.is_some_and(|line| (axes.y.at(value) - line).abs() < 9.0)
    };
    for (i, row) in rows.iter().enumerate() {
        let x = axes.x.at(i as f64);
        let name = format!(
            "{} ({})",
            model_name(row.model).replace(" (paper)", ""),
            row.parameters
        );
        // Neighbouring names on two heights: five do not fit beside each other.
        svg.text((x, 407.0 + 14.0 * (i % 2) as f64), "tick", "middle", &name);
        if let (Some(low), Some(high)) = (finite(row.rmse_mm.low), finite(row.rmse_mm.high)) {
            svg.line("whisker c1", (x, axes.y.at(low)), (x, axes.y.at(high)));
        }
        match finite(row.rmse_mm.value) {
            Some(value) => {
                let y = axes.y.at(value);
                svg.path("dots strong c1", &dots([(x, y)]));
                svg.text(
                    (
                        x + 12.0,
                        y + 4.0 + 12.0 * f64::from(u8::from(near_line(value))),
                    ),
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
        if let Some(value) = finite(row.fitted_rmse_mm) {
            svg.path("dots mid c2", &dots([(x - 12.0, axes.y.at(value))]));
        }
    }
    legend::line(
        svg,
        (66.0, 18.0),
        &[
            (Sample::Dot("dots strong c1"), "locations left out"),
            (Sample::Dot("dots mid c2"), "fitted presses"),
            (Sample::Line("ref"), "best + 1 standard error"),
        ],
    );
    let n = rows.iter().map(|r| r.rmse_mm.n).max().unwrap_or(0);
    Some(canvas.finish(&format!("n = {n} presses"), "models", ""))
}
