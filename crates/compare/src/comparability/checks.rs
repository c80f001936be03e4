//! Owns the checks that no single fact decides: shared places and depths, alignment, results, doubles.

use std::collections::BTreeSet;

use skinrig_analysis::result::AlignmentStatus;

use super::difference::{Difference, Weight, difference};
use super::sights::{ambient, cameras};
use crate::places::Places;
use crate::subject::{Session, Subject, joined};

pub(super) fn all(subjects: &[Subject], places: &Places) -> Vec<Difference> {
    let mut found = Vec::new();
    found.extend(alignment(subjects));
    found.extend(results(subjects, places));
    found.extend(depths(subjects, places));
    found.extend(locations(subjects, places));
    found.extend(doubles(subjects));
    found.extend(seeds(subjects));
    found.extend(unsealed(subjects));
    found.extend(plausible(subjects));
    found.extend(ambient(subjects, places));
    found.extend(cameras(subjects));
    found
}

fn blocked(mut by: Difference, next: &str) -> Difference {
    by.weight = Weight::Blocking;
    by.next = Some(next.to_owned());
    by
}

fn each(subjects: &[Subject], of: impl Fn(&Session) -> String) -> Vec<String> {
    subjects
        .iter()
        .map(|s| joined(&s.fact(|x| Some(of(x)))))
        .collect()
}

fn alignment(subjects: &[Subject]) -> Option<Difference> {
    let status = |s: &Session| match s.analysis.alignment.status {
        _ if !s.analysis.is_valid() => {
            format!("INVALID: {}", s.analysis.invalid_because().join("; "))
        }
        AlignmentStatus::Valid => "certified".to_owned(),
        _ => "not certified".to_owned(),
    };
    let values = each(subjects, status);
    let is_invalid = |s: &Subject| s.sessions.iter().any(|x| !x.analysis.is_valid());
    if subjects.iter().any(is_invalid) {
        let reason = "a session is INVALID: none of its numbers is to be used";
        return Some(blocked(
            difference(
                "alignment",
                "alignment of the clocks",
                Weight::Blocking,
                values,
                reason,
            ),
            "mend what the session's report names and analyse it again, or record again",
        ));
    }
    let differ = values.iter().any(|v| *v != values[0]);
    let reason = "latencies of a session without a certificate have no stated clock error";
    differ.then(|| {
        difference(
            "certificate",
            "alignment of the clocks",
            Weight::Confounding,
            values,
            reason,
        )
    })
}

fn results(subjects: &[Subject], places: &Places) -> Option<Difference> {
    let counted = |s: &Subject| places.attempts(s).filter(|p| p.error().is_some()).count();
    let counts: Vec<usize> = subjects.iter().map(counted).collect();
    // Without a shared depth nothing is counted: that is said by itself.
    let none = counts.contains(&0) && places.shared_depths() > 0;
    none.then(|| {
        blocked(
            difference(
                "no-results",
                "scored presses that count",
                Weight::Blocking,
                counts.iter().map(ToString::to_string).collect(),
                "a skin without a located press has no error to compare",
            ),
            "`skinrig analyze` says why its presses do not count",
        )
    })
}

fn depths(subjects: &[Subject], places: &Places) -> Option<Difference> {
    let of = |s: &Subject| -> BTreeSet<String> {
        let presses = s.sessions.iter().flat_map(|s| &s.analysis.presses);
        let scored = presses.filter(|p| p.role == skinrig_model::PressRole::Score);
        scored.map(|p| format!("{} mm", p.depth_mm)).collect()
    };
    let sets: Vec<_> = subjects.iter().map(of).collect();
    if sets.iter().all(|s| *s == sets[0]) {
        return None;
    }
    let values = sets.iter().map(joined).collect();
    if places.shared_depths() == 0 {
        let reason = "deeper presses make more events: no depth is shared";
        return Some(blocked(
            difference("depths", "depths", Weight::Blocking, values, reason),
            "press both skins to the same depth",
        ));
    }
    let reason = "only the shared depths are compared";
    Some(difference(
        "depths",
        "depths",
        Weight::Harmless,
        values,
        reason,
    ))
}

fn locations(subjects: &[Subject], places: &Places) -> Option<Difference> {
    let first = subjects.first()?;
    let own = |s: &Subject| {
        places
            .attempts(s)
            .map(|p| p.place)
            .collect::<BTreeSet<u32>>()
    };
    let sets: Vec<_> = subjects.iter().map(own).collect();
    if places.shared_depths() == 0 || sets.iter().all(|s| *s == sets[0]) {
        return None;
    }
    let shared: Vec<usize> = subjects
        .iter()
        .map(|s| places.shared([first, s]).len())
        .collect();
    let values = sets
        .iter()
        .zip(&shared)
        .map(|(own, shared)| format!("{} places, {shared} of them also of A", own.len()));
    let values: Vec<String> = values.collect();
    // Any skin without results has no places either: that is said by itself.
    if shared
        .iter()
        .zip(&sets)
        .any(|(n, own)| *n < 2 && !own.is_empty())
    {
        let reason = "errors differ from place to place: fewer than two places are shared";
        return Some(blocked(
            difference("locations", "locations", Weight::Blocking, values, reason),
            "press the same path on both skins; --despite locations compares them as independent samples",
        ));
    }
    let reason = "only the shared places are compared";
    Some(difference(
        "locations",
        "locations",
        Weight::Harmless,
        values,
        reason,
    ))
}

fn doubles(subjects: &[Subject]) -> Option<Difference> {
    let ids: Vec<&str> = subjects
        .iter()
        .flat_map(|s| s.sessions.iter().map(|s| s.facts.session_id.as_str()))
        .collect();
    let different: BTreeSet<&str> = ids.iter().copied().collect();
    (different.len() < ids.len()).then(|| {
        let values = each(subjects, |s| s.facts.session_id.chars().take(8).collect());
        let sides = |id: &str| {
            let has = |s: &&Subject| s.sessions.iter().any(|s| s.facts.session_id == id);
            subjects.iter().filter(has).count()
        };
        let reason = if different.iter().any(|id| sides(id) > 1) {
            "one session stands on both sides, perhaps as a copy: its noise is not new"
        } else {
            "one session stands twice on one side, perhaps as a copy: its noise is not new"
        };
        blocked(
            difference("same-session", "session", Weight::Blocking, values, reason),
            "name different sessions",
        )
    })
}

fn seeds(subjects: &[Subject]) -> Option<Difference> {
    let seed = |s: &Session| s.facts.values.get("simulation.seed").cloned();
    let all: Vec<String> = subjects
        .iter()
        .flat_map(|s| s.sessions.iter().filter_map(seed))
        .collect();
    let different: BTreeSet<&String> = all.iter().collect();
    (different.len() < all.len()).then(|| {
        let values = each(subjects, |s| seed(s).unwrap_or_else(|| "none".to_owned()));
        let reason = "simulated with the same seed: noise is the same, intervals do not hold";
        difference(
            "same-seed",
            "seed of the simulation",
            Weight::Confounding,
            values,
            reason,
        )
    })
}

/// Unsealed sessions on all sides do not differ, and block all the same.
fn unsealed(subjects: &[Subject]) -> Option<Difference> {
    let sealed = |s: &Session| s.facts.values.get("session.sealed").cloned();
    let all = subjects
        .iter()
        .all(|s| s.fact(sealed) == BTreeSet::from(["false".to_owned()]));
    all.then(|| {
        let values = each(subjects, |_| "false".to_owned());
        let reason = "a session that is not sealed may still change";
        blocked(
            difference(
                "unsealed",
                "session.sealed",
                Weight::Blocking,
                values,
                reason,
            ),
            "wait for the run, or `skinrig resume` it",
        )
    })
}

fn plausible(subjects: &[Subject]) -> Option<Difference> {
    let broken = |s: &Session| s.analysis.findings.len();
    let any = subjects
        .iter()
        .flat_map(|s| &s.sessions)
        .any(|s| broken(s) > 0);
    any.then(|| {
        let values = each(subjects, |s| format!("{} broken", broken(s)));
        let reason =
            "a session that breaks a law that any sane session obeys: see its report first";
        difference(
            "findings",
            "laws of a sane session",
            Weight::Confounding,
            values,
            reason,
        )
    })
}
