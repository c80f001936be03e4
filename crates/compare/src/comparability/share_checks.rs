//! Owns the checks that the sides press equally often at each depth and at each location: a figure is that of all presses of a side.

use std::collections::BTreeMap;

use super::difference::{Difference, Severity, as_blocking, difference};
use crate::locations::{Attempt, Locations};
use crate::sequential::scored_repetitions;
use crate::subject::Subject;

/// Larger differences between the shares of presses do not come from a few failed presses: one of eight may be left out.
const MAX_DIFFERENCE: f64 = 0.12;

/// Shares of presses, by depth or location; sum 1.
type Shares<K> = BTreeMap<K, f64>;

pub(super) fn shares(subjects: &[Subject], locations: &Locations) -> Option<Difference> {
    depths(subjects, locations).or_else(|| at_locations(subjects, locations))
}

/// Presses whose error does not count because another skin located none at that location and depth.
pub(super) fn located_depths(subjects: &[Subject], locations: &Locations) -> Option<Difference> {
    let counts = |s: &Subject| {
        let attempts: Vec<_> = locations.attempts(s).collect();
        let located = attempts.iter().filter(|p| p.own_error_mm().is_some());
        let compared = attempts.iter().filter(|p| p.error().is_some());
        (compared.count(), located.count())
    };
    let counts: Vec<(usize, usize)> = subjects.iter().map(counts).collect();
    if counts.iter().all(|(compared, located)| compared == located) {
        return None;
    }
    let values = counts
        .iter()
        .map(|(compared, located)| format!("{compared} of {located} located presses"));
    let reason = "at each location only depths that all skins located are compared; the located rate has the rest";
    Some(difference(
        "located-depths",
        "depths that were located",
        Severity::Harmless,
        values.collect(),
        reason,
    ))
}

fn of<'a, K: Ord>(
    attempts: impl Iterator<Item = Attempt<'a>>,
    key: impl Fn(&Attempt<'a>) -> K,
) -> Shares<K> {
    let mut counts = Shares::new();
    for attempt in attempts {
        *counts.entry(key(&attempt)).or_insert(0.0) += 1.0;
    }
    let all: f64 = counts.values().sum();
    counts.values_mut().for_each(|n| *n /= all);
    counts
}

/// Share of presses that would have to move for both sides to be alike (total variation).
fn distance<K: Ord>(a: &Shares<K>, b: &Shares<K>) -> f64 {
    let missing = |from: &Shares<K>, in_: &Shares<K>| -> f64 {
        let more = from
            .iter()
            .map(|(key, share)| share - in_.get(key).unwrap_or(&0.0));
        more.filter(|d| *d > 0.0).sum()
    };
    missing(a, b).max(missing(b, a))
}

fn micrometres(attempt: &Attempt<'_>) -> i64 {
    (attempt.press.depth_mm * 1e3).round() as i64
}

/// False for a press that a person left out: it is in no figure but the rates.
fn is_kept(attempt: &Attempt<'_>) -> bool {
    let rule = attempt.press.rule();
    !rule.is_some_and(|rule| rule.is_by_hand())
}

/// Every pair of sides once.
fn pairs<T>(sides: &[T]) -> impl Iterator<Item = [&T; 2]> {
    let later = |k: usize| sides.iter().skip(k + 1);
    (0..)
        .zip(sides)
        .flat_map(move |(k, a)| later(k).map(move |b| [a, b]))
}

/// Errors depend on the depth.
fn depths(subjects: &[Subject], locations: &Locations) -> Option<Difference> {
    let sides: Vec<Shares<i64>> = subjects
        .iter()
        .map(|s| of(locations.attempts(s).filter(is_kept), micrometres))
        .collect();
    let differs = |[a, b]: [&Shares<i64>; 2]| {
        !a.is_empty() && !b.is_empty() && distance(a, b) > MAX_DIFFERENCE
    };
    if !pairs(&sides).any(differs) {
        return None;
    }
    let text = |s: &Shares<i64>| {
        let each = s
            .iter()
            .map(|(um, share)| format!("{:.0} % at {} mm", 100.0 * share, *um as f64 * 1e-3));
        each.collect::<Vec<_>>().join(", ")
    };
    let reason =
        "deeper presses have other errors, so the skin pressed deeper more often looks different";
    Some(as_blocking(
        difference(
            "depth-shares",
            "presses by depth",
            Severity::Blocking,
            sides.iter().map(text).collect(),
            reason,
        ),
        "press both skins equally often at each depth, or select sessions of one depth",
    ))
}

/// Errors vary over the skin, also for depths that are pressed at other locations. Presses that were never made have a check of their
/// own: only complete repetitions are compared.
fn at_locations(subjects: &[Subject], locations: &Locations) -> Option<Difference> {
    let differs = |[a, b]: [&Subject; 2]| {
        let shared = locations.shared([a, b]);
        let [a, b] = [a, b].map(|s| {
            let presses = of_complete_repetitions(s, locations);
            let presses = presses.into_iter().filter(|p| shared.contains(&p.location));
            of(presses, |p| (p.location, micrometres(p)))
        });
        !a.is_empty() && !b.is_empty() && distance(&a, &b) > MAX_DIFFERENCE
    };
    if !pairs(subjects).any(differs) {
        return None;
    }
    let text = |s: &Subject| {
        let mut counts: BTreeMap<u32, u32> = BTreeMap::new();
        for press in of_complete_repetitions(s, locations) {
            *counts.entry(press.location).or_insert(0) += 1;
        }
        let ends = counts.values().min().zip(counts.values().max());
        ends.map_or_else(
            || "none".to_owned(),
            |(fewest, most)| {
                format!(
                    "{fewest} to {most} presses at each of {} locations",
                    counts.len()
                )
            },
        )
    };
    let reason =
        "errors vary over the skin, so the skin pressed more often at easy locations looks better";
    Some(as_blocking(
        difference(
            "location-shares",
            "presses by location",
            Severity::Blocking,
            subjects.iter().map(text).collect(),
            reason,
        ),
        "press both skins equally often at each location, or leave out the same presses of both with `skinrig select`",
    ))
}

/// Presses of repetitions that were made in full, but for those that a person left out.
fn of_complete_repetitions<'a>(subject: &'a Subject, locations: &'a Locations) -> Vec<Attempt<'a>> {
    let whole: Vec<_> = subject.sessions.iter().map(scored_repetitions).collect();
    let depths = locations.shared_depths().max(1);
    let attempts = locations.attempts(subject).filter(is_kept);
    let made = attempts.filter(|p| {
        let session = whole.get(p.series as usize / depths);
        session.and_then(|w| w.get(&p.press.repetition)) == Some(&true)
    });
    made.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_of_sides_is_compared() {
        let sides = ["A", "B", "C"];
        let found: Vec<[&str; 2]> = pairs(&sides).map(|[a, b]| [*a, *b]).collect();
        assert_eq!(found, [["A", "B"], ["A", "C"], ["B", "C"]]);
    }

    #[test]
    fn a_distance_is_the_share_that_would_have_to_move() {
        let shares = |all: &[(u32, f64)]| all.iter().copied().collect::<Shares<u32>>();
        let even = shares(&[(1, 0.5), (2, 0.5)]);
        assert!((distance(&even, &shares(&[(1, 0.8), (2, 0.2)])) - 0.3).abs() < 1e-12);
        assert!((distance(&even, &shares(&[(3, 1.0)])) - 1.0).abs() < 1e-12);
        assert!(distance(&even, &even) == 0.0);
    }
}
