//! Law: events burst while the tip moves in the skin, and only then.

use skinrig_model::{CameraId, PressId};

use super::drift::has_bursts;
use super::finding::finding;
use super::statistics::median;
use super::touch::Touch;
use crate::result::{Analysis, Fault, Finding, Law};

/// A camera whose median response is below this many standard errors sees nothing: of noise alone it is 0.
const LEAST_MEDIAN: f64 = 1.0;
/// A press with a response below this many standard errors may have been missed.
const LEAST_RESPONSE: f64 = 2.0;
/// A statement about a camera needs this many presses.
const LEAST_PRESSES: usize = 4;
/// In a stretch without bursts, a press that responds counts against this many that do not: noise responds too.
const AGAINST: i64 = 3;
/// A stretch is a fault when it has at least this many presses,
const LEAST_STRETCH: i64 = 6;
/// and this share of all,
const LEAST_STRETCH_SHARE: f64 = 0.15;
/// while this share of the other presses respond.
const SHARE_ELSEWHERE: f64 = 0.7;

pub fn findings(analysis: &Analysis, touches: &[Touch<'_>]) -> Vec<Finding> {
    let [one, two] = CameraId::ALL.map(|camera| {
        let sights = touches.iter().filter(|t| t.done() && t.timing.is_some());
        sights
            .filter_map(|t| Some((t.press, t.sights[camera.index()].response?)))
            .collect::<Vec<(PressId, f64)>>()
    });
    let blind = [&one, &two].map(|seen| blind(seen));
    if let [Some(a), Some(b)] = blind {
        let bursts = CameraId::ALL.map(|c| has_bursts(&analysis.rates[c.index()]));
        let (fault, but) = if bursts == [true; 2] {
            (
                Fault::ClockWrong,
                "; both cameras burst at other times".to_owned(),
            )
        } else if bursts == [false; 2]
            && let Some(noise) = noise(touches.iter())
        {
            (Fault::NotTouched, format!("; {noise}{}", forces(touches)))
        } else {
            (Fault::CameraBlind, String::new())
        };
        let evidence = format!(
            "expected events to burst in presses, found {:.1} standard errors above idle in the median of {} (camera 1) and {:.1} of {} (camera 2){but}",
            a.0, a.1, b.0, b.1
        );
        let mut found = finding(Law::BurstWithMotion, fault, None, evidence);
        // What was located was not the presses.
        found.invalidates = true;
        return vec![found];
    }
    let mut found: Vec<Finding> = Vec::new();
    for (camera, blind) in CameraId::ALL.into_iter().zip(blind) {
        if let Some((usual, n)) = blind {
            let rates = usual_rates(touches, camera);
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
    let stretches = [&one, &two].map(|seen| stretch(seen));
    match stretches {
        [Some(a), Some(b)] if a.first <= b.last && b.first <= a.last => {
            let (first, last) = (a.first.max(b.first), a.last.min(b.last));
            // Presses that were measured were made.
            let there = |t: &&Touch<'_>| (first..=last).contains(&t.press);
            let (fault, but) = match noise(touches.iter().filter(there)) {
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

/// That both cameras send noise before these presses, in words; `None` when one does not, or when nobody measured the presses.
fn noise<'a>(touches: impl Iterator<Item = &'a Touch<'a>> + Clone) -> Option<String> {
    if touches.clone().any(|t| t.outcome.scheduled) {
        return None;
    }
    let [one, two] = CameraId::ALL.map(|camera| {
        let idle = touches
            .clone()
            .filter_map(|t| Some(t.sights[camera.index()].rates?.1));
        median(idle.collect()).filter(|rate| *rate > 0.0)
    });
    let (one, two) = (one?, two?);
    Some(format!(
        "both cameras send noise ({one:.0} and {two:.0} events/s)"
    ))
}

/// The usual peak of the force, where the robot reports forces.
fn forces(touches: &[Touch<'_>]) -> String {
    let peaks: Vec<f64> = touches
        .iter()
        .filter_map(|t| t.outcome.peak_force_n)
        .collect();
    let n = peaks.len();
    median(peaks).map_or_else(String::new, |usual| {
        format!("; largest force of a press {usual:.2} N in the median (n {n})")
    })
}

/// (median response, presses) when the camera sees nothing.
fn blind(seen: &[(PressId, f64)]) -> Option<(f64, usize)> {
    let n = seen.len();
    let usual = median(seen.iter().map(|(_, response)| *response).collect())?;
    (n >= LEAST_PRESSES && usual < LEAST_MEDIAN).then_some((usual, n))
}

/// Presses without a burst, one after another.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    first: PressId,
    last: PressId,
}

/// The longest stretch without bursts, when it stands out of the rest: the largest sum of consecutive presses when
/// one without response counts 1 and one with it -[`AGAINST`].
fn stretch(seen: &[(PressId, f64)]) -> Option<Stretch> {
    let responds = |i: usize| seen[i].1 >= LEAST_RESPONSE;
    let (mut best, mut sum, mut from) = ((0, 0..0), 0, 0);
    for i in 0..seen.len() {
        sum += if responds(i) { -AGAINST } else { 1 };
        if sum <= 0 {
            (sum, from) = (0, i + 1);
        } else if sum > best.0 {
            best = (sum, from..i + 1);
        }
    }
    let (sum, range) = best;
    let others = (0..seen.len()).filter(|i| !range.contains(i));
    let respond = others.clone().filter(|i| responds(*i)).count();
    let long =
        sum >= LEAST_STRETCH && range.len() as f64 >= LEAST_STRETCH_SHARE * seen.len() as f64;
    let stands_out = respond > 0 && respond as f64 >= SHARE_ELSEWHERE * others.count() as f64;
    (long && stands_out).then(|| Stretch {
        first: seen[range.start].0,
        last: seen[range.end - 1].0,
    })
}

/// The usual rates in and before presses, for the evidence.
fn usual_rates(touches: &[Touch<'_>], camera: CameraId) -> String {
    let rates = || {
        touches
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
