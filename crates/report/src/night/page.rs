//! Owns the HTML page of a night: inputs of its template.

use minijinja::value::Serde;
use minijinja::{Value, context};
use serde::Serialize;
use skinrig_nightly::{Attempt, Cause, CheckResult, Measurement, Night, Verdict};

use super::trends::Trends;
use super::{bars, text};
use crate::error::ReportError;
use crate::format::phrase;
use crate::frame::Frame;
use crate::trend::{ALARM_CSS, ALARM_TEMPLATE};

const TEMPLATE: &str = include_str!("../../assets/night/page.html");
const CSS: &str = include_str!("../../assets/night/page.css");
const SCRIPT: &str = include_str!("../../assets/night/page.js");

/// One of the four possible causes, as a card.
#[derive(Serialize)]
struct CauseCard {
    name: &'static str,
    state: &'static str,
    status: String,
    moved: Option<bool>,
    trend: Option<String>,
    checks: Vec<CheckLink>,
}

/// Link to a check.
#[derive(Serialize)]
struct CheckLink {
    id: String,
    title: String,
}

#[derive(Serialize)]
struct CheckCard {
    id: String,
    title: String,
    verdict: &'static str,
    open: bool,
    why: Option<String>,
    repeats: Option<String>,
    skipped: Option<String>,
    took: String,
    planned: String,
    share: f64,
    attempts: Vec<AttemptCard>,
}

#[derive(Serialize)]
struct AttemptCard {
    number: usize,
    verdict: &'static str,
    took: String,
    rows: Vec<Row>,
    evidence: Vec<EvidenceItem>,
}

#[derive(Serialize)]
struct Row {
    subject: String,
    metric: String,
    value: String,
    interval: String,
    limit: String,
    bar: Option<String>,
    verdict: &'static str,
    note: String,
}

#[derive(Serialize)]
struct EvidenceItem {
    subject: String,
    kind: &'static str,
    what: String,
    next: Option<String>,
}

/// The night and its trends as a self-contained HTML page. It links to the golden session's report and to the page of the
/// trends.
///
/// # Errors
/// [`ReportError`] when rendering fails; no known input causes this.
pub fn html(night: &Night, trends: Trends<'_>) -> Result<String, ReportError> {
    let frame = Frame {
        templates: &[("night.html", TEMPLATE), ("alarm.html", ALARM_TEMPLATE)],
        styles: &[ALARM_CSS, CSS],
        script: SCRIPT,
    };
    let longest = night.checks.iter().map(text::took_s).fold(0.0, f64::max);
    let checks: Vec<CheckCard> = night
        .checks
        .iter()
        .map(|c| check_card(c, longest))
        .collect();
    let share = |seconds: f64| (100.0 * seconds / night.budget_s.max(1e-9)).clamp(0.0, 100.0);
    frame.render(context! {
        contents => [("places", "Where to look"), ("trends", "Trends"), ("time", "Time"), ("checks", "Checks"), ("versions", "Versions")],
        headline => trends.headline(night),
        trends => trends.value(),
        id => night.id.clone(),
        suite => night.suite.clone(),
        rig => night.rig.clone(),
        started => night.started.clone(),
        emulated => night.rig_kind == "emulated",
        verdict => night.verdict.name(),
        exit => night.exit as u8,
        good => night.verdict.is_good() && night.exit as u8 == 0,
        finished => night.finished,
        ended_early => night.ended_early.clone(),
        lease_note => night.lease_note.clone(),
        tally => text::tally(night),
        causes => Value::from(Serde(cause_cards(night, trends))),
        took => text::span(night.took_s),
        planned => text::span(night.planned_s),
        budget => text::span(night.budget_s),
        took_share => share(night.took_s),
        planned_share => share(night.planned_s),
        checks => Value::from(Serde(checks)),
        golden => night.golden.as_ref().map(|g| context! {
            session => g.session.clone(), report => g.report.clone(), results => g.results_sha256.clone(),
        }),
        software => night.versions.software.clone(),
        analysis => night.versions.analysis,
        firmware => night.versions.firmware.clone(),
        skin => night.versions.skin.clone(),
        suite_sha256 => night.suite_sha256.clone(),
        rig_sha256 => night.rig_sha256.clone(),
    })
}

/// Status of the four possible causes.
fn cause_cards(night: &Night, trends: Trends<'_>) -> Vec<CauseCard> {
    let named = text::causes(night);
    [
        (Cause::Rig, "Rig"),
        (Cause::Skin, "Skin"),
        (Cause::Infrastructure, "Computer and cables"),
        (Cause::Software, "Software"),
    ]
    .into_iter()
    .map(|(cause, name)| {
        let at_fault = named.iter().find(|(c, _)| *c == cause);
        let checks: Vec<CheckLink> = at_fault
            .map(|(_, checks)| checks.iter().map(|c| check_link(c)).collect())
            .unwrap_or_default();
        let (state, status) = if !checks.is_empty() {
            ("bad", "look here".to_owned())
        } else if cause == Cause::Skin {
            skin_status(night)
        } else if cause == Cause::Rig && night.checks.iter().all(|c| c.attempts.is_empty()) {
            ("unknown", "not checked".to_owned())
        } else {
            ("ok", "nothing found".to_owned())
        };
        let (moved, trend) = trends.of(cause).unzip();
        CauseCard {
            name,
            state,
            status,
            moved,
            trend,
            checks,
        }
    })
    .collect()
}

/// Status of the skin if no check blames it.
fn skin_status(night: &Night) -> (&'static str, String) {
    let golden = night.checks.iter().find(|c| c.name == "golden");
    match golden {
        None => ("unknown", "not part of this suite".to_owned()),
        Some(c) if c.verdict == Verdict::Skipped => ("unknown", "not checked".to_owned()),
        Some(c) if c.verdict.is_good() => ("ok", "within limits".to_owned()),
        Some(_) => (
            "unknown",
            "unknown: its campaign is not usable tonight".to_owned(),
        ),
    }
}

fn check_link(check: &CheckResult) -> CheckLink {
    CheckLink {
        id: check.name.clone(),
        title: check.title.clone(),
    }
}

fn check_card(c: &CheckResult, longest_s: f64) -> CheckCard {
    let took_s = text::took_s(c);
    CheckCard {
        id: c.name.clone(),
        title: c.title.clone(),
        verdict: c.verdict.name(),
        open: !matches!(c.verdict, Verdict::Pass | Verdict::Skipped),
        why: text::why_in_words(c),
        repeats: c.repeats.clone(),
        skipped: c.skipped.clone(),
        took: if c.attempts.is_empty() {
            String::new()
        } else {
            text::span(took_s)
        },
        planned: text::span(c.planned_s),
        share: 100.0 * took_s / longest_s.max(1e-9),
        attempts: (1..)
            .zip(&c.attempts)
            .map(|(n, a)| attempt_card(n, a))
            .collect(),
    }
}

fn attempt_card(number: usize, attempt: &Attempt) -> AttemptCard {
    let rows = attempt.parts.iter().flat_map(|part| {
        let subject = part.subject.clone();
        let of = move |m| row(&subject, m);
        part.measurements.iter().map(of)
    });
    AttemptCard {
        number,
        verdict: attempt.verdict.name(),
        took: text::span(attempt.took_s),
        rows: rows.collect(),
        evidence: attempt
            .evidence
            .iter()
            .map(|e| EvidenceItem {
                subject: phrase(&e.subject),
                kind: e.kind.name(),
                what: e.what.clone(),
                next: e.next.clone(),
            })
            .collect(),
    }
}

fn row(subject: &str, m: &Measurement) -> Row {
    let samples = match m.n {
        Some(n) if n < m.needs => format!("{n} of {} samples", m.needs),
        Some(n) => format!("n = {n}"),
        None => String::new(),
    };
    let parts = [m.note.clone().unwrap_or_default(), samples];
    let note: Vec<String> = parts.into_iter().filter(|p| !p.is_empty()).collect();
    Row {
        subject: phrase(subject),
        metric: phrase(&m.metric),
        value: match m.value {
            Some(_) => text::amount(m.value, &m.unit),
            None => "not measured".to_owned(),
        },
        interval: m.interval.map_or(String::new(), |[low, high]| {
            let of = |v| text::amount(Some(v), &m.unit);
            format!("{} to {}", of(low), of(high))
        }),
        limit: m
            .limit
            .as_ref()
            .map_or_else(|| "no limit".to_owned(), |l| text::limit(l, &m.unit)),
        bar: bars::bar(m),
        verdict: if m.limit.is_some() {
            m.verdict.name()
        } else {
            ""
        },
        note: note.join("; "),
    }
}
