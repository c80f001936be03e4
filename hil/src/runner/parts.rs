//! The runner: groups the values of an attempt by device, adds their limits, and marks missing
//! values as unmeasured.

use skinrig_nightly::{Evidence, EvidenceKind, Measurement, Part, Verdict};
use skinrig_protocol::suite::{Check, Measure};

use crate::findings::{Findings, Value};

const CAMERAS: &[&str] = &["camera1", "camera2"];
/// Order of the parts in results.
const ORDER: &[&str] = &[
    "robot",
    "camera1",
    "camera2",
    "trigger box",
    "computer",
    "skin",
];
/// Subject of an unmeasured metric that could belong to any device.
const ANY_DEVICE: &[&str] = &["bench"];

/// Devices on which a check must measure `metric`.
fn expected_subjects(measure: &Measure, metric: &str, has_box: bool) -> &'static [&'static str] {
    match measure {
        Measure::Identity if has_box => &["robot", "camera1", "camera2", "trigger box"],
        Measure::Identity => &["robot", "camera1", "camera2"],
        // The offset is between the two cameras.
        Measure::Clocks { .. } if metric == "offset" => ANY_DEVICE,
        Measure::Settings
        | Measure::TriggerLoopback { .. }
        | Measure::Clocks { .. }
        | Measure::Idle { .. }
        | Measure::Noise { .. }
        | Measure::TestPattern { .. } => CAMERAS,
        Measure::Disk { .. } => &["computer"],
        Measure::Golden { .. } | Measure::Reaction { .. } => &["skin"],
        Measure::RobotState
        | Measure::Repeatability { .. }
        | Measure::StepResponse { .. }
        | Measure::Depth { .. }
        | Measure::ForceCeiling { .. }
        | Measure::WatchdogDrill
        | Measure::StopDrill => &["robot"],
    }
}

/// Groups the values of an attempt. An unknown metric, or one measured twice, is a bug in a check:
/// it goes to `found.evidence` and to no part.
pub(super) fn group_by_device(check: &Check, findings: &mut Findings, has_box: bool) -> Vec<Part> {
    let mut faults = Vec::new();
    let mut parts: Vec<Part> = Vec::new();
    for value in &findings.values {
        let known = check.metrics.iter().any(|m| m.name == value.metric);
        let twice = has_measurement(&parts, &value.subject, value.metric);
        if !known || twice {
            let what = if twice {
                "measured twice"
            } else {
                "unknown metric"
            };
            faults.push(format!(
                "{}: {} of {}: {what}",
                check.name, value.metric, value.subject
            ));
            continue;
        }
        add(&mut parts, &value.subject, measurement(check, value));
    }
    for metric in check.metrics {
        if !check.limits.contains_key(metric.name) {
            continue;
        }
        let expected = expected_subjects(&check.measure, metric.name, has_box);
        let anywhere = parts
            .iter()
            .any(|p| p.measurements.iter().any(|m| m.metric == metric.name));
        for subject in expected {
            let is_present = has_measurement(&parts, subject, metric.name)
                || (expected == ANY_DEVICE && anywhere);
            if !is_present {
                let missing = Value {
                    subject: (*subject).to_owned(),
                    metric: metric.name,
                    value: None,
                    interval: None,
                    n: None,
                    needs: 0,
                    note: None,
                };
                add(&mut parts, subject, measurement(check, &missing));
            }
        }
    }
    for what in faults {
        findings
            .evidence
            .push(Evidence::new(EvidenceKind::Software, "computer", what));
    }
    let place = |name: &str| ORDER.iter().position(|o| *o == name);
    parts.sort_by_key(|p| place(&p.subject).unwrap_or(ORDER.len()));
    let rank = |metric: &str| check.metrics.iter().position(|m| m.name == metric);
    for part in &mut parts {
        part.measurements.sort_by_key(|m| rank(&m.metric));
        part.verdict = Verdict::worst(part.measurements.iter().map(|m| m.verdict));
    }
    parts
}

fn has_measurement(parts: &[Part], subject: &str, metric: &str) -> bool {
    let part = parts.iter().find(|p| p.subject == subject);
    part.is_some_and(|p| p.measurements.iter().any(|m| m.metric == metric))
}

fn add(parts: &mut Vec<Part>, subject: &str, measurement: Measurement) {
    match parts.iter_mut().find(|p| p.subject == subject) {
        Some(part) => part.measurements.push(measurement),
        None => parts.push(Part {
            subject: subject.to_owned(),
            measurements: vec![measurement],
            verdict: Verdict::Fail,
        }),
    }
}

fn measurement(check: &Check, value: &Value) -> Measurement {
    let metric = check.metrics.iter().find(|m| m.name == value.metric);
    let limit = check.limits.get(value.metric).copied();
    // JSON has no NaN or infinity: store such a value as unmeasured and put it into the note.
    let number = value.value.filter(|v| v.is_finite());
    let non_finite = value.value.filter(|v| !v.is_finite());
    Measurement {
        metric: value.metric.to_owned(),
        value: number,
        unit: metric.map_or("", |m| m.unit).to_owned(),
        interval: value.interval.filter(|i| i.iter().all(|v| v.is_finite())),
        n: value.n,
        needs: value.needs,
        limit,
        verdict: Verdict::of_measurement(number, value.n, value.needs, limit.as_ref()),
        note: match (&value.note, non_finite) {
            (Some(note), Some(non_finite)) => Some(format!("{note}; measured {non_finite}")),
            (None, Some(non_finite)) => Some(format!("measured {non_finite}")),
            (note, None) => note.clone(),
        },
    }
}
