//! Builders of nights, parts and attempts for tests.

use skinrig_model::Limit;
use skinrig_nightly::{
    Attempt, Cause, CheckResult, Measurement, Night, NightExit, Part, Verdict, Versions,
};

pub(crate) fn measured(metric: &str, value: Option<f64>, limit: Limit) -> Measurement {
    Measurement {
        metric: metric.to_owned(),
        value,
        unit: "s".to_owned(),
        interval: None,
        n: None,
        needs: 0,
        limit: Some(limit),
        verdict: Verdict::of_measurement(value, None, 0, Some(&limit)),
        note: None,
    }
}

pub(crate) fn part(subject: &str, measurements: Vec<Measurement>) -> Part {
    Part {
        subject: subject.to_owned(),
        verdict: Verdict::worst(measurements.iter().map(|m| m.verdict)),
        measurements,
    }
}

/// Attempts with these verdicts.
pub(crate) fn attempts(verdicts: &[Verdict]) -> Vec<Attempt> {
    let one = |verdict: &Verdict| Attempt {
        began_s: 0.0,
        took_s: 1.5,
        parts: Vec::new(),
        evidence: Vec::new(),
        verdict: *verdict,
        cause: (!verdict.is_good()).then_some(Cause::Rig),
        rule: None,
    };
    verdicts.iter().map(one).collect()
}

pub(crate) fn check(name: &str, verdict: Verdict, cause: Option<Cause>) -> CheckResult {
    CheckResult {
        name: name.to_owned(),
        title: name.replace('_', " "),
        planned_s: 2.0,
        attempts: Vec::new(),
        skipped: None,
        verdict,
        repeats: None,
        cause,
        rule: None,
        witnesses: Vec::new(),
    }
}

/// A finished night with these checks.
pub(crate) fn night(checks: Vec<CheckResult>) -> Night {
    let mut night = Night {
        version: 1,
        id: "2026-11-20T02-00-00Z-nightly".to_owned(),
        suite: "nightly".to_owned(),
        suite_sha256: "0".repeat(64),
        rig: "emulated".to_owned(),
        rig_kind: "emulated".to_owned(),
        rig_sha256: "1".repeat(64),
        versions: Versions {
            software: "skinrig 0".to_owned(),
            firmware: vec![("robot".to_owned(), "3.1".to_owned())],
            ..Versions::default()
        },
        started: "2026-11-20T02:00:00Z".to_owned(),
        took_s: 12.5,
        planned_s: 10.0,
        budget_s: 600.0,
        finished: true,
        ended_early: None,
        lease_note: None,
        notifications: Vec::new(),
        checks,
        golden: None,
        verdict: Verdict::Fail,
        exit: NightExit::Fail,
    };
    night.update_verdict();
    night
}
