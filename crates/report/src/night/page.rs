//! Owns the HTML page of a night: where to look, trends, time, checks, versions.

use skinrig_nightly::{Attempt, Cause, CheckResult, Measurement, Night, Verdict};

use super::trends::Trends;
use super::{bars, text};
use crate::document::{
    Banner, Block, Column, Document, Fact, Group, Note, Row, Section, Table, Text, Tone, soft,
};
use crate::format::{capital, phrase};
use crate::trend::ALARM_CSS;

const CSS: &str = include_str!("../../assets/night/page.css");
const SCRIPT: &str = include_str!("../../assets/night/page.js");
/// Button beside the heading of the checks.
const ALL: &str =
    r#"<span class="tools"><button type="button" id="all">Open or close all</button></span>"#;

/// The night and its trends as a self-contained HTML page. It links to the golden session's report and to the page of the
/// trends.
#[must_use]
pub fn html(night: &Night, trends: Trends<'_>) -> String {
    let verdict = night.verdict.name();
    let subject = format!("{} on {}, {}", night.suite, night.rig, night.started);
    let is_emulated = night.rig_kind == "emulated";
    let bench = if is_emulated { " (emulated bench)" } else { "" };
    let mut banners = Vec::new();
    if is_emulated {
        banners.push(Banner::stand_in("emulated"));
    }
    if !night.finished {
        let words =
            "The night is still running, or its process died; the results shown were measured.";
        banners.push(Banner::alert("unfinished", "Unfinished", words));
    }
    if let Some(why) = &night.ended_early {
        banners.push(Banner::alert(
            "ended-early",
            "Ended early",
            format!("{why}."),
        ));
    }
    let pill = format!("pill big {verdict}");
    let exit = format!("exit {}", night.exit as u8);
    Document {
        title: format!("{verdict} · {subject} · skinrig night"),
        brand: "skinrig nightly check",
        heading: trends.headline(night),
        heading_id: "headline",
        subheads: vec![Text::from(&*subject).line_break().add(text::tally(night))],
        badges: vec![
            Text::new().named("verdict", &pill, verdict),
            Text::new().span("badge", exit),
        ],
        banners,
        skip: ("#checks", "Skip to the checks"),
        sections: vec![
            Section::new("places", "Where to look")
                .hide_heading()
                .with(Group::new("places").with_all(cause_cards(night, trends))),
            trends.section(),
            Section::new("time", "Time")
                .hide_heading()
                .with(time(night)),
            checks(night),
            Section::new("versions", "Versions").with(Group::card().with(versions(night))),
        ],
        about: format!("Night {}{bench}.", night.id),
        styles: vec![ALARM_CSS, CSS],
        script: SCRIPT.to_owned(),
        ..Document::default()
    }
    .html()
}

/// Status of the four possible causes.
fn cause_cards(night: &Night, trends: Trends<'_>) -> impl Iterator<Item = Group> {
    let named = text::causes(night);
    let causes = [
        (Cause::Rig, "Rig"),
        (Cause::Skin, "Skin"),
        (Cause::Infrastructure, "Computer and cables"),
        (Cause::Software, "Software"),
    ];
    (1..).zip(causes).map(move |(k, (cause, name))| {
        let at_fault = named.iter().find(|(c, _)| *c == cause);
        let (state, status) = if at_fault.is_some() {
            ("bad", "look here")
        } else if cause == Cause::Skin {
            skin_status(night)
        } else if cause == Cause::Rig && night.checks.iter().all(|c| c.attempts.is_empty()) {
            ("unknown", "not checked")
        } else {
            ("ok", "nothing found")
        };
        let (moved, trend) = trends.of(cause).unzip();
        let moved = if moved == Some(true) { "moved" } else { "" };
        let mut card = Group::titled(name)
            .class("place")
            .class(state)
            .class(moved)
            .test_id(format!("place-{k}"))
            .with(Block::Text("state", status.into()))
            .with_all(trend.map(|trend| Block::Text("trend", trend.into())));
        for check in at_fault.iter().flat_map(|(_, checks)| checks) {
            let link = Text::new().link(format!("#{}", check.name), &check.title);
            card = card.with(Block::Text("link", link));
        }
        card
    })
}

/// Status of the skin if no check blames it.
fn skin_status(night: &Night) -> (&'static str, &'static str) {
    let golden = night.checks.iter().find(|c| c.name == "golden");
    match golden {
        None => ("unknown", "not part of this suite"),
        Some(c) if c.verdict == Verdict::Skipped => ("unknown", "not checked"),
        Some(c) if c.verdict.is_good() => ("ok", "within limits"),
        Some(_) => ("unknown", "unknown: its campaign is not usable tonight"),
    }
}

/// A bar of which this share, 0 to 1, is filled.
fn track(class: &str, share: f64) -> String {
    let percent = (100.0 * share).clamp(0.0, 100.0);
    format!(
        "<span class=\"track\" aria-hidden=\"true\"><i class=\"{class}\" style=\"width:{percent:.1}%\"></i></span>"
    )
}

fn time(night: &Night) -> Group {
    let share = |seconds: f64| seconds / night.budget_s.max(1e-9);
    let bars = Text::new()
        .span("soft", format!("took {}", text::span(night.took_s)))
        .drawing(track("", share(night.took_s)))
        .span("soft", format!("planned {}", text::span(night.planned_s)))
        .drawing(track("thin", share(night.planned_s)));
    let mut about = Text::from(format!("of a budget of {}", text::span(night.budget_s)));
    if let Some(golden) = &night.golden {
        about = about.dot().add("golden session: ");
        if let Some(report) = &golden.report {
            about = about
                .named_link("golden-report", report, "report")
                .add(", ");
        }
        about = about.link(&golden.session, "data");
    }
    if let Some(note) = &night.lease_note {
        about = about.dot().add(format!("lease: {note}"));
    }
    Group::card()
        .with(Block::Text("time", bars))
        .with(soft(about))
}

fn checks(night: &Night) -> Section {
    let longest_s = night.checks.iter().map(text::took_s).fold(0.0, f64::max);
    let cards = night.checks.iter().map(|c| check_card(c, longest_s));
    Section::new("checks", "Checks").tools(ALL).with_all(cards)
}

fn check_card(c: &CheckResult, longest_s: f64) -> Group {
    let (verdict, took_s) = (c.verdict.name(), text::took_s(c));
    let mut title = Text::new().span("title", &*c.title);
    let why = text::why_in_words(c);
    for why in [&why, &c.repeats, &c.skipped].into_iter().flatten() {
        title = title.span("why", &**why);
    }
    let took = match c.attempts.len() {
        0 => String::new(),
        _ => text::span(took_s),
    };
    let planned = format!("planned {}", text::span(c.planned_s));
    let summary = Text::new()
        .span(format!("pill {verdict}"), verdict)
        .span("", title)
        .drawing(track("", took_s / longest_s.max(1e-9)))
        .span("took", Text::new().titled(&planned, took));
    let is_several = c.attempts.len() > 1;
    let mut inside = Group::new("inside");
    for (n, attempt) in (1..).zip(&c.attempts) {
        if is_several {
            let verdict = attempt.verdict.name();
            let heading = Text::from(format!("attempt {n} "))
                .span(format!("pill {verdict}"), verdict)
                .add(format!(" {}", text::span(attempt.took_s)));
            inside = inside.with(Block::Heading("h4", heading));
        }
        let caption = format!("{}, attempt {n}", c.title);
        inside = inside
            .with(measurements(attempt, caption))
            .with_all(evidence(attempt));
    }
    Group::folded(summary)
        .class("card check")
        .id(&*c.name)
        .test_id(format!("check-{}", c.name))
        .open(!matches!(c.verdict, Verdict::Pass | Verdict::Skipped))
        .with_all((!inside.is_empty()).then_some(inside))
}

fn measurements(attempt: &Attempt, caption: String) -> Table {
    let parts = attempt.parts.iter();
    let rows = parts.flat_map(|p| p.measurements.iter().map(|m| row(&p.subject, m)));
    let columns = [
        Column::new("Device").class("nowrap"),
        Column::new("Measured"),
        Column::new("Value").class("num nowrap"),
        Column::new("").class("gauge"),
        Column::new("Allowed"),
        Column::new("95 % interval").class("soft"),
        Column::new("Verdict").class("verdict"),
        Column::new("Remark").class("soft"),
    ];
    Table::of("measurements", caption, columns).with(rows)
}

fn row(subject: &str, m: &Measurement) -> Row {
    let samples = match m.n {
        Some(n) if n < m.needs => format!("{n} of {} samples", m.needs),
        Some(n) => format!("n = {n}"),
        None => String::new(),
    };
    let parts = [m.note.clone().unwrap_or_default(), samples];
    let note: Vec<String> = parts.into_iter().filter(|p| !p.is_empty()).collect();
    let amount = |v| text::amount(Some(v), &m.unit);
    let limit = m.limit.as_ref();
    let verdict = limit.map_or("", |_| m.verdict.name());
    let interval = m.interval.map_or_else(String::new, |[low, high]| {
        format!("{} to {}", amount(low), amount(high))
    });
    let limit = limit.map_or_else(|| "no limit".to_owned(), |l| text::limit(l, &m.unit));
    Row::new([
        phrase(subject).into(),
        phrase(&m.metric).into(),
        m.value
            .map_or_else(|| "not measured".to_owned(), amount)
            .into(),
        Text::new().drawing(bars::bar(m).unwrap_or_default()),
        limit.into(),
        interval.into(),
        Text::from(verdict),
        note.join("; ").into(),
    ])
    .class(verdict)
}

fn evidence(attempt: &Attempt) -> impl Iterator<Item = Note> {
    let tone = if attempt.verdict.is_good() {
        Tone::Warning
    } else {
        Tone::Bad
    };
    attempt.evidence.iter().map(move |e| {
        let mut what = Text::from(&*e.what);
        if let Some(next) = &e.next {
            what = what.line_break().bold("Next:").add(format!(" {next}"));
        }
        let label = format!("{}: {}.", phrase(&e.subject), e.kind.name());
        Note::new(capital(&label), what).tone(tone)
    })
}

fn versions(night: &Night) -> Block {
    let analysis = match night.versions.analysis {
        0 => "not used".to_owned(),
        version => format!("version {version}"),
    };
    let mut facts = vec![
        Fact::new("Software", &*night.versions.software),
        Fact::new("Analysis", analysis),
    ];
    let firmware = night.versions.firmware.iter();
    facts.extend(firmware.map(|(device, version)| Fact::new(device, &**version)));
    let skin = night.versions.skin.iter();
    facts.extend(skin.map(|skin| Fact::new("Golden skin", &**skin)));
    for (key, digest) in [
        ("Suite, SHA-256", &night.suite_sha256),
        ("Rig file, SHA-256", &night.rig_sha256),
    ] {
        facts.push(Fact::new(key, Text::new().code(&**digest)).wide(true));
    }
    Block::Facts(facts)
}
