//! Owns the question before all others: may these skins be compared at all.
//!
//! Every fact in which the skins differ is a [`Difference`] with what it is worth: harmless, confounding (the difference of
//! the skins may be its doing), or blocking (no comparison unless it is lifted by name). `rules` says which fact is which;
//! `checks` looks at what cannot be told from single facts.

mod checks;
mod difference;
mod rules;
mod sights;

use std::collections::BTreeSet;

use crate::places::Places;
use crate::subject::{Session, Subject, joined};
pub use difference::{Difference, Weight};
pub use rules::{RULES, Rule};

/// Everything in which the skins differ, the gravest first. `lifted`: keys of blocking ones to go on in spite of.
#[must_use]
pub fn differences(subjects: &[Subject], lifted: &[String]) -> Vec<Difference> {
    let places = Places::of(subjects);
    let mut found = checks::all(subjects, &places);
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
            values: values.iter().map(joined).collect(),
            weight: rule.weight,
            reason: rule.reason.to_owned(),
            next: rule.next.map(str::to_owned),
            lifted: false,
        });
    }
    for difference in &mut found {
        difference.lifted =
            difference.weight == Weight::Blocking && lifted.iter().any(|k| k == difference.key);
    }
    found.sort_by(|a, b| (a.weight, a.key, &a.what).cmp(&(b.weight, b.key, &b.what)));
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

/// The settings of a session's analysis and what became of its calibration, as facts.
fn settings_of(session: &Session) -> Vec<(String, String)> {
    let analysis = &session.analysis;
    let mut facts = Vec::new();
    if let Ok(settings) = serde_json::to_value(&analysis.settings) {
        crate::flat::flatten("analysis", &settings, &mut facts);
    }
    let calibration = analysis.calibration.as_ref();
    let origin = calibration.map_or("the drawn geometry", |_| "the session's own presses");
    facts.push(("calibration.origin".to_owned(), origin.to_owned()));
    if let Some(c) = calibration {
        facts.push(("calibration.model".to_owned(), crate::flat::word(&c.model)));
        facts.push(("calibration.lens".to_owned(), crate::flat::word(&c.lens)));
    }
    facts
}
