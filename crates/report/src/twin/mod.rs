//! Owns the presentation of `skinrig twin`: constants, predictions and errors by place, as text and as a page.

mod figures;
mod page;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};
use skinrig_compare::scene::SessionFigure;
use skinrig_compare::twin::{
    CalibrationFigure, ConstantFit, FigureFit, Interval, OutcomePrediction, PlacePrediction, Twin,
};
use skinrig_text::{Column, Table};

use crate::format::{NONE, number};
use crate::scene_prediction::words;

pub use self::page::page;

/// A constant is said to be unknown below this share of explained variance.
const KNOWN: f64 = 0.1;

/// A session and its twin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SessionTwin {
    /// File of the session.
    pub session: String,
    /// What its data come from, in words: `simulated (optical)`.
    pub origin: String,
    /// The protocol, if it is not that of the session.
    pub protocol: Option<String>,
    /// Changes of the protocol that were predicted besides, as `key=value`.
    pub changed: Vec<String>,
    /// Seeds of the skins that were analysed, in order.
    pub seeds: Vec<u64>,
    /// Skins that could not be analysed: seed and why.
    pub failed: Vec<(u64, String)>,
    /// The twin.
    pub twin: Twin,
}

impl SessionTwin {
    /// The answer in one sentence.
    #[must_use]
    pub fn verdict(&self) -> String {
        let skins = self.twin.skins;
        if !self.twin.is_like() {
            return format!("no twin: unlike all of {skins} simulated skins");
        }
        let (held, compared) = self.held();
        match compared {
            0 => {
                format!("a twin of {skins} simulated skins, without scored presses to compare with")
            }
            _ => format!(
                "a twin of {skins} simulated skins; {held} of {compared} predictions hold the recorded value"
            ),
        }
    }

    /// Predictions whose interval holds the recorded value, and those that have both.
    #[must_use]
    pub fn held(&self) -> (usize, usize) {
        let both = self
            .twin
            .outcomes
            .iter()
            .filter_map(|row| Some((row.predicted?, row.recorded?)));
        let held = both.map(|(p, x)| usize::from((p.low..=p.high).contains(&x)));
        let held: Vec<usize> = held.collect();
        (held.iter().sum(), held.len())
    }

    /// What keeps the session from having a twin, or skins that failed.
    fn remarks(&self) -> Vec<String> {
        let mut found = Vec::new();
        if !self.twin.is_like() {
            let unlike: Vec<String> = self.unlike().into_iter().map(sentence).collect();
            found.push(if unlike.is_empty() {
                "each of its figures is possible, but not together".to_owned()
            } else {
                unlike.join("; ")
            });
        }
        let missed: Vec<String> = self.twin.outcomes.iter().filter_map(missed).collect();
        if !missed.is_empty() {
            found.push(format!(
                "not as predicted, which one in twenty is by chance: {}",
                missed.join("; ")
            ));
        }
        found.extend(self.skins_that_do_not_count());
        found
    }

    fn skins_that_do_not_count(&self) -> Option<String> {
        let failed = self.failed.first().map(|(seed, why)| {
            let (failed, all) = (self.failed.len(), self.failed.len() + self.seeds.len());
            format!("{failed} of {all} simulated skins could not be analysed (seed {seed}: {why})")
        });
        let left_out = (self.twin.left_out > 0).then(|| {
            let n = self.twin.left_out;
            format!("not counted: {n} without a figure of the session")
        });
        let both: Vec<String> = failed.into_iter().chain(left_out).collect();
        (!both.is_empty()).then(|| both.join("; "))
    }

    /// Figures that no skin with the session's other figures has, the farthest first.
    fn unlike(&self) -> Vec<&FigureFit> {
        let mut found: Vec<_> = self.twin.figures.iter().filter(|f| f.is_unlike()).collect();
        found.sort_by(|a, b| b.deviations.abs().total_cmp(&a.deviations.abs()));
        found.truncate(3);
        found
    }
}

/// A recorded value outside its prediction; `None` for any other.
fn missed(row: &OutcomePrediction) -> Option<String> {
    let (p, recorded) = (row.predicted?, row.recorded?);
    let words = words::of(row.figure);
    let value = |x: f64| words.value(Some(x));
    (!(p.low..=p.high).contains(&recorded)).then(|| {
        let (low, high) = (value(p.low), value(p.high));
        format!(
            "{} {}{} for [{low}, {high}]",
            words.name,
            value(recorded),
            words.unit()
        )
    })
}

/// True for a figure that neither the session nor the skins have.
fn is_empty(row: &OutcomePrediction) -> bool {
    row.recorded.is_none() && row.predicted.is_none() && row.changed.is_none()
}

fn sentence(row: &FigureFit) -> String {
    let (name, value) = (figure_name(row.figure), |x: f64| {
        figure_value(row.figure, x)
    });
    format!(
        "{name} {}, expected from the other figures {} [{}, {}]",
        value(row.session),
        value(row.expected.middle),
        value(row.expected.low),
        value(row.expected.high)
    )
}

/// Verdict, predictions, errors by place; with `all` also constants and fitted figures.
#[must_use]
pub fn terminal_text(found: &SessionTwin, all: bool) -> String {
    let twin = &found.twin;
    let mut lines = vec![format!("{}  {}", found.session, found.verdict())];
    let remarks = found.remarks();
    lines.extend(remarks.iter().map(|remark| format!("- {remark}")));
    if twin.is_like() {
        let outcomes = twin.outcomes.iter().filter(|row| !is_empty(row));
        let outcomes = outcomes.map(|row| outcome_cells(row, found));
        lines.push(table(&outcome_heads(found), outcomes));
    }
    let places = twin.places.iter();
    lines.extend(places.map(|p| format!("errors by place: {}", places_sentence(p))));
    if all && twin.is_like() {
        let constants = twin
            .constants
            .iter()
            .map(|row| constant_cells(row).to_vec());
        lines.push(format!("\n{}", table(&CONSTANT_HEADS, constants)));
    }
    if all {
        let figures = twin.figures.iter().map(|row| figure_cells(row).to_vec());
        lines.push(format!("\n{}", table(&FIGURE_HEADS, figures)));
    }
    lines.join("\n")
}

fn table(heads: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut columns = vec![Column::left(44)];
    columns.resize(heads.len(), Column::right(26));
    let table = Table::new(columns);
    let heads = heads
        .iter()
        .map(|head| (*head).to_owned())
        .collect::<Vec<_>>();
    let lines = std::iter::once(heads).chain(rows).map(|row| table.row(row));
    lines.collect::<Vec<_>>().join("\n")
}

/// How well the errors of the places are told apart.
fn places_sentence(places: &PlacePrediction) -> String {
    let usual = places.usual.map_or_else(
        || "unknown for other skins".to_owned(),
        |u| {
            format!(
                "on other skins {} [{}, {}]",
                number(u.middle.into(), 2),
                number(u.low.into(), 2),
                number(u.high.into(), 2)
            )
        },
    );
    match places.correlation {
        Some(r) => format!(
            "rank correlation of predicted and recorded {} ({usual})",
            number(Some(r), 2)
        ),
        None => format!("no scored presses to compare with ({usual})"),
    }
}

const FIGURE_HEADS: [&str; 4] = [
    "figure of the calibration presses",
    "session",
    "expected from the others",
    "deviations",
];
const CONSTANT_HEADS: [&str; 4] = ["constant", "twin", "assumed before", "explained (%)"];

fn outcome_heads(found: &SessionTwin) -> Vec<&'static str> {
    let mut heads = vec!["scored presses", "recorded", "predicted, 95 %"];
    if !found.changed.is_empty() {
        heads.push("changed protocol, 95 %");
    }
    heads
}

fn outcome_name(figure: SessionFigure) -> String {
    let words = words::of(figure);
    format!("{}{}", words.name, words.unit_in_parentheses())
}

fn outcome_cells(row: &OutcomePrediction, found: &SessionTwin) -> Vec<String> {
    let words = words::of(row.figure);
    let interval = |i: Option<Interval>| {
        i.map_or_else(
            || NONE.to_owned(),
            |i| {
                format!(
                    "{} [{}, {}]",
                    words.value(Some(i.middle)),
                    words.value(Some(i.low)),
                    words.value(Some(i.high))
                )
            },
        )
    };
    let mut cells = vec![
        outcome_name(row.figure),
        words.value(row.recorded),
        interval(row.predicted),
    ];
    if !found.changed.is_empty() {
        cells.push(interval(row.changed));
    }
    cells
}

fn figure_name(figure: CalibrationFigure) -> String {
    match figure {
        CalibrationFigure::Events(figure) => outcome_name(figure),
        CalibrationFigure::Weak => "weak presses (%)".to_owned(),
        CalibrationFigure::Fitted => "RMSE of the geometry, fitted (mm)".to_owned(),
        CalibrationFigure::LeftOut => "RMSE at left-out locations (mm)".to_owned(),
        CalibrationFigure::LeftOutGeometry => "RMSE of the geometry, left out (mm)".to_owned(),
    }
}

fn figure_value(figure: CalibrationFigure, x: f64) -> String {
    match figure {
        CalibrationFigure::Events(figure) => words::of(figure).value(Some(x)),
        CalibrationFigure::Weak => number(Some(100.0 * x), 1),
        CalibrationFigure::Fitted
        | CalibrationFigure::LeftOut
        | CalibrationFigure::LeftOutGeometry => number(Some(x), 3),
    }
}

fn figure_cells(row: &FigureFit) -> [String; 4] {
    let value = |x: f64| figure_value(row.figure, x);
    let expected = row.expected;
    let mark = if row.is_unlike() { " *" } else { "" };
    [
        figure_name(row.figure),
        value(row.session),
        format!(
            "{} [{}, {}]",
            value(expected.middle),
            value(expected.low),
            value(expected.high)
        ),
        format!("{}{mark}", number(Some(row.deviations), 1)),
    ]
}

fn constant_cells(row: &ConstantFit) -> [String; 4] {
    let unit = row.constant.unit();
    let name = match unit {
        "" => row.constant.key().to_owned(),
        unit => format!("{} ({unit})", row.constant.key()),
    };
    let (low, high) = row.constant.range();
    let explained = if row.explained < KNOWN {
        "not shown".to_owned()
    } else {
        number(Some(100.0 * row.explained), 0)
    };
    [
        name,
        format!(
            "{} [{}, {}]",
            number(Some(row.value.middle), 2),
            number(Some(row.value.low), 2),
            number(Some(row.value.high), 2)
        ),
        format!("{} to {}", number(Some(low), 2), number(Some(high), 2)),
        explained,
    ]
}
