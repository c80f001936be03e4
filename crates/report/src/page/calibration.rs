//! Owns the tables of the calibration.

use skinrig_analysis::result::{Analysis, CalibrationResult};

use super::grid::Grid;
use crate::figures::model_name;
use crate::format::{NONE, interval, number, words};

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
            "#bounded RMSE (mm)",
            "against",
            "#gain ± standard error (mm)",
            "#in standard errors",
            "#needed",
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
                number(m.bounded_rmse_mm, 3),
                m.test.map_or(NONE, |t| model_name(t.against)).to_owned(),
                m.test.map_or_else(
                    || NONE.to_owned(),
                    |t| {
                        let gain = number(Some(t.gain_mm), 3);
                        format!("{gain} ± {}", number(Some(t.standard_error_mm), 3))
                    },
                ),
                number(m.test.map(|t| t.ratio), 2),
                number(m.test.map(|t| t.needed), 2),
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
    let used = match a.settings.calibration {
        Auto => "the last model that replaced the one in hand".to_owned(),
        named if named == c.model => format!("{}, as the settings say", model_name(named)),
        named => format!(
            "{}; the settings say {}, whose fit failed or needs more places",
            model_name(c.model),
            model_name(named)
        ),
    };
    format!(
        "Used: {used}. The smallest model is taken in hand; each larger one in turn replaces it if its error on left-out \
         locations is lower by at least the needed number of standard errors. Gain: bounded RMSE of the model in hand less \
         its own, with the standard error of the paired differences over locations. Errors above {} mm count as that.",
        number(c.bound_mm, 1),
    )
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
