//! Law: events burst while the tip moves in the skin, and only then.

use skinrig_model::{CameraId, PressId};

use super::drift::has_bursts;
use super::finding::finding;
use super::observed_press::ObservedPress;
use super::statistics::median;
use crate::result::{Analysis, Evidence, Fault, Finding, Law, PeakForce, Response};
use crate::stretch::prevailing;

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
    let stretches = [&one, &two].map(|press_bursts| longest_silent_run(press_bursts));
    let silent = match stretches {
        [Some(a), Some(b)] if a.first <= b.last && b.first <= a.last => Some((a, b)),
        _ => None,
    };
    // Where only a part of the presses is silent, in both cameras, it is no matter of a whole camera, however long the part.
    let blind = [&one, &two].map(|press_bursts| blind(press_bursts).filter(|_| silent.is_none()));
    if let [Some(a), Some(b)] = blind {
        let bursts = CameraId::ALL.map(|c| has_bursts(&analysis.rates[c.index()]));
        let burst_elsewhere = bursts == [true; 2];
        let is_quiet = bursts == [false; 2];
        let noise_per_s = noise(presses_seen.iter()).filter(|_| is_quiet);
        let fault = match (burst_elsewhere, noise_per_s) {
            (true, _) => Fault::ClockWrong,
            (false, Some(_)) => Fault::NotTouched,
            (false, None) => Fault::CameraBlind,
        };
        let evidence = Evidence::NoResponseOfEither {
            responses: [a, b],
            burst_elsewhere,
            noise_per_s,
            force: noise_per_s.and_then(|_| force(presses_seen)),
        };
        let mut found = finding(Law::BurstWithMotion, fault, None, evidence);
        // The located events were not those of the presses.
        found.invalidates = true;
        return vec![found];
    }
    let mut found: Vec<Finding> = Vec::new();
    for (camera, blind) in CameraId::ALL.into_iter().zip(blind) {
        if let Some(response) = blind {
            let evidence = Evidence::NoResponse {
                camera,
                response,
                rates_per_s: usual_rates(presses_seen, camera),
            };
            found.push(finding(
                Law::BurstWithMotion,
                Fault::CameraBlind,
                Some(camera),
                evidence,
            ));
        }
    }
    match silent {
        Some((a, b)) => {
            let (first, last) = (a.first.max(b.first), a.last.min(b.last));
            // Measured presses did happen.
            let there = |t: &&ObservedPress<'_>| (first..=last).contains(&t.press);
            let noise_per_s = noise(presses_seen.iter().filter(there));
            let fault = match noise_per_s {
                Some(_) => Fault::NotTouched,
                None => Fault::PressesMissing,
            };
            let evidence = Evidence::NoBurstsOfEither {
                first,
                last,
                noise_per_s,
            };
            found.push(finding(Law::BurstWithMotion, fault, None, evidence));
        }
        None => {
            for (camera, stretch) in CameraId::ALL.into_iter().zip(stretches) {
                if let Some(s) = stretch {
                    let evidence = Evidence::NoBursts {
                        camera,
                        first: s.first,
                        last: s.last,
                    };
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
fn noise<'a>(
    presses_seen: impl Iterator<Item = &'a ObservedPress<'a>> + Clone,
) -> Option<[f64; 2]> {
    if presses_seen.clone().any(|t| t.outcome.scheduled) {
        return None;
    }
    let [one, two] = CameraId::ALL.map(|camera| {
        let idle = presses_seen
            .clone()
            .filter_map(|t| Some(t.sights[camera.index()].rates?.1));
        median(idle.collect()).filter(|rate| *rate > 0.0)
    });
    Some([one?, two?])
}

/// Median peak force, if the robot reports forces.
fn force(presses_seen: &[ObservedPress<'_>]) -> Option<PeakForce> {
    let peaks: Vec<f64> = presses_seen
        .iter()
        .filter_map(|t| t.outcome.peak_force_n)
        .collect();
    let presses = peaks.len();
    median(peaks).map(|median_n| PeakForce { median_n, presses })
}

/// Response of a blind camera.
fn blind(seen: &[(PressId, f64)]) -> Option<Response> {
    let presses = seen.len();
    let sigmas = median(seen.iter().map(|(_, response)| *response).collect())?;
    (presses >= MIN_PRESSES && sigmas < MIN_MEDIAN).then_some(Response { sigmas, presses })
}

/// Consecutive presses without a burst.
#[derive(Debug, Clone, Copy)]
struct SilentRun {
    first: PressId,
    last: PressId,
}

/// The stretch in which presses without a response prevail, if it stands out.
fn longest_silent_run(press_bursts: &[(PressId, f64)]) -> Option<SilentRun> {
    let responds = |i: usize| press_bursts[i].1 >= MIN_RESPONSE;
    let silent = (0..press_bursts.len()).map(|i| !responds(i));
    let (sum, range) = prevailing(silent, RESPONSE_WEIGHT);
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

/// Median rates during and before presses, events per second.
fn usual_rates(presses_seen: &[ObservedPress<'_>], camera: CameraId) -> Option<[f64; 2]> {
    let rates = || {
        presses_seen
            .iter()
            .filter_map(|t| t.sights[camera.index()].rates)
    };
    let press = median(rates().map(|r| r.0).collect());
    let idle = median(rates().map(|r| r.1).collect());
    Some([press?, idle?])
}
