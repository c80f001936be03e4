//! Owns the tables of the locators: their comparison, and how often the regions hold.

use skinrig_analysis::result::{Analysis, LocatorResult};
use skinrig_model::Locator;

use crate::derive::locator_name;
use crate::document::Table;
use crate::format::{NONE, interval, number};

/// The compared locators.
pub(super) fn locators(a: &Analysis) -> Option<Table> {
    let l = a.locator.as_ref()?;
    if l.compared.is_empty() {
        return None;
    }
    let mut grid = Table::new(
        "locator-table",
        "Locators compared",
        &[
            "Locator",
            "#RMSE, left-out locations (mm)",
            "#95 % interval",
            "#bounded RMSE (mm)",
            "#RMSE, left-out repetitions (mm)",
            "against",
            "#gain ± standard error (mm)",
            "#in standard errors",
            "#needed",
            "",
        ],
    );
    for row in &l.compared {
        let gain = row.test.map(|t| {
            let gain = number(Some(t.gain_mm), 3);
            format!("{gain} ± {}", number(Some(t.standard_error_mm), 3))
        });
        let remark = match (&row.unfit, row.chosen) {
            (Some(reason), _) => reason.to_string(),
            (None, true) => "used".to_owned(),
            (None, false) => String::new(),
        };
        grid.marked_row(
            [
                locator_name(row.locator).to_owned(),
                number(row.rmse_mm.value, 3),
                interval(&row.rmse_mm, 1.0, 3),
                number(row.bounded_rmse_mm, 3),
                number(row.over_repetitions_mm, 3),
                row.test
                    .map_or(NONE, |t| locator_name(t.against))
                    .to_owned(),
                gain.unwrap_or_else(|| NONE.to_owned()),
                number(row.test.map(|t| t.ratio), 2),
                number(row.test.map(|t| t.needed), 2),
                remark,
            ],
            row.chosen,
        );
    }
    grid.note(why(a, l));
    grid.download("locators");
    Some(grid)
}

/// Why this locator is used.
fn why(a: &Analysis, l: &LocatorResult) -> String {
    let used = match (&l.fallback, a.settings.locator) {
        (Some(reason), _) => format!("{}, because {reason}", locator_name(l.locator)),
        (None, Locator::Auto) => locator_name(l.locator).to_owned(),
        (None, _) => format!("{}, as configured", locator_name(l.locator)),
    };
    format!(
        "Used: {used}. Learnt from the calibration presses alone. Starting from the geometry, another locator is taken if \
         it lowers the error at locations left out of its fit by at least the required number of standard errors. Errors \
         above {} mm count as that in the bounded RMSE, the criterion.",
        number(l.bound_mm, 1),
    )
}

/// Stated and observed shares of the regions.
pub(super) fn reliability(a: &Analysis) -> Option<Table> {
    let l = a.locator.as_ref()?;
    if l.reliability.is_empty() {
        return None;
    }
    let mut grid = Table::new(
        "reliability-table",
        "Regions of the scored presses",
        &["#Stated (%)", "#inside (%)", "#95 % interval", "#presses"],
    );
    for row in &l.reliability {
        grid.row([
            number(Some(100.0 * row.level), 0),
            number(row.inside.value.map(|v| 100.0 * v), 1),
            interval(&row.inside, 100.0, 1),
            row.inside.n.to_string(),
        ]);
    }
    let regions = a.presses.iter().filter_map(|p| p.region);
    let mut areas: Vec<f64> = regions.map(|r| r.area_mm2()).collect();
    areas.sort_unstable_by(f64::total_cmp);
    let beyond = a.presses.iter().filter(|p| p.extrapolated).count();
    grid.note(format!(
        "A region is an ellipse about an estimate that holds the true position with the stated probability; its size comes \
         from calibration presses at left-out locations. Median area of the 95 % regions: {} mm². {beyond} presses lie \
         beyond the calibration presses by more than half a step: nothing says how far off they are, and they have no region.",
        number(areas.get(areas.len() / 2).copied(), 1),
    ));
    grid.download("reliability");
    Some(grid)
}
