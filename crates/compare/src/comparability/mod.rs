//! Decides whether skins may be compared at all.
//!
//! Every fact in which the skins differ is a [`Difference`] with a severity: harmless, confounding (it may cause the
//! result), or blocking (no comparison unless overridden by key). `rules` classifies single facts; `checks` covers what
//! needs more than one fact.

mod calibration_checks;
mod camera_checks;
mod checks;
mod difference;
mod label;
mod rules;
mod share_checks;

use std::collections::{BTreeMap, BTreeSet};

use skinrig_analysis::Analysis;

use crate::locations::Locations;
use crate::subject::{SessionFacts, Subject, join_values};
pub use difference::{Difference, Severity};
pub use rules::{RULES, Rule};

/// All differences between the skins, most severe first. `overrides`: keys of blocking differences to ignore.
#[must_use]
pub fn differences(subjects: &[Subject], overrides: &[String]) -> Vec<Difference> {
    let locations = Locations::of(subjects);
    let mut found = checks::all(subjects, &locations);
    let sides: Vec<Vec<_>> = subjects
        .iter()
        .map(|subject| {
            let sessions = subject.sessions.iter();
            sessions
                .map(|s| facts_of(&s.facts, Some(&s.analysis)))
                .collect()
        })
        .collect();
    let sessions = subjects.iter().flat_map(|s| &s.sessions);
    found.extend(of_facts(&sides, &docs(sessions.map(|s| &s.facts))));
    for difference in &mut found {
        difference.overridden = difference.severity == Severity::Blocking
            && !difference.is_final
            && overrides.iter().any(|k| k == difference.key);
    }
    found.sort_by(|a, b| (a.severity, a.key, &a.what).cmp(&(b.severity, b.key, &b.what)));
    found
}

/// Settings and other facts in which two sessions differ, most severe first, and the number of facts. Those of the analysis are left out
/// unless both have one.
#[must_use]
pub fn fact_differences(
    sessions: [(&SessionFacts, Option<&Analysis>); 2],
) -> (Vec<Difference>, usize) {
    let both = sessions.iter().all(|(_, analysis)| analysis.is_some());
    let sides = sessions.map(|(facts, analysis)| vec![facts_of(facts, analysis.filter(|_| both))]);
    let mut found = of_facts(&sides, &docs(sessions.into_iter().map(|(facts, _)| facts)));
    found.sort_by(|a, b| (a.severity, a.key, &a.what).cmp(&(b.severity, b.key, &b.what)));
    let names: BTreeSet<&String> = sides.iter().flatten().flat_map(BTreeMap::keys).collect();
    (found, names.len())
}

type Facts = BTreeMap<String, String>;

/// Differences between sides with one or more sessions each.
fn of_facts(sides: &[Vec<Facts>], docs: &BTreeMap<&String, &String>) -> Vec<Difference> {
    let names: BTreeSet<&String> = sides.iter().flatten().flat_map(BTreeMap::keys).collect();
    let mut found = Vec::new();
    for name in names {
        let of = |facts: &Facts| facts.get(name).map_or("none", String::as_str).to_owned();
        let values: Vec<BTreeSet<String>> =
            sides.iter().map(|s| s.iter().map(of).collect()).collect();
        let Some(rule) = rules::rule_of(name) else {
            continue;
        };
        if values.iter().all(|v| v.len() == 1 && *v == values[0]) {
            continue;
        }
        found.push(Difference {
            key: rule.key,
            what: label::label(name, docs.get(name).map(|doc| doc.as_str())),
            fact: Some(name.clone()),
            values: values.iter().map(join_values).collect(),
            severity: rule.severity,
            reason: rule.reason.to_owned(),
            next: rule.next.map(str::to_owned),
            is_final: false,
            overridden: false,
        });
    }
    found
}

fn docs<'a>(all: impl Iterator<Item = &'a SessionFacts>) -> BTreeMap<&'a String, &'a String> {
    all.flat_map(|facts| &facts.docs).collect()
}

/// Facts of a session with those of its analysis.
fn facts_of(facts: &SessionFacts, analysis: Option<&Analysis>) -> Facts {
    let mut all = facts.values.clone();
    for (name, value) in analysis.into_iter().flat_map(settings_of) {
        all.entry(name).or_insert(value);
    }
    all
}

/// Settings, calibration and locator of an analysis, as facts.
fn settings_of(analysis: &Analysis) -> Vec<(String, String)> {
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
        facts.push(("calibration.model".to_owned(), c.model.label().to_owned()));
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
