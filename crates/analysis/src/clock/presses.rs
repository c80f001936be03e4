//! The clock fit from the presses themselves: where the planned rhythm is found in the event rates.
//!
//! No start time is typed in. The search has four steps:
//! 1. The rate (10 ms bins) becomes an *activity* between 0 (idle) and 1 (as busy as presses are).
//! 2. A matched filter over every offset: the expected press spans against the mean activity around them, for a
//!    few drifts up to 200 ppm, so that hours of presses line up.
//! 3. Offset and drift are refined by each press's own lag against the session's mean press, robustly. The onset
//!    of the mean press is put at the measured contacts.
//! 4. The result is compared with its neighbours one, two, ... whole press periods away over the whole session:
//!    those expect presses where the recording is quiet, or leave presses unexplained. A press that is where it is
//!    expected, at least half as strong as the median, counts +1, one that is not -1, one outside the recording 0. Half the distance to the next best is
//!    the margin, in presses; a better neighbour is taken instead.

use super::NO_TIME_US;
use super::correlate::Correlator;
use super::line::{self, Pair, median};
use crate::rates::RateHistogram;
use crate::result::{ClockFit, ClockMethod};

/// Contact and release of one press on the host clock, µs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressSpan {
    /// First touch.
    pub contact_us: f64,
    /// Last touch.
    pub release_us: f64,
}

/// A clock fit from event rates, how much better it is than the next best, and what to say about it.
#[derive(Debug, Clone, PartialEq)]
pub struct RatesFit {
    /// The fit.
    pub fit: ClockFit,
    /// By how many presses the alignment explains more than the best one that is off by whole press periods.
    pub margin_presses: f64,
    /// Remarks for the reader.
    pub warnings: Vec<String>,
}

/// Longest session that is searched, bins (46 hours of 10 ms).
const MOST_BINS: f64 = 16_777_216.0;
/// Bins that are merged for the first search.
const MERGE: usize = 5;
/// Largest drift of the first search; one found beyond it is searched for again, about itself.
const MOST_DRIFT: f64 = 200e-6;
/// Two drifts of the first search differ by this at the ends of the session, µs.
const DRIFT_STEP_US: f64 = 150_000.0;
/// Largest lag of one press against the prediction, µs, in the first and the later rounds of refinement.
const LAGS_US: [f64; 4] = [400_000.0, 250_000.0, 120_000.0, 120_000.0];
/// Bins by which the instant within a period may differ from the onset when shifts are compared.
const NUDGES: i32 = 5;
/// The rise of a press is measured against this long before its contact, at most, µs.
const RISE_US: f64 = 300_000.0;
/// A margin below this many presses is reported as doubtful.
const SAFE_MARGIN: f64 = 1.0;
/// A drift with a larger standard error than this is worse than none: crystals are within tens of ppm.
const UNKNOWN_DRIFT: f64 = 50e-6;
/// Lags are never judged finer than this, µs (a fifth of a bin).
const FLOOR_US: f64 = 2_000.0;
/// Lags that scatter more than this are suspicious, µs.
const SUSPICIOUS_RMS_US: f64 = 40_000.0;
/// The press begins where the mean activity leaves this share of its rise.
const ONSET_SHARE: f64 = 0.1;

/// A clock that maps host µs to camera µs relative to the histogram's start.
#[derive(Debug, Clone, Copy)]
struct Map {
    offset_us: f64,
    drift: f64,
}

impl Map {
    fn camera(self, host_us: f64) -> f64 {
        self.offset_us + host_us + self.drift * host_us
    }
}

/// Finds the camera clock from a rate histogram and the presses that were made, in time order.
///
/// # Errors
/// A sentence that says why no alignment was found.
pub fn fit_rates(rates: &RateHistogram, presses: &[PressSpan]) -> Result<RatesFit, String> {
    if presses.len() < 4 {
        return Err(format!(
            "expected at least 4 presses with known times to align the clock by event rates, found {}",
            presses.len()
        ));
    }
    let span_us = presses[presses.len() - 1].release_us - presses[0].contact_us;
    if !(0.0..=MOST_BINS * rates.bin_us() as f64).contains(&span_us) {
        return Err(format!(
            "expected the presses in time order within two days, found {:.0} s between the first and the last",
            span_us * 1e-6
        ));
    }
    if rates.start_us() >= NO_TIME_US {
        return Err(format!(
            "expected camera times below 2^62 µs, found events at {} µs: the time base of the stream is broken",
            rates.start_us()
        ));
    }
    let activity = Activity::new(rates, presses)?;
    let mut map = first_map(&activity, presses, 0.0);
    let period = period_us(presses);
    let mut line;
    (map, line) = refine(&activity, presses, map)?;
    if line.drift.abs() > MOST_DRIFT {
        // The presses ran away from the first search by more than their own lags show: search about this drift.
        map = first_map(&activity, presses, line.drift);
        (map, line) = refine(&activity, presses, map)?;
    }
    let (shift, margin) = best_shift(&activity, presses, map, period);
    if shift != 0 {
        map.offset_us += f64::from(shift) * period;
        (map, line) = refine(&activity, presses, map)?;
    }
    let mut warnings = Vec::new();
    if line.drift_se > UNKNOWN_DRIFT {
        warnings.push(format!(
            "the session is too short to find the clock's drift by event rates ({:.0} ± {:.0} ppm): it is taken as 0",
            line.drift * 1e6,
            line.drift_se * 1e6
        ));
    }
    if margin < SAFE_MARGIN {
        warnings.push(format!(
            "the alignment by event rates is doubtful: one shifted by whole press periods explains only {margin:.1} presses less"
        ));
    }
    if line.rms_us > SUSPICIOUS_RMS_US {
        warnings.push(format!(
            "presses found in the event rates scatter by {:.0} ms rms about the clock fit",
            line.rms_us * 1e-3
        ));
    }
    let n = line.n() as u32;
    Ok(RatesFit {
        fit: ClockFit {
            method: ClockMethod::EventRates,
            offset_us: rates.start_us() as f64 + map.offset_us,
            drift_ppm: map.drift * 1e6,
            drift_se_ppm: line.drift_se * 1e6,
            residual_rms_us: line.rms_us,
            residual_max_us: line.max_us,
            n,
            rejected: presses.len() as u32 - n,
        },
        margin_presses: margin,
        warnings,
    })
}

fn period_us(presses: &[PressSpan]) -> f64 {
    let mut steps: Vec<f64> = presses
        .windows(2)
        .map(|w| w[1].contact_us - w[0].contact_us)
        .collect();
    median(&mut steps).unwrap_or(0.0)
}

/// Rate per bin, scaled to 0..=1, with its running sum.
struct Activity {
    bin_us: f64,
    values: Vec<f64>,
    sums: Vec<f64>,
}

impl Activity {
    fn new(rates: &RateHistogram, presses: &[PressSpan]) -> Result<Self, String> {
        let bin_us = rates.bin_us() as f64;
        // Square roots make Poisson noise the same at all rates.
        let roots: Vec<f64> = rates
            .counts()
            .iter()
            .map(|c| f64::from(*c).sqrt())
            .collect();
        let total_us = roots.len() as f64 * bin_us;
        let pressed_us: f64 = presses.iter().map(|p| p.release_us - p.contact_us).sum();
        let share = (pressed_us / total_us).clamp(0.0, 0.8);
        // Half of the idle bins lie below `low`, a quarter of the pressed ones above `high`.
        let low = crate::metrics::quantile(&mut roots.clone(), 0.5 * (1.0 - share)).unwrap_or(0.0);
        let high = crate::metrics::quantile(&mut roots.clone(), 1.0 - 0.25 * share).unwrap_or(0.0);
        if high - low < 0.5 {
            return Err(
                "expected presses to stand out in the event rates, found hardly any difference between \
                 busy and idle times; was the camera running and the crop right?"
                    .to_owned(),
            );
        }
        let values: Vec<f64> = roots
            .iter()
            .map(|r| ((r - low) / (high - low)).clamp(0.0, 1.0))
            .collect();
        let mut sum = 0.0;
        let mut sums = vec![0.0];
        sums.extend(values.iter().map(|v| {
            sum += v;
            sum
        }));
        Ok(Self {
            bin_us,
            values,
            sums,
        })
    }

    fn length_us(&self) -> f64 {
        self.values.len() as f64 * self.bin_us
    }

    /// Sum of the activity before `t_us`, in bins, interpolated.
    fn sum_before(&self, t_us: f64) -> f64 {
        let at = (t_us / self.bin_us).clamp(0.0, self.values.len() as f64);
        let i = (at as usize).min(self.values.len() - 1);
        self.sums[i] + (at - i as f64) * self.values[i]
    }

    fn between(&self, from_us: f64, to_us: f64) -> f64 {
        self.sum_before(to_us) - self.sum_before(from_us)
    }

    /// Mean activity in each of `n` bin-wide intervals side by side, the first about `t_us`. All of them part the bins
    /// that they meet in the same way; outside the recording nothing is active.
    fn samples(&self, t_us: f64, n: usize) -> impl Iterator<Item = f64> {
        let at = t_us / self.bin_us - 0.5;
        let first = at.floor();
        let part = at - first;
        let first = first as i64;
        let value = move |i: i64| {
            let i = usize::try_from(i).ok();
            i.and_then(|i| self.values.get(i)).copied().unwrap_or(0.0)
        };
        let mut left = value(first);
        (1..=n as i64).map(move |k| {
            let right = value(first.saturating_add(k));
            let mean = left + part * (right - left);
            left = right;
            mean
        })
    }
}

/// The clock at which the press spans best match the activity, with a drift within [`MOST_DRIFT`] of `about`.
fn first_map(activity: &Activity, presses: &[PressSpan], about: f64) -> Map {
    let bin_us = activity.bin_us * MERGE as f64;
    let mean = activity.values.iter().sum::<f64>() / activity.values.len() as f64;
    let merged: Vec<f64> = activity
        .values
        .chunks(MERGE)
        .map(|bins| bins.iter().map(|v| v - mean).sum())
        .collect();
    let side_us = period_us(presses);
    let from_us = presses[0].contact_us - side_us;
    let middle_us = presses[presses.len() / 2].contact_us;
    let half_us = (middle_us - from_us)
        .max(presses[presses.len() - 1].release_us - middle_us)
        .max(1.0);
    let length = ((presses[presses.len() - 1].release_us + side_us - from_us) / bin_us
        * (1.0 + about.abs() + MOST_DRIFT))
        .ceil() as usize
        + 1;
    let correlator = Correlator::new(&merged, length);
    let steps = (MOST_DRIFT * half_us / DRIFT_STEP_US).ceil() as i32;
    let drifts = (-steps..=steps).map(|step| {
        if steps == 0 {
            about
        } else {
            about + MOST_DRIFT * f64::from(step) / f64::from(steps)
        }
    });
    let template = |drift: f64| {
        // Time within the template of a host time: the middle of the session stays where it is.
        let place = |host_us: f64| {
            let stretched = host_us + drift * (host_us - middle_us) - from_us;
            ((stretched / bin_us).max(0.0) as usize).min(length)
        };
        let mut template = vec![0.0; length];
        for press in presses {
            let (a, b) = (place(press.contact_us), place(press.release_us));
            template[a..b.max(a + 1).min(length)].fill(1.0);
        }
        let share = template.iter().sum::<f64>() / length as f64;
        template.iter_mut().for_each(|v| *v -= share);
        template
    };
    let drifts: Vec<f64> = drifts.collect();
    let mut best: Option<(f64, Map)> = None;
    for pair in drifts.chunks(2) {
        let templates: Vec<Vec<f64>> = pair.iter().map(|drift| template(*drift)).collect();
        let other = templates.get(1).map_or(&[][..], Vec::as_slice);
        let found = correlator.best_lags([&templates[0], other]);
        for (&drift, (lag, score)) in pair.iter().zip(found) {
            let offset_us = lag as f64 * bin_us - from_us - drift * middle_us;
            if best.is_none_or(|(s, _)| score > s) {
                best = Some((score, Map { offset_us, drift }));
            }
        }
    }
    best.map_or(
        Map {
            offset_us: 0.0,
            drift: 0.0,
        },
        |(_, map)| map,
    )
}

/// For each press within the recording, how much the activity rises from just before the contact to the press
/// itself, in bins.
fn rises(activity: &Activity, presses: &[PressSpan], map: Map) -> Vec<f64> {
    let mut earlier_release = f64::NEG_INFINITY;
    let mut out = Vec::new();
    for press in presses {
        let span = press.release_us - press.contact_us;
        let before = RISE_US.min(0.5 * (press.contact_us - earlier_release));
        earlier_release = press.release_us;
        let (contact, release) = (map.camera(press.contact_us), map.camera(press.release_us));
        let recorded = contact - before >= 0.0 && release <= activity.length_us();
        if before <= 0.0 || span <= 0.0 || !recorded {
            continue;
        }
        let idle = activity.between(contact - before, contact) / before;
        out.push(activity.between(contact, release) - idle * span);
    }
    out
}

/// The shift by whole periods that explains most, and by how many presses it beats the next best.
fn best_shift(activity: &Activity, presses: &[PressSpan], map: Map, period: f64) -> (i32, f64) {
    let unit = median(&mut rises(activity, presses, map))
        .unwrap_or(0.0)
        .max(f64::MIN_POSITIVE);
    let score = |shift: i32, nudge: i32| -> f64 {
        let nudge_us = f64::from(nudge) * activity.bin_us;
        let moved = Map {
            offset_us: map.offset_us + f64::from(shift) * period + nudge_us,
            ..map
        };
        let found = rises(activity, presses, moved);
        found
            .iter()
            .map(|r| (4.0 * r / unit - 1.0).clamp(-1.0, 1.0))
            .sum()
    };
    // Within a period the score may prefer another instant than the onset: the same for all shifts.
    let nudge = (-NUDGES..=NUDGES)
        .map(|n| (n, score(0, n)))
        .fold((0, f64::NEG_INFINITY), |b, n| if n.1 > b.1 { n } else { b })
        .0;
    // At least half of the presses stay within the recording.
    let most = (presses.len() / 2) as i32;
    let scores: Vec<(i32, f64)> = (-most..=most).map(|s| (s, score(s, nudge))).collect();
    let best = scores
        .iter()
        .copied()
        .fold((0, score(0, nudge)), |b, s| if s.1 > b.1 { s } else { b });
    let next = scores
        .iter()
        .filter(|s| s.0 != best.0)
        .map(|s| s.1)
        .fold(f64::NEG_INFINITY, f64::max);
    (best.0, 0.5 * (best.1 - next))
}

/// Refines offset and drift by the lags of all presses.
fn refine(
    activity: &Activity,
    presses: &[PressSpan],
    mut map: Map,
) -> Result<(Map, line::Line), String> {
    let mut last = None;
    for lag_us in LAGS_US {
        map.offset_us += onset_us(activity, presses, map);
        let profile = Profile::new(activity, presses, map);
        let pairs = lags(activity, presses, map, &profile, lag_us);
        let line = line::fit(&pairs, FLOOR_US).ok_or_else(|| {
            format!(
                "expected at least 3 presses to be visible in the event rates, found {}",
                pairs.len()
            )
        })?;
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
        last = Some(line);
    }
    // The onset once more, now that the presses are well aligned.
    map.offset_us += onset_us(activity, presses, map);
    last.map(|line| (map, line))
        .ok_or_else(|| "no round of refinement".to_owned())
}

/// Mean activity about the predicted contacts.
struct Profile {
    /// Time of the first sample after the contact, µs.
    from_us: f64,
    values: Vec<f64>,
}

/// A press is compared over its span and this much on both sides, at most, µs.
const SIDE_US: f64 = 300_000.0;

impl Profile {
    fn new(activity: &Activity, presses: &[PressSpan], map: Map) -> Self {
        let mut spans: Vec<f64> = presses
            .iter()
            .map(|p| p.release_us - p.contact_us)
            .collect();
        let span = median(&mut spans).unwrap_or(0.0);
        let side = SIDE_US.min(0.5 * (period_us(presses) - span).max(0.0));
        let samples = ((span + 2.0 * side) / activity.bin_us).ceil() as usize + 1;
        let mut values = vec![0.0; samples];
        for press in presses {
            let start = map.camera(press.contact_us) - side;
            let found = activity.samples(start, samples);
            values.iter_mut().zip(found).for_each(|(v, a)| *v += a);
        }
        let n = presses.len() as f64;
        values.iter_mut().for_each(|v| *v /= n);
        Self {
            from_us: -side,
            values,
        }
    }
}

/// When the mean press begins, µs after the predicted contacts.
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

/// The sum of the products of a template with the samples, from each sample on after which there are enough.
fn products(template: &[f64], samples: &[f64]) -> Vec<f64> {
    /// Sums that are made side by side: none has to wait for another.
    const LANES: usize = 4;
    let n = (samples.len() + 1).saturating_sub(template.len());
    // The last sums may have neighbours that are not wanted.
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

/// For each press that stands out, its predicted contact moved by its own lag against the profile.
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
        // All samples that any lag needs, once.
        let start = contact + profile.from_us - (steps + 1.0) * activity.bin_us;
        let samples: Vec<f64> = activity.samples(start, count).collect();
        let matches = products(&template, &samples);
        let inner = 1..matches.len() - 1;
        let Some(best) = inner.max_by(|a, b| matches[*a].total_cmp(&matches[*b])) else {
            continue;
        };
        let (left, top, right) = (matches[best - 1], matches[best], matches[best + 1]);
        // Weaker than a third of the mean press, or best at the edge of the search: not found.
        if top < 0.33 * strength || left > top || right > top {
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
