//! Law: the recording contains exactly the presses of the schedule.
//!
//! Applies only to recordings with scheduled press times: a robot driven by skinrig lists what it does.

use skinrig_model::PressRole;

use super::finding::finding;
use super::observed_press::ObservedPress;
use super::slow::burst_delay_s;
use crate::result::{Evidence, Fault, Finding, Law};

/// A contact this close to a listed one matches it, s.
const NEAR_S: f64 = 0.3;
/// Contacts in both cameras this close are one press, s.
const TOGETHER_S: f64 = 0.15;
/// Unlisted contacts before the path belong to the sync part if they are within this many of its lengths, and so many
/// seconds.
const SYNC_LENGTHS: f64 = 2.0;
const SYNC_S: f64 = 3.0;

/// `contacts_s`: contacts detected in the counts of each camera, and `begun_s`: its first event, s on the host clock.
pub(super) fn findings(
    presses_seen: &[ObservedPress<'_>],
    contacts_s: [&[f64]; 2],
    begun_s: [Option<f64>; 2],
) -> Vec<Finding> {
    let scheduled: Vec<&ObservedPress<'_>> = presses_seen
        .iter()
        .filter(|t| t.outcome.scheduled)
        .collect();
    let contact = |t: &&ObservedPress<'_>| Some(t.timing?.contact.as_secs_f64());
    let listed: Vec<f64> = scheduled.iter().filter_map(contact).collect();
    let sync = scheduled.iter().filter(|t| t.role == PressRole::Sync);
    let sync: Vec<f64> = sync.filter_map(contact).collect();
    let path = scheduled.iter().filter(|t| t.role != PressRole::Sync);
    let Some(first) = path.filter_map(contact).min_by(f64::total_cmp) else {
        return Vec::new();
    };
    let near = |at: f64, all: &[f64], within: f64| all.iter().any(|l| (l - at).abs() <= within);
    let delay_s = burst_delay_s(presses_seen);
    // Seconds from a press to a burst of it.
    let burst_of = -NEAR_S..=delay_s + NEAR_S;
    let has_press = |at: f64| listed.iter().any(|l| burst_of.contains(&(at - l)));
    let has_burst = |l: f64, bursts: &[f64]| bursts.iter().any(|at| burst_of.contains(&(at - l)));
    let [one, two] = contacts_s;
    let by_both: Vec<f64> = one
        .iter()
        .copied()
        .filter(|at| near(*at, two, TOGETHER_S + delay_s))
        .collect();
    let unlisted: Vec<f64> = by_both
        .iter()
        .copied()
        .filter(|at| !has_press(*at))
        .collect();
    let (begin, end) = match (sync.first(), sync.last()) {
        (Some(a), Some(b)) => (*a, *b),
        _ => (first, first),
    };
    let from = begin - SYNC_LENGTHS * (end - begin) - SYNC_S;
    let before = |at: &&f64| **at < first - NEAR_S;
    let of_sync = |at: &&f64| before(at) && **at >= from && !sync.is_empty();
    let offsets_s = by_both.iter().filter(of_sync).map(|at| at - first);
    let unseen = sync
        .iter()
        .filter(|at| !has_burst(**at, &by_both))
        .filter(|at| [one, two].iter().all(|all| !has_burst(**at, all)));
    let (more, fewer) = (unlisted.iter().filter(of_sync).count(), unseen.count());
    // Cameras that had begun would have seen the first sync press.
    let begin_is_recorded = begun_s
        .iter()
        .all(|at| at.is_some_and(|at| at < begin - NEAR_S));
    let any_is_seen = sync.iter().any(|at| has_burst(*at, &by_both));
    let is_recorded =
        (begin_is_recorded && any_is_seen) || contacts_before(contacts_s, begin + delay_s);
    let mut found = Vec::new();
    if more > 0 || (fewer > 0 && is_recorded) {
        let evidence = Evidence::SyncTimes {
            planned_s: sync.iter().map(|at| at - first).collect(),
            found_s: offsets_s.collect(),
        };
        found.push(finding(
            Law::AsCommanded,
            Fault::SyncPattern,
            None,
            evidence,
        ));
    }
    let others: Vec<f64> = unlisted
        .iter()
        .filter(|at| !of_sync(at) && **at >= from)
        .copied()
        .collect();
    if let (Some(a), Some(b)) = (others.first(), others.last()) {
        let evidence = Evidence::Unlisted {
            listed: listed.len(),
            more: others.len(),
            from_s: *a,
            to_s: *b,
        };
        found.push(finding(
            Law::AsCommanded,
            Fault::PressesUnlisted,
            None,
            evidence,
        ));
    }
    found
}

/// True if both cameras saw a contact before or at the start of the sync part.
fn contacts_before(contacts_s: [&[f64]; 2], begin: f64) -> bool {
    contacts_s
        .iter()
        .all(|all| all.first().is_some_and(|at| *at <= begin + NEAR_S))
}
