//! Law: a camera's bursts come at its own presses, not whole presses earlier or later.
//!
//! Presses are periodic, so a clock that is off by whole periods still puts a burst into almost every window, of another
//! press. What tells is the ends of the path, the sync presses and every pause: there, presses lack their burst and bursts
//! lack their press, and another shift explains both.
//!
//! A path without sync presses or pauses tells a shift of three presses or more only.
//!
//! Applies to measured press times of a session with a single leg; the alignment of a scheduled recording compares all shifts itself.

use skinrig_model::CameraId;

use super::finding::finding;
use super::observed_press::ObservedPress;
use super::slow::burst_delay_s;
use crate::result::{Evidence, Fault, Finding, Law};

/// A contact this close to a press belongs to it, s.
const NEAR_S: f64 = 0.15;
/// Smaller shifts are no whole presses, s.
const MIN_SHIFT_S: f64 = 0.5;
/// Share of the presses by which a shift may be off: beyond it, a stretch of presses has no bursts at all, which is another
/// finding.
const MAX_SHIFT_SHARE: f64 = 0.2;
/// Presses by which a shift may be off in any case.
const MAX_SHIFT_PRESSES: usize = 10;
/// Presses at each end whose contacts propose shifts.
const PROPOSING: usize = 3;
/// A press without a burst, or a burst without a press, is this unlikely under the right shift, nats: 9 to 1.
const UNEXPLAINED: f64 = 2.2;
/// Another shift must be this much likelier than none, nats: 60,000 to 1, because hundreds are compared.
const CLEARLY: f64 = 11.0;
/// Minimum number of presses, and of those that a shift explains;
const MIN_PRESSES: usize = 6;
/// it explains at least this share of all: a few bursts of noise fit some shift by chance.
const MIN_SHARE: f64 = 1.0 / 3.0;

/// `contacts_s`: contacts detected in the counts of each camera, s on the host clock, ascending.
pub(super) fn findings(
    presses_seen: &[ObservedPress<'_>],
    contacts_s: [&[f64]; 2],
) -> Vec<Finding> {
    let mut listed: Vec<f64> = presses_seen
        .iter()
        .filter(|t| !t.outcome.scheduled)
        .filter_map(|t| Some(t.timing?.contact.as_secs_f64()))
        .collect();
    listed.sort_by(f64::total_cmp);
    let delay_s = burst_delay_s(presses_seen);
    let of = |camera: CameraId| {
        let contacts = contacts_s[camera.index()];
        let best = likelier_shift(&listed, contacts, delay_s)?;
        let here = explained(&listed, contacts, 0.0, delay_s);
        let evidence = Evidence::ShiftedBursts {
            camera,
            presses: listed.len(),
            here,
            there: best.explained,
            shift_s: best.shift_s,
            log_odds: best.gain,
            bursts: contacts.len(),
        };
        let mut found = finding(
            Law::BurstWithMotion,
            Fault::ClockWrong,
            Some(camera),
            evidence,
        );
        // The events in the windows are those of other presses.
        found.invalidates = true;
        Some(found)
    };
    CameraId::ALL.into_iter().filter_map(of).collect()
}

/// A shift that explains presses and bursts better than none.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Shift {
    /// From a press to its burst, s.
    shift_s: f64,
    /// Presses with a burst under it.
    explained: usize,
    /// Log-odds against no shift, nats.
    gain: f64,
}

/// The likeliest shift, if it is clearly likelier than none. Presses may burst up to `delay_s` after their contact; another shift
/// explains only those that burst at once.
fn likelier_shift(listed: &[f64], contacts: &[f64], delay_s: f64) -> Option<Shift> {
    let n = listed.len();
    if n < MIN_PRESSES || contacts.len() < MIN_PRESSES {
        return None;
    }
    let reach = MAX_SHIFT_PRESSES.max((MAX_SHIFT_SHARE * n as f64) as usize);
    let unshifted = explained(listed, contacts, 0.0, delay_s);
    let proposing = (0..PROPOSING).chain(n - PROPOSING..n);
    let proposals = proposing.flat_map(|press| {
        let nearest = contacts.partition_point(|c| *c < listed[press]);
        let (from, to) = (
            nearest.saturating_sub(reach),
            (nearest + reach).min(contacts.len()),
        );
        contacts[from..to].iter().map(move |c| c - listed[press])
    });
    // Both counts change by what is explained more: so many more presses have a burst, and so many more bursts a press.
    let least_s = MIN_SHIFT_S.max(delay_s + NEAR_S);
    let judged = proposals.filter(|s| s.abs() >= least_s).map(|shift_s| {
        let explained = explained(listed, contacts, shift_s, 0.0);
        Shift {
            shift_s,
            explained,
            gain: 2.0 * UNEXPLAINED * (explained as f64 - unshifted as f64),
        }
    });
    let best = judged.max_by(|a, b| a.gain.total_cmp(&b.gain))?;
    let many = best.explained >= MIN_PRESSES && best.explained as f64 >= MIN_SHARE * n as f64;
    (many && best.gain > CLEARLY).then_some(best)
}

/// Presses with a burst of their own after `shift_s`, or up to `delay_s` later.
fn explained(listed: &[f64], contacts: &[f64], shift_s: f64, delay_s: f64) -> usize {
    let mut rest = contacts.iter().peekable();
    let has_its_own = |press: &&f64| {
        let at = **press + shift_s;
        while rest.next_if(|c| **c < at - NEAR_S).is_some() {}
        rest.next_if(|c| **c <= at + delay_s + NEAR_S).is_some()
    };
    listed.iter().filter(has_its_own).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::even_path::path;

    fn moved(all: &[f64], by_s: f64) -> Vec<f64> {
        all.iter().map(|t| t + by_s).collect()
    }

    #[test]
    fn a_clock_off_by_whole_presses_is_found_by_the_ends_of_the_path() {
        for n in [10, 50, 250] {
            let listed = path(n);
            for presses in [-3, -2, -1, 1, 2, 3] {
                let by_s = 2.0 * f64::from(presses);
                let found = likelier_shift(&listed, &moved(&listed, by_s), 0.0).expect("is found");
                assert!(
                    (found.shift_s - by_s).abs() < 1e-9,
                    "{n} {presses} {found:?}"
                );
            }
        }
    }

    /// One burst too many at one end and one too few at the other are no proof: a press may be weak, a burst noise.
    #[test]
    fn one_press_without_sync_presses_is_not_enough() {
        let listed = &path(50)[3..];
        assert_eq!(likelier_shift(listed, &moved(listed, 2.0), 0.0), None);
        let found = likelier_shift(listed, &moved(listed, 6.0), 0.0).expect("is found");
        assert!((found.shift_s - 6.0).abs() < 1e-9, "{found:?}");
    }

    /// Slow tips: bursts come when the tip has gone deep enough, or when it leaves, in each press at another time.
    #[test]
    fn late_bursts_of_slow_presses_are_no_shift_but_whole_presses_are() {
        let listed = path(50);
        let late = |i: usize| {
            if i.is_multiple_of(3) {
                0.95
            } else {
                0.2 + 0.1 * (i % 4) as f64
            }
        };
        let bursts = |by_s: f64| -> Vec<f64> {
            let at = |(i, t): (usize, &f64)| t + late(i) + by_s;
            listed.iter().enumerate().map(at).collect()
        };
        assert_eq!(likelier_shift(&listed, &bursts(0.0), 0.9), None);
        assert!(likelier_shift(&listed, &moved(&listed, 4.0), 0.9).is_some());
        assert!(likelier_shift(&listed, &bursts(0.0), 0.0).is_some());
    }

    #[test]
    fn weak_presses_and_bursts_of_noise_are_no_shift() {
        let listed = path(50);
        for missing in 2..7 {
            let mut contacts: Vec<f64> = listed
                .iter()
                .enumerate()
                .filter(|(i, _)| i % missing != 0)
                .map(|(_, t)| t + 0.02)
                .collect();
            contacts.extend((0..20).map(|i| 1.3 + 4.7 * f64::from(i)));
            contacts.sort_by(f64::total_cmp);
            assert_eq!(
                likelier_shift(&listed, &contacts, 0.0),
                None,
                "every {missing}th"
            );
        }
        // Slow presses have no bursts; a few of noise are as far apart as some presses.
        let noise = [0.3, 1.7, 7.9, 9.2].map(|s| listed[0] - 30.0 + s);
        let few: Vec<f64> = noise
            .into_iter()
            .chain(moved(&listed[..4], -26.75))
            .collect();
        assert_eq!(likelier_shift(&listed, &few, 0.0), None);
        assert_eq!(likelier_shift(&listed, &[], 0.0), None);
        assert_eq!(likelier_shift(&listed, &listed[..30], 0.0), None);
        assert_eq!(likelier_shift(&listed, &listed[20..], 0.0), None);
    }
}
