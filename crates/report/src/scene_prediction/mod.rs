//! Owns the presentation of `skinrig scene predict`: how a session differs from what its scene predicts, as text, as a page, and
//! as a remark of a report.

mod figure;
mod page;
pub(crate) mod words;

use serde::{Deserialize, Serialize};
use skinrig_compare::scene::FigurePrediction;
use skinrig_text::{Column, Table};

use crate::format::{NONE, number};

pub use self::page::page;

/// A session and what a scene predicts of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScenePrediction {
    /// File of the session.
    pub session: String,
    /// What its data come from, in words: `simulated (optical)`.
    pub origin: String,
    /// The scene, in words: `optical, scene paper`.
    pub scene: String,
    /// Changes of the protocol in the replicates, as `key=value`.
    pub changed: Vec<String>,
    /// Seeds of the replicates that were analysed, in order.
    pub seeds: Vec<u64>,
    /// Replicates that could not be analysed: seed and why.
    pub failed: Vec<(u64, String)>,
    /// One row per figure.
    pub figures: Vec<FigurePrediction>,
}

impl ScenePrediction {
    /// Figures that are not as predicted, least probable first.
    #[must_use]
    pub fn differing(&self) -> Vec<&FigurePrediction> {
        let mut found: Vec<_> = self.figures.iter().filter(|row| row.differs()).collect();
        let p = |row: &FigurePrediction| row.predicted.and_then(|p| p.p).unwrap_or(1.0);
        found.sort_by(|a, b| p(a).total_cmp(&p(b)));
        found
    }

    /// Figures that have a value and a prediction.
    #[must_use]
    pub fn compared(&self) -> usize {
        let has_p = |row: &&FigurePrediction| row.predicted.is_some_and(|p| p.p.is_some());
        self.figures.iter().filter(has_p).count()
    }

    /// The scene with the changes of its protocol.
    #[must_use]
    pub fn scene_in_words(&self) -> String {
        if self.changed.is_empty() {
            return self.scene.clone();
        }
        format!("{}, {}", self.scene, self.changed.join(", "))
    }

    /// The answer in one sentence.
    #[must_use]
    pub fn verdict(&self) -> String {
        let (n, differing) = (self.compared(), self.differing().len());
        let replicates = self.seeds.len();
        match (n, differing) {
            (0, _) => format!("nothing could be compared with {replicates} simulated sessions"),
            (1, 0) => format!("as predicted: 1 figure agrees with {replicates} simulated sessions"),
            (_, 0) => {
                format!("as predicted: {n} figures agree with {replicates} simulated sessions")
            }
            (_, 1) => format!("1 of {n} figures is not as {replicates} simulated sessions predict"),
            _ => format!(
                "{differing} of {n} figures are not as {replicates} simulated sessions predict"
            ),
        }
    }
}

/// How a figure differs, with its values: `relaxes slower than modelled: ...`.
#[must_use]
pub fn sentence(row: &FigurePrediction) -> String {
    let words = words::of(row.figure);
    let direction = if row.is_higher() {
        words.higher
    } else {
        words.lower
    };
    let value = |x: Option<f64>| words.value(x);
    let (name, unit) = (words.name, words.unit());
    let Some(p) = row.predicted else {
        return format!("{name} {}{unit}", value(row.session));
    };
    format!(
        "{direction} than modelled: {name} {}{unit}, predicted {} [{}, {}], p {}",
        value(row.session),
        value(Some(p.middle)),
        value(Some(p.low)),
        value(Some(p.high)),
        probability(p.p)
    )
}

fn probability(p: Option<f64>) -> String {
    match p {
        Some(p) if p < 0.001 => "< 0.001".to_owned(),
        p => number(p, 3),
    }
}

/// Verdict, differences, and with `all` the table of all figures.
#[must_use]
pub fn terminal_text(found: &ScenePrediction, all: bool) -> String {
    /// Differences that are listed without `all`.
    const LISTED: usize = 6;
    let mut lines = vec![
        format!("{}  {}", found.session, found.verdict()),
        format!("scene  {}", found.scene_in_words()),
    ];
    let differing = found.differing();
    let listed = if all { differing.len() } else { LISTED };
    lines.extend(
        differing
            .iter()
            .take(listed)
            .map(|row| format!("- {}", sentence(row))),
    );
    if differing.len() > listed {
        lines.push(format!("- and {} more (-v)", differing.len() - listed));
    }
    lines.extend(failures(found));
    if all {
        lines.push(String::new());
        lines.push(table(found));
    }
    lines.join("\n")
}

/// Replicates without results.
fn failures(found: &ScenePrediction) -> Option<String> {
    let (seed, why) = found.failed.first()?;
    Some(format!(
        "{} of {} simulated sessions could not be analysed (seed {seed}: {why})",
        found.failed.len(),
        found.failed.len() + found.seeds.len()
    ))
}

const HEADS: [&str; 5] = ["figure", "session", "predicted", "95 % of sessions", "p"];

/// Cells of a figure's row.
fn cells(row: &FigurePrediction) -> [String; 5] {
    let words = words::of(row.figure);
    let name = format!("{}{}", words.name, words.unit_in_parentheses());
    let session = words.value(row.session);
    let Some(p) = row.predicted else {
        return [
            name,
            session,
            NONE.to_owned(),
            NONE.to_owned(),
            NONE.to_owned(),
        ];
    };
    let interval = format!(
        "[{}, {}]",
        words.value(Some(p.low)),
        words.value(Some(p.high))
    );
    let mark = if row.differs() { " *" } else { "" };
    [
        name,
        session,
        words.value(Some(p.middle)),
        interval,
        format!("{}{mark}", probability(p.p)),
    ]
}

fn table(found: &ScenePrediction) -> String {
    let columns = vec![
        Column::left(44),
        Column::right(10),
        Column::right(10),
        Column::right(20),
        Column::right(10),
    ];
    let table = Table::new(columns);
    let mut lines = vec![table.row(HEADS.map(str::to_owned))];
    lines.extend(found.figures.iter().map(|row| table.row(cells(row))));
    lines.push("* not as predicted: p, corrected for the number of figures, below 0.05".to_owned());
    lines.join("\n")
}

#[cfg(test)]
mod tests;
