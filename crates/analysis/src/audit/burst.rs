//! Law: events burst while the tip moves in the skin, and only then.

use skinrig_model::{CameraId, PressId};

use super::drift::has_bursts;
use super::finding::finding;
use super::observed_press::ObservedPress;
use super::statistics::median;
use crate::result::{Analysis, Fault, Finding, Law};

/// A camera is blind if its median response is below this many standard errors (noise alone gives 0).
const MIN_MEDIAN: f64 = 1.0;
/// A press with a smaller response, in standard errors, may be missing.
const MIN_RESPONSE: f64 = 2.0;
/// Minimum number of presses for a statement about a camera.
const MIN_PRESSES: usize = 4;
/// Weight of a press with response in a stretch without bursts: noise sometimes responds too.
const RESPONSE_WEIGHT: i64 = 3;
/// Minimum number of presses in a faulty stretch,
const MIN_STRETCH: i64 = 6;
/// its minimum share of all presses,
const MIN_STRETCH_SHARE: f64 = 0.15;
/// and the minimum share of the other presses that respond.
const SHARE_ELSEWHERE: f64 = 0.7;

pub(super) fn findings(analysis: &Analysis, presses_seen: &[ObservedPress<'_>]) -> Vec<Finding> {
    let [one, two] = CameraId::ALL.map(|camera| {
        let sights = presses_seen
            .iter()
            .filter(|t| t.is_complete() && t.timing.is_some());
        sights
            .filter_map(|t| Some((t.press, t.sights[camera.index()].response?)))
            .collect::<Vec<(PressId, f64)>>()
    });
    let blind = [&one, &two].map(|press_bursts| blind(press_bursts));
    if let [Some(a), Some(b)] = blind {
        let bursts = CameraId::ALL.map(|c| has_bursts(&analysis.rates[c.index()]));
        let (fault, but) = if bursts == [true; 2] {
            (
                Fault::ClockWrong,
                "; both cameras burst at other times".to_owned(),
            )
        } else if bursts == [false; 2]
            && let Some(noise) = noise(presses_seen.iter())
        {
            (
                Fault::NotTouched,
                format!("; {noise}{}", forces(presses_seen)),
            )
        } else {
            (Fault::CameraBlind, String::new())
        };
        let evidence = format!(
            "expected events to burst in presses, found {:.1} standard errors above idle in the median of {} (camera 1) and {:.1} of {} (camera 2){but}",
            a.0, a.1, b.0, b.1
        );
        let mut found = finding(Law::BurstWithMotion, fault, None, evidence);
        // The located events were not those of the presses.
        found.invalidates = true;
        return vec![found];
    }
    let mut found: Vec<Finding> = Vec::new();
    for (camera, blind) in CameraId::ALL.into_iter().zip(blind) {
        if let Some((usual, n)) = blind {
            let rates = usual_rates(presses_seen, camera);
            let evidence = format!(
                "expected events to burst in presses, found {usual:.1} standard errors above idle in the median of {n} ({camera}){rates}"
            );
            found.push(finding(
                Law::BurstWithMotion,
                Fault::CameraBlind,
                Some(camera),
                evidence,
            ));
        }
    }
    let stretches = [&one, &two].map(|press_bursts| longest_silent_run(press_bursts));
    match stretches {
        [Some(a), Some(b)] if a.first <= b.last && b.first <= a.last => {
            let (first, last) = (a.first.max(b.first), a.last.min(b.last));
            // Measured presses did happen.
            let there = |t: &&ObservedPress<'_>| (first..=last).contains(&t.press);
            let (fault, but) = match noise(presses_seen.iter().filter(there)) {
                Some(noise) => (Fault::NotTouched, format!("; {noise}")),
                None => (Fault::PressesMissing, String::new()),
            };
            let evidence = format!(
                "expected a burst of events in each press, found none in either camera from {first} to {last}{but}"
            );
            found.push(finding(Law::BurstWithMotion, fault, None, evidence));
        }
        stretches => {
            for (camera, stretch) in CameraId::ALL.into_iter().zip(stretches) {
                if let Some(s) = stretch {
                    let evidence = format!(
                        "expected a burst of events in each press, found none of {camera} from {} to {}",
                        s.first, s.last
                    );
                    found.push(finding(
                        Law::BurstWithMotion,
                        Fault::CameraBlind,
                        Some(camera),
                        evidence,
                    ));
                }
            }
        }
    }
    found
}

/// Noise rates, if both cameras record noise before these presses; `None` if one does not, or if the presses were not
/// measured.
fn noise<'a>(presses_seen: impl Iterator<Item = &'a ObservedPress<'a>> + Clone) -> Option<String> {
    if presses_seen.clone().any(|t| t.outcome.scheduled) {
        return None;
    }
    let [one, two] = CameraId::ALL.map(|camera| {
        let idle = presses_seen
            .clone()
            .filter_map(|t| Some(t.sights[camera.index()].rates?.1));
        median(idle.collect()).filter(|rate| *rate > 0.0)
    });
    let (one, two) = (one?, two?);
    Some(format!(
        "both cameras send noise ({one:.0} and {two:.0} events/s)"
    ))
}

/// Median peak force, if the robot reports forces.
fn forces(presses_seen: &[ObservedPress<'_>]) -> String {
    let peaks: Vec<f64> = presses_seen
        .iter()
        .filter_map(|t| t.outcome.peak_force_n)
        .collect();
    let n = peaks.len();
    median(peaks).map_or_else(String::new, |usual| {
        format!("; largest force of a press {usual:.2} N in the median (n {n})")
    })
}

/// (median response, presses) of a blind camera.
fn blind(press_bursts: &[(PressId, f64)]) -> Option<(f64, usize)> {
    let n = press_bursts.len();
    let usual = median(press_bursts.iter().map(|(_, response)| *response).collect())?;
    (n >= MIN_PRESSES && usual < MIN_MEDIAN).then_some((usual, n))
}

/// Consecutive presses without a burst.
#[derive(Debug, Clone, Copy)]
struct SilentRun {
    first: PressId,
    last: PressId,
}

/// The longest significant stretch without bursts: the maximum sum of consecutive presses, where one without response counts
/// 1 and one with a response -[`RESPONSE_WEIGHT`].
fn longest_silent_run(press_bursts: &[(PressId, f64)]) -> Option<SilentRun> {
    let responds = |i: usize| press_bursts[i].1 >= MIN_RESPONSE;
    let (mut best, mut sum, mut from) = ((0, 0..0), 0, 0);
    for i in 0..press_bursts.len() {
        sum += if responds(i) { -RESPONSE_WEIGHT } else { 1 };
        if sum <= 0 {
            (sum, from) = (0, i + 1);
        } else if sum > best.0 {
            best = (sum, from..i + 1);
        }
    }
    let (sum, range) = best;
    let others = (0..press_bursts.len()).filter(|i| !range.contains(i));
    let respond = others.clone().filter(|i| responds(*i)).count();
    let long =
        sum >= MIN_STRETCH && range.len() as f64 >= MIN_STRETCH_SHARE * press_bursts.len() as f64;
    let stands_out = respond > 0 && respond as f64 >= SHARE_ELSEWHERE * others.count() as f64;
    (long && stands_out).then(|| SilentRun {
        first: press_bursts[range.start].0,
        last: press_bursts[range.end - 1].0,
    })
}

/// Median rates during and before presses, as evidence.
fn usual_rates(presses_seen: &[ObservedPress<'_>], camera: CameraId) -> String {
    let rates = || {
        presses_seen
            .iter()
            .filter_map(|t| t.sights[camera.index()].rates)
    };
    let press = median(rates().map(|r| r.0).collect());
    let idle = median(rates().map(|r| r.1).collect());
    match (press, idle) {
        (Some(press), Some(idle)) => {
            format!("; median rate {press:.0} events/s in presses, {idle:.0} before them")
        }
        _ => String::new(),
    }
}
