//! Owns the terminal table of a comparison.

use skinrig_compare::{Causes, Comparison, Difference, Severity};
use skinrig_text::{Column as Cells, Paint};

use super::{looks, metrics, text};
use crate::document::{Column, Note, Row, Section, Table, Tone, terminal};
use crate::format::number;

/// Harmless differences with their own line; the page lists all.
const MAX_HARMLESS: usize = 4;

/// At most 80 columns, ends with a newline. `color` adds ANSI escapes without changing the layout.
#[must_use]
pub fn terminal_table(result: &Comparison, color: bool) -> String {
    let mut sections = vec![verdicts(result)];
    sections.extend(sequential(result));
    sections.extend([skins(result), comparability(result)]);
    for (k, skin) in result.skins.iter().enumerate().skip(1) {
        if !result.table.is_empty() {
            sections.extend(against(result, k));
        }
        let causes = result.causes.get(k - 1).and_then(Option::as_ref);
        sections.extend(causes.map(|causes| why(causes, skin.letter)));
    }
    terminal(&sections, Paint::new(color))
}

/// The answer, one sentence for each skin but the first.
fn verdicts(result: &Comparison) -> Section {
    let section = Section::plain();
    if result.blocking().next().is_some() {
        let text = "none: these skins may not be compared, see BLOCKING";
        return section.with(Note::new("VERDICT", text).warning());
    }
    let weighs = |d: &&Difference| d.severity != Severity::Harmless;
    let doubts = match result.differences.iter().filter(weighs).count() {
        0 => String::new(),
        n => format!(
            "; {} that may explain it without the skin",
            text::counted(n, "recorded difference")
        ),
    };
    let others = result.skins.iter().enumerate().skip(1);
    section
        .with_all(others.filter_map(|(k, skin)| {
            let found = result
                .headline()?
                .against_first
                .iter()
                .find(|a| a.subject == k)?;
            let fewer = text::fewer_located(result, found);
            let text = format!(
                "{} against A: {}{}. {}{}{doubts}",
                skin.letter,
                text::verdict(found.verdict),
                fewer.as_ref().map_or("", |_| text::WHERE_LOCATED),
                text::headline(result, found),
                fewer.map_or_else(String::new, |text| format!("; but {text}")),
            );
            Some(Note::new("VERDICT", text).tone(Tone::Answer))
        }))
        .with_all(text::together(result).map(Note::of))
        .with_all(shared(result))
}

/// Locations behind the verdicts, where a skin has others that do not count.
fn shared(result: &Comparison) -> Vec<Note> {
    let rows = result
        .headline()
        .into_iter()
        .flat_map(|row| &row.against_first);
    let partly = rows.filter_map(|found| {
        let design = found.comparison.as_ref()?.design;
        let letter = result.skins.get(found.subject)?.letter;
        let [locations, _] = design.locations;
        let [a, b] = design.presses;
        (design.left_out != [0, 0]).then(|| {
            let text = format!(
                "only {}: {a} presses of A, {b} of {letter}",
                text::counted(locations as usize, "shared location")
            );
            Note::new("compared", text).warning()
        })
    });
    partly.collect()
}

/// Conclusion and looks of a sequential comparison.
fn sequential(result: &Comparison) -> Option<Section> {
    let (of, skin) = (result.sequential.as_ref()?, result.skins.get(1)?);
    let conclusion = looks::conclusion(of, skin.letter);
    let section = Section::plain().with(Note::new("LOOKS", conclusion).tone(Tone::Answer));
    Some(section.with_all((!of.looks.is_empty()).then(|| looks::table(of, skin.letter))))
}

fn skins(result: &Comparison) -> Section {
    let skins = result.skins.iter();
    let stand_in = text::stand_in(result).map(|word| {
        let text = format!("{}, not measured on hardware", word.to_uppercase());
        Note::new("rig", text).warning()
    });
    let limits = result.limits.as_deref();
    Section::plain()
        .with_all(skins.map(|skin| Note::new(skin.letter, text::skin(skin))))
        .with_all(stand_in)
        .with_all(limits.map(|limits| Note::new("limits", limits)))
}

fn comparability(result: &Comparison) -> Section {
    if result.differences.is_empty() {
        let text = "no recorded difference besides the skin";
        return Section::plain().with(Note::new("differ", text));
    }
    let of = |severity: Severity| {
        let all = result.differences.iter();
        all.filter(move |d| d.severity == severity)
    };
    let blocking = of(Severity::Blocking).map(|d| {
        let label = if d.overridden { "despite" } else { "BLOCKING" };
        Note::new(label, line(result, d)).warning()
    });
    let confounding = of(Severity::Confounding);
    let harmless = of(Severity::Harmless).take(MAX_HARMLESS);
    let more = of(Severity::Harmless).count().saturating_sub(MAX_HARMLESS);
    let more = (more > 0).then(|| Note::of(format!("and {more} more harmless differences")));
    Section::plain()
        .with_all(blocking)
        .with_all(confounding.map(|d| Note::new("confounds", line(result, d)).warning()))
        .with_all(harmless.map(|d| Note::new("harmless", line(result, d))))
        .with_all(more)
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

/// Metrics of skin `k`, and what would decide the first undecided one.
fn against(result: &Comparison, k: usize) -> [Section; 2] {
    let is_without_margins = result.table.iter().all(|r| r.margin.is_none());
    let hint = "no margins: nothing can be equivalent (--limits FILE or --margin rmse=0.5mm)";
    let undecided = result.table.iter().find_map(|row| {
        let found = row.against_first.iter().find(|a| a.subject == k)?;
        let needed = metrics::needed(result, row, found)?;
        Some(Note::new("undecided", format!("{}: {needed}", row.name)))
    });
    [
        Section::plain()
            .with(metrics::metrics(result, k))
            .with_all(is_without_margins.then(|| Note::of(hint))),
        Section::plain().with_all(undecided),
    ]
}

fn why(causes: &Causes, letter: char) -> Section {
    let mm2 = |v: Option<f64>| number(v, 3);
    let head = match causes.carried_by {
        Some(factor) => format!("main cause: {}", factor.name()),
        None => "no single cause explains the difference".to_owned(),
    };
    let change = format!(
        "mean square error {} -> {} mm²: change {} [{}, {}]",
        mm2(Some(causes.mse_mm2[0])),
        mm2(Some(causes.mse_mm2[1])),
        mm2(Some(causes.change_mm2.value)),
        mm2(causes.change_mm2.low),
        mm2(causes.change_mm2.high),
    );
    let columns = [
        Column::of_terminals("", Cells::left(34).after(10)),
        Column::of_terminals("", Cells::right(9)),
        Column::of_terminals("", Cells::left(0).after(1)),
    ];
    let parts = causes.contributions.iter().map(|c| {
        let interval = format!("[{}, {}]", mm2(c.mm2.low), mm2(c.mm2.high));
        let name = c.factor.name().to_owned();
        Row::new([name, mm2(Some(c.mm2.value)), interval])
    });
    let exchanged = causes.exchanged.iter();
    let exchanged = exchanged.filter(|x| x.presses != x.calibration || x.presses != x.settings);
    Section::plain()
        .with(Note::new(format!("why {letter}"), head).tone(Tone::Answer))
        .with(Note::of(change))
        .with(Table::of("causes", "Causes", columns).gap(0).with(parts))
        .with_all(exchanged.map(|x| {
            Note::of(format!(
                "presses of {}, calibration of {}, settings of {}: RMSE {} mm",
                x.presses,
                x.calibration,
                x.settings,
                number(x.rmse_mm, 2)
            ))
        }))
}
