//! Writes a simulated history of 120 nights, to view trends without waiting for months: `cargo run
//! -p skinrig-hil --example simulated_history -- FOLDER`. A lamp weakens at night 90, the skin at
//! night 112.
#![expect(
    clippy::unwrap_used,
    reason = "an example may panic if it cannot write"
)]

#[path = "../nightly/tests/nightly/trend/nights.rs"]
#[expect(dead_code, reason = "written for tests, which use more of it")]
mod nights;

use std::path::Path;

use nights::{Bench, DrawnValue, PlantedChange, head};
use skinrig_hil::history::append;
use skinrig_model::Limit;
use skinrig_nightly::night::{Attempt, CheckResult, Measurement, NIGHT_VERSION, Part};
use skinrig_nightly::{Night, NightExit, Verdict};

fn main() {
    let folder = std::env::args().nth(1).unwrap();
    write(Path::new(&folder));
}

/// Writes the nights and their history into `folder`.
pub(crate) fn write(folder: &Path) {
    let mut bench = Bench::new(7);
    for (series, from, factor) in [
        ("noise_lit/camera2/rate", 90, 0.7),
        ("golden/skin/press_events", 112, 0.85),
        ("golden/skin/located", 112, 0.9),
    ] {
        bench.planted.push(PlantedChange {
            series,
            from,
            factor,
            growth: 0.0,
        });
    }
    for at in 0..120 {
        let Some(drawn) = bench.night(at) else {
            continue;
        };
        let night = night(at, &drawn);
        let night_folder = folder.join(&night.id);
        std::fs::create_dir_all(&night_folder).unwrap();
        let json = serde_json::to_string_pretty(&night).unwrap();
        std::fs::write(night_folder.join("night.json"), json).unwrap();
        append(&folder.join("history.sqlite"), &night, &night_folder).unwrap();
    }
}

/// A night with these values.
fn night(at: usize, drawn: &[DrawnValue<'_>]) -> Night {
    let head = head(at);
    let mut versions = head.versions;
    if at >= 90 {
        versions.firmware = vec![("camera1".to_owned(), "4.0".to_owned())];
    }
    let mut checks: Vec<CheckResult> = Vec::new();
    for value in drawn {
        let mut names = value.name.split('/');
        let mut name = || names.next().unwrap().to_owned();
        let (check, subject, metric) = (name(), name(), name());
        let at = checks.iter().position(|c| c.name == check);
        let at = at.unwrap_or_else(|| {
            checks.push(blank(check));
            checks.len() - 1
        });
        let parts = &mut checks[at].attempts[0].parts;
        let at = parts.iter().position(|p| p.subject == subject);
        let at = at.unwrap_or_else(|| {
            parts.push(Part {
                subject,
                measurements: Vec::new(),
                verdict: value.verdict,
            });
            parts.len() - 1
        });
        let limit = (value.name == "golden/skin/located").then(|| Limit::at_least(80.0));
        parts[at].measurements.push(Measurement {
            metric,
            value: Some(value.value),
            unit: value.unit.to_owned(),
            interval: None,
            n: value.n,
            needs: 0,
            limit,
            verdict: value.verdict,
            note: None,
        });
    }
    for check in &mut checks {
        let attempt = &mut check.attempts[0];
        attempt.verdict = Verdict::worst(attempt.parts.iter().map(|p| p.verdict));
        check.verdict = attempt.verdict;
    }
    let mut night = Night {
        version: NIGHT_VERSION,
        id: format!("{}-nightly", head.started.replace(':', "-")),
        suite: head.suite,
        suite_sha256: head.suite_sha256,
        rig: head.rig,
        rig_kind: head.rig_kind,
        rig_sha256: head.rig_sha256,
        versions,
        started: head.started,
        took_s: 600.0,
        planned_s: 500.0,
        budget_s: 1200.0,
        finished: true,
        ended_early: None,
        lease_note: None,
        notifications: Vec::new(),
        checks,
        golden: None,
        verdict: Verdict::Pass,
        exit: NightExit::Pass,
    };
    night.update_verdict();
    night
}

/// A check with one attempt and no values.
fn blank(name: String) -> CheckResult {
    CheckResult {
        title: name.clone(),
        name,
        planned_s: 30.0,
        attempts: vec![Attempt {
            began_s: 0.0,
            took_s: 30.0,
            parts: Vec::new(),
            evidence: Vec::new(),
            verdict: Verdict::Pass,
            cause: None,
            rule: None,
        }],
        skipped: None,
        verdict: Verdict::Pass,
        repeats: None,
        cause: None,
        rule: None,
        witnesses: Vec::new(),
    }
}
