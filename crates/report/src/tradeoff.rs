//! Owns the presentation of a tradeoff: terminal table, and page with its figure.

use std::fmt::Write as _;

use minijinja::value::Serde;
use minijinja::{Value, context};
use skinrig_analysis::result::Estimate;
use skinrig_analysis::tradeoff::{Cost, Row, Tradeoff};
use skinrig_text::{Column, Paint, Table};

pub use crate::choices::label;
use crate::choices::short;
use crate::error::ReportError;
use crate::figures::tradeoff as figure;
use crate::format::{interval, number};
use crate::frame::Frame;
use crate::grid::Grid;
use crate::svg::FIGURE_CSS;

const TEMPLATE: &str = include_str!("../assets/tradeoff/page.html");
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

/// Fronts of a row as letters: c for CPU time, b for bytes, d for delay.
fn fronts(row: &Row) -> String {
    let letter = |(cost, letter): (Cost, char)| {
        if row.fronts.contains(&cost) {
            letter
        } else {
            ' '
        }
    };
    [(Cost::Cpu, 'c'), (Cost::Bytes, 'b'), (Cost::Delay, 'd')]
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

/// The chosen rows. At most 100 columns, ends with a newline. `rig` describes the origin of the session.
#[must_use]
pub fn terminal_table(result: &Tradeoff, rows: Rows, rig: &str, color: bool) -> String {
    let (used, of) = result.scored;
    let mut out = format!(
        "{}\n{} choices tried on {used} of {of} attempted scoring presses (n: those that count),\n\
         each calibrated (model {}) on {} of {} others.\n\
         A choice competes when it locates at least {} % of the presses; others are in brackets.\n\
         Front: c CPU time, b bytes, d delay. CPU: median of {} runs over {} presses, both cameras.\n\n",
        crate::terminal::plain(rig),
        result.rows.len(),
        model(result),
        result.calibrating.0,
        result.calibrating.1,
        number(Some(100.0 * result.least_located), 1),
        result.repeats,
        result.timed_presses,
    );
    let paint = Paint::new(color);
    let numbers = [6, 14, 4, 7, 6, 7, 7, 6].map(Column::right);
    let mut columns = vec![Column::left(3), Column::left(31).clipped()];
    columns.extend(numbers);
    let table = Table::new(columns).gap(1);
    for head in [
        [
            "",
            "",
            "RMSE",
            "95 % interval",
            "n",
            "located",
            "within",
            "CPU",
            "sent",
            "delay",
        ],
        ["", "", "mm", "mm", "", "%", "%", "µs", "kB/s", "ms"],
    ] {
        let _ = writeln!(out, "{}", table.row(head));
    }
    for (i, row) in ordered(result, rows).into_iter().enumerate() {
        let mut name = label(&row.choice);
        if !row.competes {
            name = format!("({name})");
        }
        let line = table.row([
            fronts(row),
            name,
            number(row.rmse_mm.value, 2),
            interval(&row.rmse_mm, 1.0, 2),
            row.rmse_mm.n.to_string(),
            percent(&row.located_rate),
            percent(&row.within_rate),
            short(row.cpu_us),
            short(row.bytes_per_s / 1e3),
            short(row.delay_ms),
        ]);
        let line = if row.fronts.is_empty() {
            line
        } else {
            paint.bold(&line)
        };
        let _ = writeln!(out, "{line}");
        if i == 0 {
            out += "    ^ the session's settings; all others change them\n";
        }
    }
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

/// Columns of the page's table, with units.
const COLUMNS: [&str; 12] = [
    "Choice",
    "#Front",
    "#RMSE (mm)",
    "#95 % interval",
    "#n",
    "#Penalised (mm)",
    "#Located (%)",
    "#Within (%)",
    "#CPU (µs)",
    "#CPU range",
    "#Sent (kB/s)",
    "#Delay (ms)",
];

/// A self-contained page with the figure and a table of all rows. `rig` describes the origin of the session.
///
/// # Errors
/// [`ReportError`] when rendering fails; no known input causes this.
pub fn page(result: &Tradeoff, session: &str, rig: &str) -> Result<String, ReportError> {
    let frame = Frame {
        templates: &[("tradeoff.html", TEMPLATE)],
        styles: &[FIGURE_CSS, CSS],
        script: "",
    };
    let figure = figure::fronts(result, rig, &format!("session {session}"));
    let mut table = Grid::new("choices", "All choices", &COLUMNS);
    let rows = if result.rows.len() > MAX_ROWS {
        Rows::Front
    } else {
        Rows::All
    };
    for (i, row) in ordered(result, rows).into_iter().enumerate() {
        let class = match (row.competes, row.fronts.is_empty()) {
            (false, _) => "out",
            (true, false) => "front",
            (true, true) => "",
        };
        table.row_of(cells(row, i == 0), class);
    }
    frame.render(context! { session, rig, figure => Value::from(Serde(figure)), table_of_choices => Value::from(Serde(table)) })
}

fn cells(row: &Row, is_own: bool) -> [String; COLUMNS.len()] {
    let own = if is_own {
        " (the session's settings; all others change them)"
    } else {
        ""
    };
    let names = row.fronts.iter().map(|c| figure::name(*c));
    let (low, high) = row.cpu_range_us;
    [
        format!("{}{own}", label(&row.choice)),
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
    ]
}
