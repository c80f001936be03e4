//! Owns the presentation of a tradeoff: terminal table, and page with its figure.

use std::fmt::Write as _;

use skinrig_analysis::result::Estimate;
use skinrig_analysis::tradeoff::{Cost, Row, Tradeoff};
use skinrig_text::{Column as Cells, Paint, Style};

pub use crate::choices::label;
use crate::choices::short;
use crate::document::{self, Block, Column, Document, Group, Note, Section, Table, Text, lines};
use crate::figures::tradeoff as figure;
use crate::format::{interval, number};

const CSS: &str = include_str!("../assets/tradeoff/page.css");

/// Rows of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rows {
    /// The session's own settings and the choices on a front.
    Front,
    /// All choices.
    All,
}

/// The page has all choices up to this many; the data files always have all.
const MAX_ROWS: usize = 120;

/// Fronts of a row as letters: c for CPU time, b for bytes, d for delay, p for pixels.
fn fronts(row: &Row) -> String {
    let letter = |(cost, letter): (Cost, char)| {
        if row.fronts.contains(&cost) {
            letter
        } else {
            ' '
        }
    };
    [
        (Cost::Cpu, 'c'),
        (Cost::Bytes, 'b'),
        (Cost::Delay, 'd'),
        (Cost::Pixels, 'p'),
    ]
    .map(letter)
    .iter()
    .collect()
}

fn percent(e: &Estimate) -> String {
    number(e.value.map(|v| 100.0 * v), 1)
}

/// Rows in display order: the session's own, then those on a front by RMSE, then the others.
fn ordered(result: &Tradeoff, rows: Rows) -> Vec<&Row> {
    let (first, rest) = match result.rows.split_first() {
        Some((first, rest)) => (Some(first), rest),
        None => (None, &[][..]),
    };
    let rmse = |r: &&Row| r.rmse_mm.value.unwrap_or(f64::INFINITY);
    let (mut on, others): (Vec<&Row>, Vec<&Row>) = rest.iter().partition(|r| !r.fronts.is_empty());
    on.sort_by(|a, b| rmse(a).total_cmp(&rmse(b)));
    let others = match rows {
        Rows::Front => Vec::new(),
        Rows::All => others,
    };
    first.into_iter().chain(on).chain(others).collect()
}

/// The chosen rows, for a page (units in one line) and a terminal of 100 columns.
fn table(result: &Tradeoff, rows: Rows) -> Table {
    let number_of = |name: &str, head: &str, width| {
        Column::new(format!("#{name}")).terminal(head, Cells::right(width))
    };
    let mut table = Table::of(
        "choices",
        "All choices",
        [
            Column::of_terminals("", Cells::left(4)),
            Column::new("Choice").terminal("", Cells::left(30).clipped()),
            Column::new("#Front"),
            number_of("RMSE (mm)", "RMSE\nmm", 6),
            number_of("95 % interval", "95 % interval\nmm", 14),
            number_of("n", "n\n", 4),
            Column::new("#Penalised (mm)"),
            number_of("Located (%)", "located\n%", 7),
            number_of("Within (%)", "within\n%", 6),
            number_of("CPU (µs)", "CPU\nµs", 7),
            Column::new("#CPU range"),
            number_of("Sent (kB/s)", "sent\nkB/s", 7),
            number_of("Delay (ms)", "delay\nms", 6),
            Column::new("#Pixels"),
        ],
    )
    .class("trade");
    for (i, row) in ordered(result, rows).into_iter().enumerate() {
        let name = label(&row.choice);
        let (class, style) = match (row.competes, row.fronts.is_empty()) {
            (_, false) => ("front", Some(Style::Bold)),
            (false, true) => ("out", None),
            (true, true) => ("", None),
        };
        let names = row.fronts.iter().map(|c| figure::name(*c));
        let (low, high) = row.cpu_range_us;
        let cells = [
            fronts(row),
            if row.competes {
                name
            } else {
                format!("({name})")
            },
            names.collect::<Vec<_>>().join(", "),
            number(row.rmse_mm.value, 2),
            interval(&row.rmse_mm, 1.0, 2),
            row.rmse_mm.n.to_string(),
            number(row.penalised_rmse_mm.value, 2),
            percent(&row.located_rate),
            percent(&row.within_rate),
            short(row.cpu_us),
            format!("{} to {}", short(low), short(high)),
            short(row.bytes_per_s / 1e3),
            short(row.delay_ms),
            row.pixels.to_string(),
        ];
        let own = (i == 0).then_some("the session's settings; all others change them");
        let row = document::Row::new(cells).class(class).style(style);
        table.add(row.remark(own));
    }
    table
}

/// The chosen rows. At most 100 columns, ends with a newline. `rig` describes the origin of the session.
#[must_use]
pub fn terminal_table(result: &Tradeoff, rows: Rows, rig: &str, color: bool) -> String {
    let (used, of) = result.scored;
    let mut out = format!(
        "{}\n{} of {} choices tried on {used} of {of} attempted scoring presses (n: those that count),\n\
         each calibrated (model {}) on {} of {} others.\n\
         A choice competes when it locates at least {} % of the presses; others are in brackets.\n\
         Front: c CPU time, b bytes, d delay, p pixels. CPU: median of {} runs over {} presses, both cameras.\n\n",
        crate::format::plain(rig),
        result.rows.len(),
        result.predictions.combinations,
        model(result),
        result.calibrating.0,
        result.calibrating.1,
        number(Some(100.0 * result.least_located), 1),
        result.repeats,
        result.timed_presses,
    );
    out += &lines(&[Block::from(table(result, rows))], Paint::new(color));
    if rows == Rows::Front {
        out += "\nShown: the session's own settings and the fronts. The page and -v have every choice.\n";
    }
    out
}

fn model(result: &Tradeoff) -> String {
    serde_json::to_value(result.model)
        .ok()
        .and_then(|v| v.as_str().map(str::to_owned))
        .unwrap_or_default()
}

/// Protocol lines that select a row, indented below `analysis:`; empty for the session's own settings.
#[must_use]
pub fn protocol_lines(row: &Row) -> String {
    if row.overrides.is_empty() {
        return String::new();
    }
    let mut out = "analysis:\n".to_owned();
    let mut crop = String::new();
    for (key, value) in &row.overrides {
        let key = key.strip_prefix("analysis.").unwrap_or(key);
        if let Some(camera) = key.strip_prefix("crop.") {
            let comma = if crop.is_empty() { "" } else { ", " };
            let _ = write!(crop, "{comma}{camera}: {value}");
        } else {
            let _ = writeln!(out, "  {key}: {value}");
        }
    }
    if !crop.is_empty() {
        let _ = writeln!(out, "  crop: {{{crop}}}");
    }
    out
}

fn interrupted(result: &Tradeoff) -> Option<Note> {
    result.is_interrupted.then(|| {
        let text = format!(
            "{} of {} choices were tried: others may be better.",
            result.rows.len(),
            result.predictions.combinations
        );
        Note::new("INTERRUPTED.", text)
            .warning()
            .test_id("interrupted")
    })
}

/// A self-contained page with the figure and a table of all rows. `rig` describes the origin of the session.
#[must_use]
pub fn page(result: &Tradeoff, session: &str, rig: &str) -> String {
    let figure = figure::fronts(result, rig, &format!("session {session}"));
    let rows = if result.rows.len() > MAX_ROWS {
        Rows::Front
    } else {
        Rows::All
    };
    let choices = Section::new("choices", "All choices");
    Document {
        title: format!("Speed against accuracy: {session} · skinrig tradeoff"),
        brand: "skinrig tradeoff",
        heading: "Speed against accuracy".to_owned(),
        heading_id: "heading",
        subheads: vec![Text::from(format!("session {session}")), rig.into()],
        skip: ("#choices", "Skip to the table"),
        sections: vec![
            Section::new("fronts", "Fronts")
                .with_all(interrupted(result))
                .with(figure),
            choices.with(Group::card().with(table(result, rows))),
        ],
        about: format!("Session {session}."),
        data: Some(crate::tables::of_tradeoff(result, session)),
        styles: vec![CSS],
        ..Document::default()
    }
    .html()
}
