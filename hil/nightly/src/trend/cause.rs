//! Attributes an alarm to a probable cause: the first matching rule over version changes and affected series.

use serde::Serialize;

use super::history::NightSummary;
use crate::cause::Cause;

/// Probable cause of an alarm.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Attribution {
    /// Where to look; `None`: the rules do not decide.
    pub cause: Option<Cause>,
    /// Name of the applied rule.
    pub rule: &'static str,
    /// Explanation for the reader.
    pub reason: String,
    /// Version changes at that time: `software 0.1.0 (a) -> 0.1.0 (b)`.
    pub changed: Vec<String>,
}

/// A part of the setup whose version can change between two nights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Component {
    Software,
    Suite,
    Firmware,
    RigFile,
    Skin,
}

/// Whether a series is of a check that presses the skin.
fn touches_the_skin(series: &str) -> bool {
    let check = series.split('/').next().unwrap_or_default();
    series_cause(series) == Cause::Skin || matches!(check, "depth" | "force_ceiling")
}

/// Cause that a series points to, according to its check.
#[must_use]
pub(crate) fn series_cause(series: &str) -> Cause {
    let mut parts = series.split('/');
    match (parts.next().unwrap_or_default(), parts.next()) {
        ("golden" | "reaction", _) | ("derived", Some("skin")) => Cause::Skin,
        ("disk", _) | (_, Some("computer")) => Cause::Infrastructure,
        _ => Cause::Rig,
    }
}

/// Attributes a change of `series` between the nights `before` and `after`.
pub(super) fn attribute(
    before: &NightSummary,
    after: &NightSummary,
    series: &[&str],
) -> Attribution {
    let changes = changes(before, after);
    let changed: Vec<String> = changes.iter().map(|(_, text)| text.clone()).collect();
    let has = |part| changes.iter().any(|(p, _)| *p == part);
    let all = |cause| series.iter().all(|s| series_cause(s) == cause);
    let needs_no_skin = |s: &&str| series_cause(s) == Cause::Rig && !touches_the_skin(s);
    let (cause, rule, reason) = if has(Component::Skin) && all(Cause::Skin) {
        (
            Some(Cause::Skin),
            "another-skin",
            "the skin was replaced, and only series of the skin moved",
        )
    } else if has(Component::Software) {
        (
            Some(Cause::Software),
            "software-changed",
            "the software changed at that time",
        )
    } else if has(Component::Suite) {
        (
            Some(Cause::Software),
            "suite-changed",
            "the suite changed at that time, so the measurements differ",
        )
    } else if has(Component::Firmware) {
        (
            Some(Cause::Rig),
            "firmware-changed",
            "firmware changed at that time",
        )
    } else if has(Component::RigFile) {
        (
            Some(Cause::Rig),
            "rig-file-changed",
            "the rig file changed at that time",
        )
    } else if has(Component::Skin) {
        (
            Some(Cause::Skin),
            "skin-among-others",
            "the skin was replaced at that time; series of the rig moved too",
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
    } else if series.iter().all(|s| touches_the_skin(s)) {
        (
            None,
            "only-touching-series",
            "no version changed, and only series of checks that press the skin moved: the skin, the arm or the frame",
        )
    } else if series.iter().any(needs_no_skin) {
        (
            Some(Cause::Rig),
            "rig-series",
            "no version changed, and series that need no skin moved",
        )
    } else {
        (
            None,
            "mixed",
            "no version changed, and unrelated series moved",
        )
    };
    Attribution {
        cause,
        rule,
        reason: reason.to_owned(),
        changed,
    }
}

fn changes(before: &NightSummary, after: &NightSummary) -> Vec<(Component, String)> {
    let mut differences = Vec::new();
    let mut differ = |part, what: &str, a: &str, b: &str| {
        if a != b {
            differences.push((part, format!("{what} {a} -> {b}")));
        }
    };
    let (a, b) = (&before.versions, &after.versions);
    differ(Component::Software, "software", &a.software, &b.software);
    let (old, new) = (a.analysis.to_string(), b.analysis.to_string());
    differ(Component::Software, "analysis", &old, &new);
    differ(
        Component::Suite,
        "suite",
        short(&before.suite_sha256),
        short(&after.suite_sha256),
    );
    for (device, new) in &b.firmware {
        // A device that did not respond has no firmware entry that night; that is not a firmware change.
        if let Some((_, old)) = a.firmware.iter().find(|(d, _)| d == device) {
            differ(
                Component::Firmware,
                &format!("firmware of {device}"),
                old,
                new,
            );
        }
    }
    differ(
        Component::RigFile,
        "rig file",
        short(&before.rig_sha256),
        short(&after.rig_sha256),
    );
    if let (Some(old), Some(new)) = (&a.skin, &b.skin) {
        differ(Component::Skin, "skin", old, new);
    }
    differences
}

/// First digits of a digest.
fn short(digest: &str) -> &str {
    digest.get(..8).unwrap_or(digest)
}
