//! Owns checks that need more than one fact: shared locations and depths, alignment, results, duplicate sessions.

use std::collections::BTreeSet;

use skinrig_analysis::result::{AlignmentStatus, LEAST_LOCATED, WarningCause};
use skinrig_model::Verdict;

use super::calibration_checks::calibrating;
use super::camera_checks::{ambient, cameras, ray_geometry};
use super::difference::{Difference, Severity, as_blocking, difference};
use super::share_checks::{located_depths, shares};
use crate::locations::Locations;
use crate::subject::{Session, Subject, join_values};

pub(super) fn all(subjects: &[Subject], locations: &Locations) -> Vec<Difference> {
    let mut found = Vec::new();
    found.extend(check_alignment(subjects));
    found.extend(check_results(subjects, locations));
    found.extend(check_depths(subjects, locations));
    found.extend(shares(subjects, locations));
    found.extend(check_prototypes(subjects));
    found.extend(check_planted(subjects));
    found.extend(check_stopped(subjects));
    found.extend(calibrating(subjects));
    found.extend(check_locations(subjects, locations));
    found.extend(located_depths(subjects, locations));
    found.extend(check_duplicates(subjects));
    found.extend(check_seeds(subjects));
    found.extend(check_mounting(subjects));
    found.extend(check_unsealed(subjects));
    found.extend(check_plausible(subjects));
    found.extend(ambient(subjects, locations));
    found.extend(cameras(subjects));
    found.extend(ray_geometry(subjects, locations));
    found
}

fn each(subjects: &[Subject], of: impl Fn(&Session) -> String) -> Vec<String> {
    subjects
        .iter()
        .map(|s| join_values(&s.fact(|x| Some(of(x)))))
        .collect()
}

fn check_alignment(subjects: &[Subject]) -> Option<Difference> {
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
        let reason = "a session is INVALID; its numbers must not be used";
        return Some(as_blocking(
            difference(
                "alignment",
                "alignment of the clocks",
                Severity::Blocking,
                values,
                reason,
            ),
            "fix what the session's report names and analyse it again, or record again",
        ));
    }
    let differ = values.iter().any(|v| *v != values[0]);
    let reason = "without a certificate the clock error of latencies is unknown";
    differ.then(|| {
        difference(
            "certificate",
            "alignment of the clocks",
            Severity::Confounding,
            values,
            reason,
        )
    })
}

fn is_few(located: usize, attempted: usize) -> bool {
    (located as f64) < LEAST_LOCATED * attempted as f64
}

/// Scored presses that the plans of a subject still owe.
fn owed(subject: &Subject) -> usize {
    let sessions = subject.sessions.iter();
    sessions.map(|s| s.analysis.scored_owed()).sum()
}

fn check_results(subjects: &[Subject], locations: &Locations) -> Option<Difference> {
    let counted = |s: &Subject| {
        locations
            .attempts(s)
            .filter(|p| p.error().is_some())
            .count()
    };
    let counts: Vec<usize> = subjects.iter().map(counted).collect();
    // Without a shared depth no press counts; `depths` reports that.
    if locations.shared_depths() == 0 {
        return None;
    }
    let attempted: Vec<usize> = subjects
        .iter()
        .map(|s| locations.attempts(s).count() + owed(s))
        .collect();
    let (key, reason) = if counts.contains(&0) {
        (
            "no-results",
            "a skin without a located press has no error to compare",
        )
    } else if counts.iter().zip(&attempted).any(|(n, of)| is_few(*n, *of)) {
        (
            "few-located",
            "fewer than half of the scored presses of a skin count, those that were made and are easy to locate: their error is not that of the skin",
        )
    } else {
        return None;
    };
    let values = counts.iter().zip(&attempted);
    let values = values.map(|(n, of)| format!("{n} of {of}")).collect();
    Some(as_blocking(
        difference(
            key,
            "scored presses that count",
            Severity::Blocking,
            values,
            reason,
        ),
        "`skinrig analyze` lists why presses do not count",
    ))
}

fn check_depths(subjects: &[Subject], locations: &Locations) -> Option<Difference> {
    let of = |s: &Subject| -> BTreeSet<String> {
        let presses = s.sessions.iter().flat_map(|s| &s.analysis.presses);
        let scored = presses.filter(|p| p.role == skinrig_model::PressRole::Score);
        scored.map(|p| format!("{} mm", p.depth_mm)).collect()
    };
    let sets: Vec<_> = subjects.iter().map(of).collect();
    if sets.iter().all(|s| *s == sets[0]) {
        return None;
    }
    let values = sets.iter().map(join_values).collect();
    if locations.shared_depths() == 0 {
        let reason = "deeper presses generate more events, and no depth is shared";
        return Some(Difference {
            is_final: true,
            ..as_blocking(
                difference("depths", "depths", Severity::Blocking, values, reason),
                "press both skins to the same depth",
            )
        });
    }
    let reason = "only shared depths are compared";
    Some(difference(
        "depths",
        "depths",
        Severity::Harmless,
        values,
        reason,
    ))
}

/// Sessions of one side are of one skin.
fn check_prototypes(subjects: &[Subject]) -> Option<Difference> {
    let prototypes = |s: &Subject| s.fact(|x| Some(x.facts.prototype.clone()));
    let mixed = subjects.iter().any(|s| prototypes(s).len() > 1);
    mixed.then(|| {
        let values = each(subjects, |s| s.facts.prototype.clone());
        let reason =
            "a side has sessions of several prototypes; its figure is that of none of them";
        as_blocking(
            difference(
                "prototypes",
                "prototypes of a side",
                Severity::Blocking,
                values,
                reason,
            ),
            "name a prototype instead of a folder, or sessions of one",
        )
    })
}

/// Injected faults that are alike on all sides, which is no difference of facts.
fn check_planted(subjects: &[Subject]) -> Option<Difference> {
    let planted = |s: &Session| {
        let of = |key: &str| {
            let values = s.facts.values.iter();
            let own = values.filter(|(name, _)| name.starts_with(key));
            own.filter(|(_, value)| !matches!(value.as_str(), "[]" | "none"))
                .map(|(_, value)| value.clone())
                .collect::<Vec<_>>()
        };
        let all = [of("protocol.faults"), of("simulation.faults")].concat();
        all.join(", ")
    };
    let sides: Vec<BTreeSet<String>> = subjects
        .iter()
        .map(|s| s.fact(|x| Some(planted(x))))
        .collect();
    let alike = sides.iter().all(|s| s.len() == 1 && *s == sides[0]);
    let any = sides.iter().flatten().any(|faults| !faults.is_empty());
    (alike && any).then(|| {
        as_blocking(
            difference(
                "planted-fault",
                "injected faults",
                Severity::Blocking,
                each(subjects, planted),
                "a fault was injected",
            ),
            "record without --fault",
        )
    })
}

/// Presses that stopped when they were felt did not reach the depth that their rows state.
fn check_stopped(subjects: &[Subject]) -> Option<Difference> {
    let stopped = |s: &Session| {
        let scored =
            s.analysis.presses.iter().filter(|p| {
                p.role == skinrig_model::PressRole::Score && p.verdict != Verdict::Missed
            });
        let of = scored.count();
        s.analysis.warnings.iter().find_map(|w| match w.cause {
            WarningCause::StoppedWhenFelt { presses, depth_mm } => Some((presses, of, depth_mm)),
            _ => None,
        })
    };
    let sessions = || subjects.iter().flat_map(|s| &s.sessions);
    let (stops, all) = (sessions().filter_map(stopped).count(), sessions().count());
    if stops == 0 {
        return None;
    }
    let values = each(subjects, |s| match stopped(s) {
        Some((presses, of, mm)) => {
            format!("{presses} of {of} stopped, at {mm:.2} mm in the median")
        }
        None => "none stopped".to_owned(),
    });
    let what = "presses that stopped when they were felt";
    let reason = "they did not reach the planned depth: each is as deep as it took to feel it";
    let found = difference("stopped", what, Severity::Confounding, values, reason);
    Some(if stops == all {
        found
    } else {
        as_blocking(found, "press both skins with the same `online.react`")
    })
}

fn check_locations(subjects: &[Subject], locations: &Locations) -> Option<Difference> {
    let first = subjects.first()?;
    let own = |s: &Subject| {
        locations
            .attempts(s)
            .map(|p| p.location)
            .collect::<BTreeSet<u32>>()
    };
    let sets: Vec<_> = subjects.iter().map(own).collect();
    if locations.shared_depths() == 0 || sets.iter().all(|s| *s == sets[0]) {
        return None;
    }
    let shared: Vec<usize> = subjects
        .iter()
        .map(|s| locations.shared([first, s]).len())
        .collect();
    let values = sets
        .iter()
        .zip(&shared)
        .map(|(own, shared)| format!("{} locations, {shared} shared with A", own.len()));
    let values: Vec<String> = values.collect();
    // A skin without results has no locations either; `results` reports that.
    if shared
        .iter()
        .zip(&sets)
        .any(|(n, own)| *n < 2 && !own.is_empty())
    {
        let reason = "errors vary over the skin, and fewer than two locations are shared";
        return Some(as_blocking(
            difference("locations", "locations", Severity::Blocking, values, reason),
            "press the same path on both skins",
        ));
    }
    let reason = "only shared locations are compared";
    Some(difference(
        "locations",
        "locations",
        Severity::Harmless,
        values,
        reason,
    ))
}

fn check_duplicates(subjects: &[Subject]) -> Option<Difference> {
    let all = || {
        let sides = subjects.iter().enumerate();
        sides.flat_map(|(side, s)| s.sessions.iter().map(move |s| (side, s)))
    };
    // Sides of each pair of sessions with the same recording.
    let mut pairs = Vec::new();
    for (k, (side, a)) in all().enumerate() {
        for (other, b) in all().skip(k + 1) {
            let same_id = a.facts.session_id == b.facts.session_id;
            if same_id || a.is_same_recording(b) {
                pairs.push((side != other, same_id));
            }
        }
    }
    let (between_sides, same_id) = *pairs.iter().max()?;
    let values = each(subjects, |s| s.facts.session_id.chars().take(8).collect());
    let what = if same_id {
        "the same session, or a copy of it,"
    } else {
        "the same recording, imported, replayed or simulated twice,"
    };
    let place = if between_sides {
        "is on both sides"
    } else {
        "is twice on one side"
    };
    let reason = format!("{what} {place}: its noise is not independent");
    Some(as_blocking(
        difference(
            "same-session",
            "session",
            Severity::Blocking,
            values,
            &reason,
        ),
        "name each session once",
    ))
}

fn check_seeds(subjects: &[Subject]) -> Option<Difference> {
    let seed = |s: &Session| s.facts.values.get("simulation.seed").cloned();
    let all: Vec<String> = subjects
        .iter()
        .flat_map(|s| s.sessions.iter().filter_map(seed))
        .collect();
    let different: BTreeSet<&String> = all.iter().collect();
    (different.len() < all.len()).then(|| {
        let values = each(subjects, |s| seed(s).unwrap_or_else(|| "none".to_owned()));
        let reason = "simulated with the same seed: the noise is identical, so intervals are wrong";
        difference(
            "same-seed",
            "seed of the simulation",
            Severity::Confounding,
            values,
            reason,
        )
    })
}

/// Reports skins with one session each: nothing tells how much a session differs from the next of the same skin.
fn check_mounting(subjects: &[Subject]) -> Option<Difference> {
    let alone = subjects.iter().all(|s| s.sessions.len() == 1);
    alone.then(|| {
        let values = subjects.iter().map(|_| "one".to_owned()).collect();
        let reason = "mounting, light and calibration count as the skin's; record each skin again, mounted anew";
        difference(
            "mounting",
            "sessions",
            Severity::Confounding,
            values,
            reason,
        )
    })
}

/// Reports unsealed skins. It also fires when all skins are unsealed, which the rules do not see as
/// a difference.
fn check_unsealed(subjects: &[Subject]) -> Option<Difference> {
    let sealed = |s: &Session| s.facts.values.get("session.sealed").cloned();
    let all = subjects
        .iter()
        .all(|s| s.fact(sealed) == BTreeSet::from(["false".to_owned()]));
    all.then(|| {
        let values = each(subjects, |_| "false".to_owned());
        let reason = "an unsealed session may still change";
        as_blocking(
            difference(
                "unsealed",
                "session is sealed",
                Severity::Blocking,
                values,
                reason,
            ),
            "wait for the run, or `skinrig resume` it",
        )
    })
}

fn check_plausible(subjects: &[Subject]) -> Option<Difference> {
    let broken = |s: &Session| s.analysis.findings.len();
    let any = subjects
        .iter()
        .flat_map(|s| &s.sessions)
        .any(|s| broken(s) > 0);
    any.then(|| {
        let values = each(subjects, |s| format!("{} broken", broken(s)));
        let reason = "a session breaks plausibility laws; see its report first";
        difference(
            "findings",
            "plausibility findings",
            Severity::Confounding,
            values,
            reason,
        )
    })
}
