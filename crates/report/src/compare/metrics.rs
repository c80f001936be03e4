//! Owns the tables of a comparison that page and terminal share.

use skinrig_compare::{BaselineComparison, Comparison};
use skinrig_statistics::Verdict;
use skinrig_text::{Column as Cells, Style};

use super::text;
use crate::document::{Column, Row, Table, Text};
use crate::format::NONE;

/// Metrics of skin `k` against the first.
pub(super) fn metrics(result: &Comparison, k: usize) -> Table {
    let letter = result.skins[k].letter;
    let number = |page: &str, terminal: &str, width| {
        Column::new(format!("#{page}")).terminal(terminal, Cells::right(width))
    };
    let title = format!("{letter} against A");
    let interval = format!("{} interval", text::level(result));
    let columns = [
        Column::new("Metric").terminal(&*title, Cells::left(26)),
        number("A", "A", 7),
        number(&letter.to_string(), &letter.to_string(), 8),
        number(&format!("{letter} − A"), &format!("{letter} - A"), 9),
        number(&interval, &interval, 18),
        Column::new("#Margin"),
        Column::new(format!("Verdict on {letter}")).terminal("verdict", Cells::left(0).after(2)),
        Column::new("").class("soft"),
    ];
    let rows = result.table.iter().filter_map(|row| metric(result, row, k));
    let mut table = Table::of(format!("metrics-{letter}"), title, columns);
    table.download("metrics");
    table.class("versus").gap(0).with(rows)
}

fn metric(result: &Comparison, row: &skinrig_compare::Row, k: usize) -> Option<Row> {
    let found = row.against_first.iter().find(|a| a.subject == k)?;
    let c = found.comparison.as_ref();
    let own = |i: usize| row.values.get(i).and_then(|v| v.value).map(|v| v.value);
    let (difference, interval) = match found.difference() {
        Some(of) => (text::signed(row, of.value), text::interval(row, &of)),
        None => (NONE.to_owned(), NONE.to_owned()),
    };
    let margin = row.margin.map_or_else(
        || NONE.to_owned(),
        |m| format!("± {}", text::value(row, Some(m))),
    );
    let verdict = text::verdict(found.verdict);
    let pill = format!("pill {}", verdict.replace(' ', "-"));
    let note = found
        .error
        .as_ref()
        .map(ToString::to_string)
        .or_else(|| needed(result, row, found));
    let style = match found.verdict {
        Some(Verdict::Worse) => Some(Style::Warning),
        Some(Verdict::Better) => Some(Style::Bold),
        _ => None,
    };
    let cells = [
        text::heading(row).into(),
        text::value(row, c.map(|c| c.a.value).or(own(0))).into(),
        text::value(row, c.map(|c| c.b.value).or(own(k))).into(),
        Text::new().bold(difference),
        interval.into(),
        margin.into(),
        Text::new().span(pill, verdict),
        note.unwrap_or_default().into(),
    ];
    let row = Row::new(cells).attribute("data-metric", row.metric.key());
    Some(row.style(style))
}

/// Presses that would decide an undecided metric with a margin; looks have their own outlook.
pub(super) fn needed(
    result: &Comparison,
    row: &skinrig_compare::Row,
    found: &BaselineComparison,
) -> Option<String> {
    let is_undecided = matches!(found.verdict, Some(Verdict::Undecided) | None);
    let c = found.comparison.as_ref();
    c.filter(|_| is_undecided && row.margin.is_some() && result.sequential.is_none())
        .and_then(text::needed)
}
