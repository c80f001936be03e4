//! Owns the tables of the calibration.

use skinrig_analysis::result::{Analysis, CalibrationResult};

use crate::document::{Column, Group, Row, Table, Text, paragraph, soft};
use crate::format::{NONE, interval, number, words};
use crate::{derive, tables};

/// The fitted parameters.
pub(super) fn parameters(a: &Analysis) -> Group {
    let card = Group::titled("Calibration").test_id("calibration");
    let Some(c) = &a.calibration else {
        return card.with(soft(
            "No calibration: presses were located with the nominal geometry.",
        ));
    };
    let about = Text::from("RMSE ")
        .bold(number(Some(c.rmse_before_mm), 3))
        .add(" mm before, ")
        .bold(number(Some(c.rmse_after_mm), 3))
        .add(format!(
            " mm after, over {} calibration presses. This is in-sample; the scored RMSE above is held out.",
            c.n
        ));
    let origin = derive::recalibration_note(a);
    let rows = tables::calibration(c).into_iter().map(|r| {
        let error = r.standard_error;
        let error = error.map(|se| format!("± {}", number(Some(se), 4)));
        let interval = r
            .interval
            .map(|(low, high)| format!("[{}, {}]", number(Some(low), 4), number(Some(high), 4)));
        Row::new([
            r.name,
            number(r.before, 4),
            number(r.after, 4),
            error.unwrap_or_else(|| "not determined".to_owned()),
            interval.unwrap_or_else(|| NONE.to_owned()),
        ])
    });
    let columns = [
        Column::new("Parameter"),
        Column::new("#Before"),
        Column::new("#After"),
        Column::new("#Standard error"),
        Column::new("95 % interval").class("num nowrap"),
    ];
    let caption = "Fitted parameters before and after";
    let scope = "Standard errors and intervals are of random error alone. What the skin does to every press alike, and what \
        the model leaves out, is not in them, and is often larger.";
    card.download("calibration", "calibration", "the calibration")
        .with(paragraph(about))
        .with_all(origin.map(soft))
        .with(Table::of("parameters", caption, columns).with(rows))
        .with(soft(scope))
}

/// The compared models.
pub(super) fn models(a: &Analysis) -> Option<Table> {
    let c = a.calibration.as_ref()?;
    if c.compared.is_empty() {
        return None;
    }
    let mut grid = Table::new(
        "model-table",
        "Models compared",
        &[
            "Model",
            "#parameters",
            "#RMSE, held-out locations (mm)",
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
                m.model.label().to_owned(),
                m.parameters.to_string(),
                number(m.rmse_mm.value, 3),
                interval(&m.rmse_mm, 1.0, 3),
                number(m.bounded_rmse_mm, 3),
                m.test.map_or(NONE, |t| t.against.label()).to_owned(),
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

/// Why this model was used.
fn why(a: &Analysis, c: &CalibrationResult) -> String {
    use skinrig_model::CalibrationModel::Auto;
    let used = match a.settings.calibration {
        Auto => "the last accepted model".to_owned(),
        named if named == c.model => format!("{}, as configured", named.label()),
        named => format!(
            "{}; the configured {} failed to fit or needs more locations",
            c.model.label(),
            named.label()
        ),
    };
    format!(
        "Used: {used}. Starting from the smallest model, each larger one is accepted if it lowers the error on \
         held-out locations by at least the required number of standard errors. Gain: bounded RMSE of the current \
         model minus that of the larger one, with the standard error of the paired differences over locations. Errors \
         above {} mm count as that.",
        number(c.bound_mm, 1),
    )
}

/// How well the data determine the fit.
pub(super) fn fit(a: &Analysis) -> Option<Table> {
    let c = a.calibration.as_ref()?;
    let mut grid = Table::new("fit-table", "Fit", &["Quantity", "#Value"]);
    let mut row = |name: &str, value: String| {
        grid.row([name.to_owned(), value]);
    };
    row("model", c.model.label().to_owned());
    row("lens", words(&c.lens));
    row("calibration presses", c.n.to_string());
    row("RMSE before (mm)", number(Some(c.rmse_before_mm), 3));
    row("RMSE after (mm)", number(Some(c.rmse_after_mm), 3));
    row(
        "rank, of parameters",
        format!("{} of {}", c.rank, c.names.len()),
    );
    row(
        "condition number",
        c.condition.map_or_else(
            || "rank-deficient".to_owned(),
            |v| number(Some(v), if v < 100.0 { 1 } else { 0 }),
        ),
    );
    row("presses with less than half weight", c.outliers.to_string());
    row(
        "starts that reach the best optimum",
        format!("{} of {}", c.starts_agreeing, c.starts),
    );
    grid.note(format!(
        "The optimiser stopped with: {}.",
        c.termination.text()
    ));
    if (c.rank as usize) < c.names.len() {
        grid.note("The data do not determine all parameters; see the correlation and the standard errors.");
    }
    Some(grid)
}
