//! Owns the tables of the calibration.

use skinrig_analysis::result::{Analysis, CalibrationResult};

use super::grid::Grid;
use crate::figures::model_name;
use crate::format::{interval, number, words};

/// The compared models.
pub(super) fn models(a: &Analysis) -> Option<Grid> {
    let c = a.calibration.as_ref()?;
    if c.compared.is_empty() {
        return None;
    }
    let mut grid = Grid::new(
        "model-table",
        "Models compared",
        &[
            "Model",
            "#parameters",
            "#RMSE, locations left out (mm)",
            "#95 % interval",
            "#standard error (mm)",
            "#RMSE, fitted presses (mm)",
            "",
        ],
    );
    for m in &c.compared {
        grid.marked_row(
            [
                model_name(m.model).to_owned(),
                m.parameters.to_string(),
                number(m.rmse_mm.value, 3),
                interval(&m.rmse_mm, 1.0, 3),
                number(m.standard_error_mm, 3),
                number(m.fitted_rmse_mm, 3),
                if m.chosen { "used" } else { "" }.to_owned(),
            ],
            m.chosen,
        );
    }
    grid.note(why(a, c));
    grid.download("models");
    Some(grid)
}

/// Why the model is the one used.
fn why(a: &Analysis, c: &CalibrationResult) -> String {
    use skinrig_model::CalibrationModel::Auto;
    let best = c
        .compared
        .iter()
        .filter_map(|m| Some((m.rmse_mm.value?, m)))
        .min_by(|x, y| x.0.total_cmp(&y.0));
    match (a.settings.calibration, best) {
        (Auto, Some((value, best))) => {
            let error = best.standard_error_mm.unwrap_or(0.0);
            format!(
                "Used: the smallest model whose error on left-out locations is at most {} mm, that is one standard error \
                 ({} mm) above the best, {} ({} mm).",
                number(Some(value + error), 3),
                number(Some(error), 3),
                model_name(best.model),
                number(Some(value), 3),
            )
        }
        (Auto, None) => "No model could be validated.".to_owned(),
        (named, _) => format!("Used: {}, as the settings say.", model_name(named)),
    }
}

/// How well the fit is determined.
pub(super) fn fit(a: &Analysis) -> Option<Grid> {
    let c = a.calibration.as_ref()?;
    let mut grid = Grid::new("fit-table", "The fit", &["Quantity", "#Value"]);
    let mut row = |name: &str, value: String| {
        grid.row([name.to_owned(), value]);
    };
    row("model", model_name(c.model).to_owned());
    row("lens", words(&c.lens));
    row("calibrating presses", c.n.to_string());
    row("RMSE before (mm)", number(Some(c.rmse_before_mm), 3));
    row("RMSE after (mm)", number(Some(c.rmse_after_mm), 3));
    row(
        "directions determined, of parameters",
        format!("{} of {}", c.rank, c.names.len()),
    );
    row(
        "condition number",
        c.condition.map_or_else(
            || "rank-deficient".to_owned(),
            |v| number(Some(v), if v < 100.0 { 1 } else { 0 }),
        ),
    );
    row("presses at less than half weight", c.outliers.to_string());
    row(
        "starts in the best optimum",
        format!("{} of {}", c.starts_agreeing, c.starts),
    );
    if !c.termination.is_empty() {
        grid.note(format!("The optimiser stopped: {}.", c.termination));
    }
    if (c.rank as usize) < c.names.len() {
        grid.note("The data do not determine all parameters: see the correlation and the standard errors.");
    }
    Some(grid)
}
