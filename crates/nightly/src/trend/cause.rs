//! What probably moved the series of an alarm: rules over what changed that night and which series moved, first that applies.

use serde::Serialize;

use super::history::NightHead;
use crate::cause::Cause;

/// What is said of an alarm.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Attribution {
    /// Where to look; `None`: the rules do not tell.
    pub cause: Option<Cause>,
    /// The rule that said so.
    pub rule: &'static str,
    /// For people.
    pub reason: String,
    /// What is not as it was before: `software 0.1.0 (a) -> 0.1.0 (b)`.
    pub changed: Vec<String>,
}

/// A kind of thing that can change between two nights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Software,
    Suite,
    Firmware,
    RigFile,
    Skin,
}

/// What a series is about, told by its check.
#[must_use]
pub fn about(series: &str) -> Cause {
    let mut parts = series.split('/');
    match (parts.next().unwrap_or_default(), parts.next()) {
        ("golden", _) | ("derived", Some("skin")) => Cause::Skin,
        ("disk", _) | (_, Some("computer")) => Cause::Infrastructure,
        _ => Cause::Rig,
    }
}

/// What moved `series` between the nights `before` and `after`.
pub(super) fn attribute(before: &NightHead, after: &NightHead, series: &[&str]) -> Attribution {
    let changes = changes(before, after);
    let changed: Vec<String> = changes.iter().map(|(_, text)| text.clone()).collect();
    let has = |part| changes.iter().any(|(p, _)| *p == part);
    let all = |cause| series.iter().all(|s| about(s) == cause);
    let any = |cause| series.iter().any(|s| about(s) == cause);
    let (cause, rule, reason) = if has(Part::Skin) && all(Cause::Skin) {
        (
            Some(Cause::Skin),
            "another-skin",
            "another skin was put on, and only series of the skin moved",
        )
    } else if has(Part::Software) {
        (
            Some(Cause::Software),
            "software-changed",
            "the software changed at that time",
        )
    } else if has(Part::Suite) {
        (
            Some(Cause::Software),
            "suite-changed",
            "the suite changed at that time: what is measured is not what was",
        )
    } else if has(Part::Firmware) {
        (
            Some(Cause::Rig),
            "firmware-changed",
            "firmware changed at that time",
        )
    } else if has(Part::RigFile) {
        (
            Some(Cause::Rig),
            "rig-file-changed",
            "the rig file changed at that time",
        )
    } else if has(Part::Skin) {
        (
            Some(Cause::Skin),
            "skin-among-others",
            "another skin was put on at that time; series of the rig moved too",
        )
    } else if all(Cause::Infrastructure) {
        (
            Some(Cause::Infrastructure),
            "only-computer-series",
            "no version changed, and only series of the computer moved",
        )
    } else if all(Cause::Skin) {
        (
            Some(Cause::Skin),
            "only-skin-series",
            "no version changed, and only series of the skin moved",
        )
    } else if any(Cause::Rig) {
        (
            Some(Cause::Rig),
            "rig-series",
            "no version changed, and series that need no skin moved",
        )
    } else {
        (
            None,
            "mixed",
            "no version changed, and series of different things moved",
        )
    };
    Attribution {
        cause,
        rule,
        reason: reason.to_owned(),
        changed,
    }
}

fn changes(before: &NightHead, after: &NightHead) -> Vec<(Part, String)> {
    let mut found = Vec::new();
    let mut differ = |part, what: &str, a: &str, b: &str| {
        if a != b {
            found.push((part, format!("{what} {a} -> {b}")));
        }
    };
    let (a, b) = (&before.versions, &after.versions);
    differ(Part::Software, "software", &a.software, &b.software);
    let (old, new) = (a.analysis.to_string(), b.analysis.to_string());
    differ(Part::Software, "analysis", &old, &new);
    differ(
        Part::Suite,
        "suite",
        short(&before.suite_sha256),
        short(&after.suite_sha256),
    );
    for (device, new) in &b.firmware {
        // A device that did not answer has no firmware that night, which is no change of it.
        if let Some((_, old)) = a.firmware.iter().find(|(d, _)| d == device) {
            differ(Part::Firmware, &format!("firmware of {device}"), old, new);
        }
    }
    differ(
        Part::RigFile,
        "rig file",
        short(&before.rig_sha256),
        short(&after.rig_sha256),
    );
    if let (Some(old), Some(new)) = (&a.skin, &b.skin) {
        differ(Part::Skin, "skin", old, new);
    }
    found
}

/// The beginning of a digest.
fn short(digest: &str) -> &str {
    digest.get(..8).unwrap_or(digest)
}
