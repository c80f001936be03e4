//! Decides whether skins may be compared at all.
//!
//! Every fact in which the skins differ is a [`Difference`] with a severity: harmless, confounding (it may cause the
//! result), or blocking (no comparison unless overridden by key). `rules` classifies single facts; `checks` covers what
//! needs more than one fact.

mod camera_checks;
mod checks;
mod difference;
mod rules;

use std::collections::BTreeSet;

use crate::locations::Locations;
use crate::subject::{Session, Subject, join_values};
pub use difference::{Difference, Severity};
pub use rules::{RULES, Rule};

/// All differences between the skins, most severe first. `overrides`: keys of blocking differences to ignore.
#[must_use]
pub fn differences(subjects: &[Subject], overrides: &[String]) -> Vec<Difference> {
    let locations = Locations::of(subjects);
    let mut found = checks::all(subjects, &locations);
    let mut names: BTreeSet<String> = BTreeSet::new();
    for session in subjects.iter().flat_map(|s| &s.sessions) {
        names.extend(session.facts.values.keys().cloned());
        names.extend(settings_of(session).into_iter().map(|(name, _)| name));
    }
    for name in names {
        let of = |session: &Session| fact(session, &name);
        let values: Vec<BTreeSet<String>> = subjects.iter().map(|s| s.fact(of)).collect();
        let Some(rule) = rules::rule_of(&name) else {
            continue;
        };
        if values.iter().all(|v| v.len() == 1 && *v == values[0]) {
            continue;
        }
        found.push(Difference {
            key: rule.key,
            what: name.clone(),
            values: values.iter().map(join_values).collect(),
            severity: rule.severity,
            reason: rule.reason.to_owned(),
            next: rule.next.map(str::to_owned),
            overridden: false,
        });
    }
    for difference in &mut found {
        difference.overridden = difference.severity == Severity::Blocking
            && overrides.iter().any(|k| k == difference.key);
    }
    found.sort_by(|a, b| (a.severity, a.key, &a.what).cmp(&(b.severity, b.key, &b.what)));
    found
}

fn fact(session: &Session, name: &str) -> Option<String> {
    let of_settings = || settings_of(session).into_iter().find(|(n, _)| n == name);
    session
        .facts
        .values
        .get(name)
        .cloned()
        .or_else(|| of_settings().map(|(_, value)| value))
}

/// Analysis settings, calibration and locator of a session, as facts.
fn settings_of(session: &Session) -> Vec<(String, String)> {
    let analysis = &session.analysis;
    let mut facts = Vec::new();
    if let Ok(settings) = serde_json::to_value(&analysis.settings) {
        crate::flatten::flatten("analysis", &settings, &mut facts);
    }
    let calibration = analysis.calibration.as_ref();
    let origin = match (calibration, &analysis.recalibration) {
        (None, _) => "nominal geometry",
        (Some(_), None) => "the session's own presses",
        (Some(_), Some(_)) => "an earlier session, corrected",
    };
    facts.push(("calibration.origin".to_owned(), origin.to_owned()));
    if let Some(c) = calibration {
        facts.push((
            "calibration.model".to_owned(),
            crate::flatten::variant_name(&c.model),
        ));
        facts.push((
            "calibration.lens".to_owned(),
            crate::flatten::variant_name(&c.lens),
        ));
    }
    if let Some(locator) = &analysis.locator {
        facts.push(("locator.used".to_owned(), locator.locator.name().to_owned()));
    }
    facts
}
