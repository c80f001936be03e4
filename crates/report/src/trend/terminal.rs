//! Owns the trends for a terminal: 80 columns, one line per series, a chart per drifted series.

use std::fmt::Write as _;

use skinrig_nightly::trend::report::format_number as number;
use skinrig_nightly::trend::{Chart, Report, SeriesState};
use skinrig_text::{
    Blocks, Column as Cells, LongWords, Paint, Style as Look, WIDTH, cut, hang, sparkline, wrap,
};

use super::{Links, cause, moved_by, since, state, with_unit};
use crate::document::{Block, Column, Row, Table, lines};
use crate::format::plain;

/// Columns of the name of a series, at least.
const NAME: usize = 35;
/// The longest name that is shown whole: no series of a suite has a longer one.
const LONGEST_NAME: usize = 47;
/// Nights in a sparkline beside short names.
const SPARK: usize = 20;
/// Columns and rows of a chart.
const PLOT: (usize, usize) = (66, 9);
/// Left margin of a chart, columns.
const MARGIN: usize = 12;
/// Series per alarm with a chart; the others have their lines.
const MAX_CHARTS: usize = 4;

/// Capabilities of the terminal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Style {
    /// True if the terminal shows Unicode.
    pub unicode: bool,
    /// True if the terminal shows colours.
    pub color: bool,
    /// Maximum number of nights.
    pub nights: usize,
}

/// Formats the trends of `report`: headline, alarms with charts of drifted series, one line per series whose name `shown`
/// accepts. `links`: one per alarm.
#[must_use]
pub fn terminal(
    report: &Report,
    links: &[Links],
    shown: impl Fn(&str) -> bool,
    style: Style,
) -> String {
    let mut out = String::new();
    let paint = Paint::new(style.color);
    for line in wrap(&plain(&report.headline), WIDTH, LongWords::Keep) {
        let _ = writeln!(out, "{}", paint.bold(&line));
    }
    for (alarm, links) in report.alarms.iter().zip(links) {
        let _ = writeln!(
            out,
            "\n{}: {}",
            paint.bold(&format!("alarm {}", plain(&alarm.id))),
            since(report, alarm)
        );
        let text = plain(&format!("probable cause: {}", cause(alarm)));
        out += &hang("  ", &text, LongWords::Keep);
        for changed in &alarm.attribution.changed {
            let _ = writeln!(out, "  changed: {}", plain(changed));
        }
        for command in &links.commands {
            let _ = writeln!(out, "  {command}");
        }
        if let Some(missing) = &links.missing {
            let _ = writeln!(out, "  no session: {}", plain(missing));
        }
        for at in alarm.charts.iter().take(MAX_CHARTS) {
            out.push('\n');
            let chart = &report.charts[*at];
            plot(&mut out, report, chart, &moved_by(chart, alarm), style);
        }
    }
    let charts = report.charts.iter().filter(|c| shown(&c.series.name));
    let charts: Vec<&Chart> = charts.collect();
    if !charts.is_empty() {
        out.push('\n');
        out += &lines(&[Block::from(series(report, &charts, style))], paint);
    }
    out
}

/// Trends of `report` in one sentence, wrapped at 80 columns.
#[must_use]
pub fn sentence(report: &Report) -> String {
    let text = plain(&format!("trend: {}", report.headline));
    wrap(&text, WIDTH, LongWords::Keep).join("\n")
}

/// One row per series, under the identifiers that commands take.
fn series(report: &Report, charts: &[&Chart], style: Style) -> Table {
    let widths = charts.iter().map(|c| plain(&c.series.name).chars().count());
    let name = widths.max().unwrap_or(0).clamp(NAME, LONGEST_NAME);
    // Commands take the name: it is shown whole, at the expense of the nights.
    let recent = (SPARK + NAME - name).min(style.nights);
    let nights = format!("{recent} nights");
    let columns = [
        Column::of_terminals("series", Cells::left(name)),
        Column::of_terminals(nights, Cells::left(recent)),
        Column::of_terminals("last", Cells::right(13)),
        Column::of_terminals("state", Cells::left(0).after(1)),
    ];
    let row = |chart: &&Chart| {
        let last = chart.nights.last();
        let last = last.map(|n| with_unit(n.value, &chart.series.unit));
        let row = Row::new([
            cut(&plain(&chart.series.name), name).to_owned(),
            spark(report, chart, recent, style),
            last.unwrap_or_else(|| "-".to_owned()),
            match chart.state {
                SeriesState::NotMeasured => "no value".to_owned(),
                _ => state(chart).to_owned(),
            },
        ]);
        let stands_out = matches!(chart.state, SeriesState::Moved | SeriesState::NotMeasured);
        row.style(stands_out.then_some(Look::Bold))
    };
    Table::of("series", "Series", columns).with(charts.iter().map(row))
}

/// Sparkline: one block per night, the centre of the reference in the middle; a space for a night without a value.
fn spark(report: &Report, chart: &Chart, recent: usize, style: Style) -> String {
    let from = report.nights.len().saturating_sub(recent);
    let share = |night| {
        let at = chart
            .nights
            .binary_search_by_key(&night, |n| n.night)
            .ok()?;
        let value = chart.nights[at].value;
        let score = chart.reference.map_or(0.0, |r| r.score(value));
        Some((score + 4.0) / 8.0)
    };
    let blocks = if style.unicode {
        Blocks::Unicode
    } else {
        Blocks::Ascii
    };
    sparkline((from..report.nights.len()).map(share), blocks)
}

/// Chart of one series: values, centre of the reference, change point.
fn plot(out: &mut String, report: &Report, chart: &Chart, moved: &str, style: Style) {
    let (columns, rows) = PLOT;
    let (dot, centre, change) = if style.unicode {
        ('●', '─', '┊')
    } else {
        ('o', '-', ':')
    };
    let count = report.nights.len().min(style.nights).min(columns);
    let first = report.nights.len() - count;
    let shown = chart.nights.iter().filter(|n| n.night >= first);
    let shown: Vec<(usize, f64)> = shown.map(|n| (n.night - first, n.value)).collect();
    let middle = chart.reference.map(|r| r.centre);
    let all = || shown.iter().map(|s| s.1).chain(middle);
    let (low, high) = (
        all().fold(f64::INFINITY, f64::min),
        all().fold(f64::NEG_INFINITY, f64::max),
    );
    let span = if high > low { high - low } else { 1.0 };
    let row = |value: f64| {
        let share = ((high - value) / span).clamp(0.0, 1.0);
        (share * (rows - 1) as f64).round() as usize
    };
    let mut cells = vec![vec![' '; count]; rows];
    if let Some(middle) = middle {
        cells[row(middle)].fill(centre);
    }
    if let Some(at) = chart
        .open_excursion()
        .and_then(|e| e.change.likeliest.checked_sub(first))
    {
        for cells in &mut cells {
            cells[at] = change;
        }
    }
    for (at, value) in &shown {
        cells[row(*value)][*at] = dot;
    }
    let _ = writeln!(out, "  {} ({moved})", plain(&chart.series.name));
    for (at, cells) in cells.iter().enumerate() {
        let label = match (at, middle) {
            (0, _) => number(high),
            (at, _) if at == rows - 1 => number(low),
            (at, Some(middle)) if at == row(middle) => number(middle),
            _ => String::new(),
        };
        let cells: String = cells.iter().collect();
        let _ = writeln!(out, "{label:>MARGIN$} {}", cells.trim_end());
    }
}
