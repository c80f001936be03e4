//! Owns the refinement of a camera clock: lag of each press against the mean press, and onset of the mean press.

use super::activity::Activity;
use super::error::RatesError;
use super::line::{self, Pair, median};
use super::search::{Map, period_us};
use super::span::PressSpan;

/// Largest lag of one press against the prediction, µs, in successive iterations.
const LAGS_US: [f64; 4] = [400_000.0, 250_000.0, 120_000.0, 120_000.0];
/// A drift with a larger standard error is worse than none: crystals are within tens of ppm.
pub(super) const UNKNOWN_DRIFT: f64 = 50e-6;
/// Lower bound of the lag scale, µs (a fifth of a bin).
const FLOOR_US: f64 = 2_000.0;
/// The press begins where the mean activity reaches this share of its rise.
const ONSET_SHARE: f64 = 0.1;
/// Presses weaker than this share of the mean press are not found.
pub(super) const MIN_STRENGTH: f64 = 0.33;

/// Refines offset and drift by the lags of all presses.
pub(super) fn refine(
    activity: &Activity,
    presses: &[PressSpan],
    map: Map,
) -> Result<(Map, line::Line), RatesError> {
    let [first_us, further_us @ ..] = LAGS_US;
    let (mut map, mut line) = refine_once(activity, presses, map, first_us)?;
    for lag_us in further_us {
        (map, line) = refine_once(activity, presses, map, lag_us)?;
    }
    // Recompute the onset with well-aligned presses.
    map.offset_us += onset_us(activity, presses, map);
    Ok((map, line))
}

/// One iteration, with lags up to `lag_us`.
fn refine_once(
    activity: &Activity,
    presses: &[PressSpan],
    mut map: Map,
    lag_us: f64,
) -> Result<(Map, line::Line), RatesError> {
    map.offset_us += onset_us(activity, presses, map);
    let profile = Profile::new(activity, presses, map);
    let pairs = lags(activity, presses, map, &profile, lag_us);
    let few = RatesError::FewVisible { found: pairs.len() };
    let line = line::fit(&pairs, FLOOR_US).map_err(|_| few)?;
    map.offset_us = line.offset_us;
    map.drift = line.drift;
    if line.drift_se > UNKNOWN_DRIFT {
        // Turn the line about its middle until it has no drift.
        let used: Vec<f64> = pairs
            .iter()
            .zip(&line.used)
            .filter(|(_, u)| **u)
            .map(|(p, _)| p.host_us)
            .collect();
        let middle = used.iter().sum::<f64>() / used.len() as f64;
        map.offset_us += line.drift * middle;
        map.drift = 0.0;
    }
    Ok((map, line))
}

/// Mean activity around the predicted contacts within the recording.
pub(super) struct Profile {
    /// Time of the first sample relative to contact, µs.
    pub from_us: f64,
    pub values: Vec<f64>,
}

/// Maximum margin on both sides of a press for the comparison, µs.
const SIDE_US: f64 = 300_000.0;

impl Profile {
    pub(super) fn new(activity: &Activity, presses: &[PressSpan], map: Map) -> Self {
        let mut spans: Vec<f64> = presses
            .iter()
            .map(|p| p.release_us - p.contact_us)
            .collect();
        let span = median(&mut spans).unwrap_or(0.0);
        let side = SIDE_US.min(0.5 * (period_us(presses) - span).max(0.0));
        let samples = ((span + 2.0 * side) / activity.bin_us).ceil() as usize + 1;
        let mut values = vec![0.0; samples];
        let mut n = 0;
        for press in presses {
            let (contact, release) = (map.camera(press.contact_us), map.camera(press.release_us));
            if contact < 0.0 || release > activity.length_us() {
                continue;
            }
            n += 1;
            let start = contact - side;
            let found = activity.samples(start, samples);
            values.iter_mut().zip(found).for_each(|(v, a)| *v += a);
        }
        let n = f64::from(n.max(1));
        values.iter_mut().for_each(|v| *v /= n);
        Self {
            from_us: -side,
            values,
        }
    }
}

/// Start of the mean press relative to the predicted contacts, µs.
fn onset_us(activity: &Activity, presses: &[PressSpan], map: Map) -> f64 {
    let profile = Profile::new(activity, presses, map);
    let values = &profile.values;
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let quiet = crate::metrics::quantile(&mut values.clone(), 0.1).unwrap_or(0.0);
    let level = |share: f64| quiet + share * (highest - quiet);
    let Some(busy) = values.iter().position(|v| *v >= level(0.5)) else {
        return 0.0;
    };
    let Some(before) = values[..busy].iter().rposition(|v| *v < level(ONSET_SHARE)) else {
        return 0.0;
    };
    let (a, b) = (values[before], values[before + 1]);
    let part = (level(ONSET_SHARE) - a) / (b - a);
    profile.from_us + (before as f64 + part) * activity.bin_us
}

/// Sliding dot products of a template with the samples, from each sample with enough followers.
pub(super) fn products(template: &[f64], samples: &[f64]) -> Vec<f64> {
    /// Independent sums in parallel.
    const LANES: usize = 4;
    let n = (samples.len() + 1).saturating_sub(template.len());
    // The last sums may include unwanted neighbours.
    let mut samples = samples.to_vec();
    samples.resize(samples.len() + LANES - 1, 0.0);
    let mut sums = vec![0.0; n.next_multiple_of(LANES)];
    for (first, sums) in sums.chunks_exact_mut(LANES).enumerate() {
        let mut side_by_side = [0.0; LANES];
        let rest = &samples[first * LANES..];
        for (t, samples) in template.iter().zip(rest.windows(LANES)) {
            for (sum, sample) in side_by_side.iter_mut().zip(samples) {
                *sum += t * sample;
            }
        }
        sums.copy_from_slice(&side_by_side);
    }
    sums.truncate(n);
    sums
}

/// For each significant press, its predicted contact shifted by its own lag against the profile.
fn lags(
    activity: &Activity,
    presses: &[PressSpan],
    map: Map,
    profile: &Profile,
    most_us: f64,
) -> Vec<Pair> {
    let mean = profile.values.iter().sum::<f64>() / profile.values.len() as f64;
    let template: Vec<f64> = profile.values.iter().map(|v| v - mean).collect();
    let strength: f64 = template.iter().map(|v| v * v).sum();
    let steps = (most_us / activity.bin_us).round();
    let count = 2 * (steps as usize + 1) + template.len();
    let mut pairs = Vec::new();
    for press in presses {
        let contact = map.camera(press.contact_us);
        // All samples for any lag, computed once.
        let start = contact + profile.from_us - (steps + 1.0) * activity.bin_us;
        let samples: Vec<f64> = activity.samples(start, count).collect();
        let matches = products(&template, &samples);
        let inner = 1..matches.len() - 1;
        let Some(best) = inner.max_by(|a, b| matches[*a].total_cmp(&matches[*b])) else {
            continue;
        };
        let (left, top, right) = (matches[best - 1], matches[best], matches[best + 1]);
        // Not found: weaker than a third of the mean press, or best at the edge of the search.
        if top < MIN_STRENGTH * strength || left > top || right > top {
            continue;
        }
        let bend = left - 2.0 * top + right;
        let part = if bend < 0.0 {
            0.5 * (left - right) / bend
        } else {
            0.0
        };
        let lag = (best as f64 - 1.0 - steps + part) * activity.bin_us;
        pairs.push(Pair {
            host_us: press.contact_us,
            camera_us: contact + lag,
        });
    }
    pairs
}
