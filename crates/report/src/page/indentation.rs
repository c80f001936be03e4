//! Owns the section on depth and force: errors at known and at left-out locations, by depth, and the return to zero.

use skinrig_analysis::result::{Analysis, Indentation, Quantity, QuantityErrors, ZeroReturn};

use crate::document::{Group, Note, Section, Table};
use crate::figures;
use crate::format::{interval, number};
use crate::input::ReportInput;

/// Share of the intervals of single estimates that hold, as stated.
const STATED: f64 = 0.95;

/// `None` unless the analysis estimates depths.
pub(super) fn indentation(input: &ReportInput<'_>) -> Option<Section> {
    let a = input.analysis;
    let found = a.indentation.as_ref().filter(|_| a.is_valid())?;
    let section = Section::new("depth-and-force", "Depth and force")
        .with_all(figures::indentation(input))
        .with_all(found.depth.as_ref().map(|_| totals(found).card()))
        .with_all(found.depth.as_ref().map(|q| by_depth(q).card()))
        .with_all(zero(found));
    let missing = [
        ("No depth.", "no-depth", found.no_depth),
        ("No force.", "no-force", found.no_force),
    ];
    let notes = missing
        .into_iter()
        .filter_map(|(label, id, why)| Some(Note::new(label, format!("{}.", why?)).test_id(id)));
    Some(section.with(Group::stack().with_all(notes)))
}

fn cells(name: &str, errors: &QuantityErrors) -> [String; 7] {
    [
        name.to_owned(),
        number(errors.rmse.value, 3),
        interval(&errors.rmse, 1.0, 3),
        number(errors.bias.value, 3),
        number(errors.relative_percent.value, 1),
        number(errors.covered.value.map(|v| 100.0 * v), 1),
        errors.rmse.n.to_string(),
    ]
}

fn totals(found: &Indentation) -> Table {
    let mut grid = Table::new(
        "indentation-table",
        "Errors of depth and force",
        &[
            "Quantity, presses",
            "#RMSE",
            "#95 % interval",
            "#bias",
            "#relative (%)",
            "#intervals that hold (%)",
            "#presses",
        ],
    );
    let quantities = [("depth (mm)", &found.depth), ("force (N)", &found.force)];
    for (name, quantity) in quantities {
        for quantity in quantity.iter() {
            grid.row(cells(&format!("{name}, scored"), &quantity.scored));
            grid.row(cells(
                &format!("{name}, left-out locations"),
                &quantity.left_out,
            ));
        }
    }
    let taught = found.depth.as_ref().map_or(0, |q| q.taught_by);
    for (name, quantity) in quantities {
        for text in quantity.iter().filter_map(beyond) {
            grid.note(format!("Of the {name}: {text}."));
        }
    }
    if found.depth.as_ref().is_some_and(has_no_intervals) {
        grid.note(
            "Single estimates have no 95 % intervals: fewer than 19 calibration presses are too few for one.".to_owned(),
        );
    }
    grid.note(format!(
        "Learnt from the events of {taught} calibration presses while the tip presses and releases, not from durations. \
         Left-out locations: calibration presses, each estimated without the presses at its location. Measured depth and \
         force are means over the hold, as the robot reports them; a robot that reports commanded forces makes the force a \
         statement about commands.",
    ));
    grid
}

fn by_depth(depth: &Quantity) -> Table {
    let mut grid = Table::new(
        "indentation-depths",
        "Depth error by planned depth",
        &[
            "#Planned (mm)",
            "#RMSE, scored (mm)",
            "#bias, scored (mm)",
            "#RMSE, left-out (mm)",
            "#bias, left-out (mm)",
        ],
    );
    for row in &depth.depths {
        grid.row([
            number(Some(row.depth_mm), 2),
            number(row.scored.rmse.value, 3),
            number(row.scored.bias.value, 3),
            number(row.left_out.rmse.value, 3),
            number(row.left_out.bias.value, 3),
        ]);
    }
    grid.download("indentation");
    grid
}

fn zero(found: &Indentation) -> Option<Note> {
    let zero = found.zero.as_ref()?;
    let text = format!(
        "{}. Trend over the session {} mm. Measured {} s after the release, relative to the calibration presses.",
        rest(zero),
        number(zero.trend_mm, 3),
        number(Some(zero.after_s), 1),
    );
    Some(if zero.drifts {
        Note::new("The skin does not return to zero: drift.", text)
            .warning()
            .test_id("zero")
    } else {
        Note::new("The skin returns to zero.", text).test_id("zero")
    })
}

fn rest(zero: &ZeroReturn) -> String {
    format!(
        "Mean {} mm {}, RMS {} mm, limit {} mm",
        number(zero.mean_mm.value, 3),
        interval(&zero.mean_mm, 1.0, 3),
        number(zero.rms_mm.value, 3),
        ZeroReturn::LIMIT_MM,
    )
}

/// True if the calibration presses are too few for intervals of single estimates.
fn has_no_intervals(depth: &Quantity) -> bool {
    depth.scored.covered.value.is_none() && depth.left_out.covered.value.is_none()
}

/// Scored presses without an error, if any.
fn beyond(quantity: &Quantity) -> Option<String> {
    let [least, most] = quantity.taught;
    let all = quantity.scored.rmse.n + quantity.beyond;
    (quantity.beyond > 0).then(|| {
        format!(
            "{} of {all} scored presses are left out, measured beyond the {least:.2} to {most:.2} that the calibration presses taught",
            quantity.beyond
        )
    })
}

/// Share of the intervals at scored presses that hold, if it is certainly smaller than stated.
fn too_few_hold(depth: &Quantity) -> Option<String> {
    let share = depth.scored.covered.value?;
    let most = depth.scored.covered.high?;
    (most < STATED).then(|| format!("; intervals hold for {:.0} %", 100.0 * share))
}

/// One line for the terminal; `None` without depths.
pub(crate) fn line(a: &Analysis) -> Option<String> {
    let found = a.indentation.as_ref()?;
    let depth = match (&found.depth, found.no_depth) {
        (Some(depth), _) => depth,
        (None, Some(why)) => return Some(format!("not estimated: {why}")),
        (None, None) => return None,
    };
    let [least, most] = depth.taught;
    let beyond = format!("beyond the {least:.1} to {most:.1} mm taught");
    let n = depth.scored.rmse.n;
    let scored = match (n, depth.beyond) {
        (0, 0) => "no scored press".to_owned(),
        (0, all) => format!("all {all} scored presses {beyond}"),
        _ => {
            let rmse = number(depth.scored.rmse.value, 2);
            let more = match depth.beyond {
                0 => String::new(),
                more => format!(" ({more} more {beyond})"),
            };
            let interval = interval(&depth.scored.rmse, 1.0, 2);
            format!("RMSE {rmse} mm {interval}, n {n} presses{more}")
        }
    };
    let left_out = number(depth.left_out.rmse.value, 2);
    let mut text = format!("{scored}, {left_out} mm at left-out locations");
    text.extend(too_few_hold(depth));
    if has_no_intervals(depth) {
        text += "; no intervals: too few calibration presses";
    }
    if found.zero.is_some_and(|z| z.drifts) {
        text += "; does not return to zero: drift";
    }
    Some(text)
}
