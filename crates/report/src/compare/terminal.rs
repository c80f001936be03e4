//! Owns the terminal table of a comparison.

use std::fmt::Write as _;

use skinrig_compare::statistics::Verdict;
use skinrig_compare::{Causes, Comparison, Difference, Severity};
use skinrig_text::{Column, Paint, Table};

use super::text;
use crate::format::{NONE, number};
use crate::terminal::{plain, wrap};

/// Harmless differences with their own line; the page lists all.
const MAX_HARMLESS: usize = 4;

/// At most 80 columns, ends with a newline. `color` adds ANSI escapes without changing the layout.
#[must_use]
pub fn terminal_table(result: &Comparison, color: bool) -> String {
    let paint = Paint::new(color);
    let mut out = verdicts(result, paint);
    for skin in &result.skins {
        out += &wrap(&format!("{:<10}", skin.letter), &plain(&text::skin(skin)));
    }
    if let Some(word) = text::stand_in(result) {
        let text = format!("{}, not measured on hardware", word.to_uppercase());
        out += &paint.warn(&wrap("rig       ", &text));
    }
    if let Some(limits) = &result.limits {
        out += &wrap("limits    ", &plain(limits));
    }
    out.push('\n');
    out += &comparability(result, paint);
    for (k, skin) in result.skins.iter().enumerate().skip(1) {
        out += &against(result, k, skin.letter, paint);
        if let Some(Some(causes)) = result.causes.get(k - 1) {
            out += &causes_block(causes, skin.letter, paint);
        }
    }
    out
}

/// The answer, one sentence for each skin but the first.
fn verdicts(result: &Comparison, paint: Paint) -> String {
    let mut out = String::new();
    if result.blocking().next().is_some() {
        let text = "none: these skins may not be compared, see BLOCKING";
        return paint.warn(&wrap("VERDICT   ", text)) + "\n";
    }
    let of = |severity| {
        result
            .differences
            .iter()
            .filter(move |d| d.severity == severity)
    };
    let doubts = match (
        of(Severity::Blocking).count(),
        of(Severity::Confounding).count(),
    ) {
        (0, 0) => String::new(),
        (despite, confounding) => format!(
            "; {} that may explain it without the skin",
            text::counted(despite + confounding, "recorded difference")
        ),
    };
    for (k, skin) in result.skins.iter().enumerate().skip(1) {
        let row = result.headline();
        let Some(found) = row.and_then(|r| r.against_first.iter().find(|a| a.subject == k)) else {
            continue;
        };
        let text = format!(
            "{} against A: {}. {}{doubts}",
            skin.letter,
            text::verdict(found.verdict),
            text::headline(result, found)
        );
        out += &paint.bold(&wrap("VERDICT   ", &plain(&text)));
    }
    out.push('\n');
    out
}

fn comparability(result: &Comparison, paint: Paint) -> String {
    let mut out = String::new();
    let of = |severity: Severity| {
        result
            .differences
            .iter()
            .filter(move |d| d.severity == severity)
    };
    for difference in of(Severity::Blocking) {
        let first = if difference.overridden {
            "despite   "
        } else {
            "BLOCKING  "
        };
        out += &paint.warn(&wrap(first, &plain(&line(result, difference))));
    }
    for difference in of(Severity::Confounding) {
        out += &paint.warn(&wrap("confounds ", &plain(&line(result, difference))));
    }
    let harmless: Vec<&Difference> = of(Severity::Harmless).collect();
    for difference in harmless.iter().take(MAX_HARMLESS) {
        out += &wrap("harmless  ", &plain(&line(result, difference)));
    }
    if let Some(more) = harmless.len().checked_sub(MAX_HARMLESS).filter(|n| *n > 0) {
        out += &wrap(
            "          ",
            &format!("and {more} more harmless differences"),
        );
    }
    if out.is_empty() {
        out += "differ    no recorded difference besides the skin\n";
    }
    out.push('\n');
    out
}

fn line(result: &Comparison, difference: &Difference) -> String {
    let values = result.skins.iter().zip(&difference.values);
    let values: Vec<String> = values.map(|(s, v)| format!("{} {v}", s.letter)).collect();
    format!(
        "{}: {} ({})",
        difference.what,
        values.join(", "),
        difference.reason
    )
}

fn against(result: &Comparison, k: usize, letter: char, paint: Paint) -> String {
    let mut out = String::new();
    if result.table.is_empty() {
        return out;
    }
    let table = Table::new([
        Column::left(26),
        Column::right(7),
        Column::right(8),
        Column::right(9),
        Column::right(18),
    ])
    .gap(0);
    let head = table.row([
        &format!("{letter} against A"),
        "A",
        &letter.to_string(),
        &format!("{letter} - A"),
        "95 % interval",
        "  verdict",
    ]);
    let _ = writeln!(out, "{}", paint.bold(&head));
    let mut undecided = Vec::new();
    for row in &result.table {
        let Some(found) = row.against_first.iter().find(|a| a.subject == k) else {
            continue;
        };
        let Some(c) = &found.comparison else {
            let own = |i: usize| {
                let value = row.values.get(i).and_then(|v| v.value);
                text::value(row, value.map(|v| v.value))
            };
            let name = text::heading(row);
            let line = table.row([&name, &own(0), &own(k), NONE, NONE, "  no verdict"]);
            let _ = writeln!(out, "{line}");
            continue;
        };
        let text = table.row([
            text::heading(row),
            text::value(row, Some(c.a.value)),
            text::value(row, Some(c.b.value)),
            text::signed(row, c.difference.value),
            text::interval(row, &c.difference),
            format!("  {}", text::verdict(found.verdict)),
        ]);
        let text = match found.verdict {
            Some(Verdict::Worse) => paint.warn(&text),
            Some(Verdict::Better) => paint.bold(&text),
            _ => text,
        };
        let _ = writeln!(out, "{text}");
        if found.verdict == Some(Verdict::Undecided)
            && row.margin.is_some()
            && let Some(needed) = text::needed(c)
        {
            undecided.push((row.name.clone(), needed));
        }
    }
    if result.table.iter().all(|r| r.margin.is_none()) {
        out += &wrap(
            "          ",
            "no margins: nothing can be equivalent (--limits FILE or --margin rmse=0.5mm)",
        );
    }
    out.push('\n');
    for (name, needed) in undecided.iter().take(1) {
        out += &wrap("undecided ", &format!("{name}: {needed}"));
    }
    out
}

fn causes_block(causes: &Causes, letter: char, paint: Paint) -> String {
    let mm2 = |v: Option<f64>| number(v, 3);
    let head = match causes.carried_by {
        Some(factor) => format!("main cause: {}", factor.name()),
        None => "no single cause explains the difference".to_owned(),
    };
    let mut out = paint.bold(&wrap(&format!("why {letter}     "), &head));
    let _ = writeln!(
        out,
        "          mean square error {} -> {} mm²: change {} [{}, {}]",
        mm2(Some(causes.mse_mm2[0])),
        mm2(Some(causes.mse_mm2[1])),
        mm2(Some(causes.change_mm2.value)),
        mm2(causes.change_mm2.low),
        mm2(causes.change_mm2.high),
    );
    for c in &causes.contributions {
        let _ = writeln!(
            out,
            "          {:<34}{:>9} [{}, {}]",
            c.factor.name(),
            mm2(Some(c.mm2.value)),
            mm2(c.mm2.low),
            mm2(c.mm2.high)
        );
    }
    for x in &causes.exchanged {
        let own = x.presses == x.calibration && x.presses == x.settings;
        if !own {
            let _ = writeln!(
                out,
                "          presses of {}, calibration of {}, settings of {}: RMSE {} mm",
                x.presses,
                x.calibration,
                x.settings,
                number(x.rmse_mm, 2)
            );
        }
    }
    out.push('\n');
    out
}
