//! Owns the HTML page of a comparison: verdicts, comparability, metrics, maps, causes, sessions.

use skinrig_compare::{Causes, Comparison, Difference, Severity};
use skinrig_statistics::Verdict;

use super::{figures, looks, metrics, tables, text};
use crate::document::{Banner, Block, Document, Group, Note, Row, Section, Table, Text, soft};
use crate::format::{capital, number};

const CSS: &str = include_str!("../../assets/compare/page.css");

/// The comparison as a self-contained HTML page.
#[must_use]
pub fn html(result: &Comparison) -> String {
    let stand_in = text::stand_in(result);
    let heading = match &result.skins[..] {
        [first, one] => format!("{} against {}", one.name, first.name),
        skins => format!("{} skins against {}", skins.len() - 1, skins[0].name),
    };
    let suffix = stand_in.map_or_else(String::new, |word| format!(" ({word})"));
    let badge = |words: &str| Text::new().span("badge", words);
    let limits = result
        .limits
        .as_ref()
        .map(|l| badge(&format!("limits: {l}")));
    let overridden = of(result, Severity::Blocking).map(|d| {
        let values: Vec<String> = values(result, d)
            .map(|(l, v)| format!("{l}: {v}"))
            .collect();
        let words = format!("{} ({}).", capital(&d.reason), values.join(", "));
        Banner::invalid("despite", format!("Overridden: {}", d.what), words)
    });
    let others = 1..result.skins.len();
    Document {
        title: format!("{heading}{suffix} · skinrig comparison"),
        brand: "skinrig comparison",
        heading,
        heading_id: "heading",
        subheads: result
            .skins
            .iter()
            .map(|s| letter(s.letter).add(format!(" {}", text::skin(s))))
            .collect(),
        badges: limits.into_iter().chain(stand_in.map(badge)).collect(),
        banners: stand_in
            .map(Banner::stand_in)
            .into_iter()
            .chain(overridden)
            .collect(),
        skip: ("#verdict", "Skip to the verdict"),
        sections: vec![
            verdict(result),
            Section::new("metrics", "Metrics")
                .with_all(
                    result
                        .sequential
                        .as_ref()
                        .filter(|s| !s.looks.is_empty())
                        .map(|s| {
                            looks::table(s, result.skins.get(1).map_or('B', |skin| skin.letter))
                                .card()
                        }),
                )
                .with_all(others.clone().map(|k| metrics::metrics(result, k).card())),
            Section::new("maps", "Maps").with_all(others.clone().flat_map(|k| maps(result, k))),
            Section::new("why", "Why they differ")
                .listed("Why")
                .with_all(others.map(|k| why(result, k))),
            Section::new("sessions", "Sessions").with(Group::card().with(sessions(result))),
        ],
        data: Some(tables::script_data(result)),
        styles: vec![CSS],
        ..Document::default()
    }
    .html()
}

/// Letter of a skin, in a box.
fn letter(letter: char) -> Text {
    Text::new().span("letter", letter.to_string())
}

/// Differences of this severity.
fn of(result: &Comparison, severity: Severity) -> impl Iterator<Item = &Difference> {
    let all = result.differences.iter();
    all.filter(move |d| d.severity == severity)
}

/// Values of a difference with the letters of their skins.
fn values<'a>(
    result: &'a Comparison,
    difference: &'a Difference,
) -> impl Iterator<Item = (char, &'a String)> {
    let letters = result.skins.iter().map(|s| s.letter);
    letters.zip(&difference.values)
}

fn verdict(result: &Comparison) -> Section {
    let mut notes = Vec::new();
    if result.table.iter().all(|r| r.margin.is_none()) {
        let text = Text::from(
            "No margins: no difference can be called equivalent. Give a file of limits with ",
        );
        notes.push(Note::of(text.code("--limits").add(".")).warning());
    }
    if let Some(text) = text::together(result) {
        notes.push(Note::of(format!(
            "These {text} (intervals: Bonferroni, verdicts: Holm)."
        )));
    }
    let cards = (1..result.skins.len()).map(|k| verdict_card(result, k));
    let left = Group::stack().with_all(cards).with_all(notes);
    Section::new("verdict", "Verdict")
        .hide_heading()
        .with(Group::new("first").with(left).with(comparability(result)))
}

fn verdict_card(result: &Comparison, k: usize) -> Group {
    let skin = &result.skins[k];
    let row = result.headline();
    let found = row.and_then(|r| r.against_first.iter().find(|a| a.subject == k));
    let compared = found.and_then(|f| f.comparison.as_ref());
    let verdict = found.and_then(|f| f.verdict);
    let word = text::verdict(verdict);
    let name = Text::from(format!("{} ", skin.letter)).bold(&*skin.name);
    let is_decided = matches!(verdict, Some(Verdict::Better | Verdict::Worse));
    let mut value = Text::from(word);
    if is_decided && compared.is_some_and(|c| c.beyond_margin) {
        value = value.span("unit", " by more than the margin");
    }
    let fewer = found.and_then(|f| text::fewer_located(result, f));
    if fewer.is_some() {
        value = value.span("unit", text::WHERE_LOCATED);
    }
    let headline = found.map(|f| text::headline(result, f)).unwrap_or_default();
    let mut headline = Text::from(headline);
    if let Some((row, margin)) = row.and_then(|r| Some((r, r.margin?))) {
        let margin = text::value(row, Some(margin));
        headline = headline.dot().add(format!("margin ± {margin} mm"));
    }
    let sequential = result.sequential.as_ref();
    let needed = match sequential {
        Some(of) => Some(capital(&looks::conclusion(of, skin.letter))),
        None => compared
            .and_then(text::needed)
            .map(|n| format!("Undecided: {n}")),
    };
    let cause = causes(result, k).map(|of| match of.carried_by {
        Some(factor) => Text::from("Main cause: ")
            .bold(factor.name())
            .add(", see ")
            .link("#why", "why")
            .add("."),
        None => "No single cause explains the difference.".into(),
    });
    Group::card()
        .class("verdict")
        .class(&word.replace(' ', "-"))
        .test_id(format!("verdict-{}", skin.letter))
        .with(Block::Text("name", name.add(" against A, by RMSE")))
        .with(Block::Text("value", value))
        .with(Block::Text("ci", headline))
        .with_all(fewer.map(|text| Block::Text("ci", format!("But {text}.").into())))
        .with_all(needed.map(|n| Block::Text("ci", format!("{n}.").into())))
        .with_all(cause.map(|text| Block::Text("ci why", text)))
}

fn causes(result: &Comparison, k: usize) -> Option<&Causes> {
    result.causes.get(k - 1).and_then(Option::as_ref)
}

fn comparability(result: &Comparison) -> Group {
    let note = |d: &Difference, weight: &str| {
        let mut text = Text::new().span("weight", weight).line_break();
        for (skin, value) in values(result, d) {
            text = text.then(letter(skin)).add(format!(" {value} \u{a0} "));
        }
        let text = text.line_break().span("soft", &*d.reason);
        Note::new(&*d.what, text)
    };
    let blocking = of(result, Severity::Blocking).map(|d| note(d, "blocking, overridden").bad());
    let confounding = of(result, Severity::Confounding).map(|d| note(d, "confounding").warning());
    let notes: Vec<Note> = blocking.chain(confounding).collect();
    let none = notes
        .is_empty()
        .then(|| Note::of("No recorded difference speaks against it.").good());
    let harmless = of(result, Severity::Harmless).count();
    let folded = (harmless > 0).then(|| {
        let summary = text::counted(harmless, "harmless difference");
        Group::folded(summary).with(differences(result))
    });
    Group::titled("Are they comparable?")
        .test_id("comparability")
        .with_all(none)
        .with_all(notes)
        .with_all(folded)
}

fn differences(result: &Comparison) -> Table {
    let letters: Vec<String> = result.skins.iter().map(|s| s.letter.to_string()).collect();
    let letters = letters.iter().map(String::as_str);
    let columns = ["Difference"]
        .into_iter()
        .chain(letters)
        .chain(["Why harmless"]);
    let columns: Vec<&str> = columns.collect();
    let rows = of(result, Severity::Harmless).map(|d| {
        let cells = [&d.what].into_iter().chain(&d.values).chain([&d.reason]);
        Row::new(cells.cloned())
    });
    Table::new("differences", "Harmless differences", &columns)
        .class("differences")
        .with(rows)
}

fn maps(result: &Comparison, k: usize) -> impl Iterator<Item = Block> {
    let beside = [figures::margins(result, k), figures::locations(result, k)];
    let pair = Group::new("pair").with_all(beside.into_iter().flatten());
    figures::maps(result, k)
        .map(Block::from)
        .into_iter()
        .chain([pair.into()])
}

fn why(result: &Comparison, k: usize) -> Block {
    let skin = result.skins[k].letter;
    let Some(of) = causes(result, k) else {
        let text =
            format!("{skin} and A share too few locations with counting presses to find causes.");
        return Note::of(text).into();
    };
    let [a, b] = of.presses;
    let presses = format!("{a} and {b} presses at {} shared locations.", of.locations);
    let exchanged_note = "A calibration is valid only for its camera positions. Errors with the other skin's calibration \
        therefore show how far the cameras moved.";
    let tables = Group::stack()
        .with(
            Group::titled("Measured in both")
                .with(measured(of, skin))
                .with(soft(presses)),
        )
        .with(
            Group::titled("Cross-evaluation")
                .with(exchanged(of))
                .with(soft(exchanged_note)),
        );
    Group::new("pair")
        .with(figures::causes(result, k, of))
        .with(tables)
        .into()
}

fn measured(of: &Causes, letter: char) -> Table {
    let rows = of.measured.iter().map(|m| {
        let digits = |v: Option<f64>| {
            if v.is_some_and(|v| v.abs() >= 100.0) {
                0
            } else {
                3
            }
        };
        let [a, b] = m.values.map(|v| number(v, digits(v)));
        Row::new([format!("{} ({})", m.what, m.unit), a, b])
    });
    let columns = ["Quantity", "#A", &format!("#{letter}")];
    let table = Table::new("measured", "Measured in both", &columns);
    table.class("versus").with(rows)
}

/// Errors with the calibration and settings of each skin.
fn exchanged(of: &Causes) -> Table {
    let rows = of.exchanged.iter().map(|x| {
        let [located, all] = x.located;
        let rmse = format!("{} ({located} of {all})", number(x.rmse_mm, 2));
        let skins = [x.presses, x.calibration, x.settings].map(|skin| skin.to_string());
        Row::new(skins.into_iter().chain([rmse]))
    });
    let columns = [
        "Presses of",
        "Calibration of",
        "Settings of",
        "#RMSE, mm (located)",
    ];
    let table = Table::new("exchanged", "Cross-evaluation", &columns);
    table.class("versus").with(rows)
}

fn sessions(result: &Comparison) -> Table {
    let rows = result.skins.iter().flat_map(|s| {
        s.sessions.iter().map(|f| {
            Row::new([
                letter(s.letter).add(format!(" {}", s.name)),
                Text::new().code(&*f.session_id),
                f.started.clone().into(),
                f.rig_name.clone().into(),
                f.file.clone().into(),
            ])
        })
    });
    let columns = ["Skin", "Session", "Started", "Rig", "File"];
    Table::new("sessions-table", "Sessions", &columns).with(rows)
}
