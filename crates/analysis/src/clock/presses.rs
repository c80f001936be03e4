//! The clock fit from the presses themselves: where the planned rhythm is found in the event rates.
//!
//! No start time is typed in. The search has four steps:
//! 1. The rate (10 ms bins) becomes an *activity* between 0 (idle) and 1 (as busy as presses are).
//! 2. Every offset at which at least half of the first few hundred presses lie in the recording is scored:
//!    activity inside the expected press spans minus activity outside them, in units of a press. What happens
//!    where nothing should, such as sync presses left unexplained, counts against an offset as much as a planned
//!    press that is not there.
//! 3. Offset and drift are refined by each press's own lag against the session's mean press, robustly, over
//!    more and more presses. The onset of the mean press is put at the measured contacts.
//! 4. The result is compared with its neighbours one, two, ... whole press periods away over the whole session.
//!    Their distance in presses is the margin; a better neighbour is taken instead.

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

/// Presses of the first search: enough for certainty, few enough that a drift of 200 ppm does not smear them
/// (15 minutes of the published rhythm: ±0.09 s).
const BLOCK: usize = 300;
/// Step of the first search, µs.
const COARSE_STEP_US: f64 = 50_000.0;
/// Largest lag of one press against the prediction, µs, in the first and the later rounds of refinement.
const LAGS_US: [f64; 4] = [400_000.0, 250_000.0, 120_000.0, 120_000.0];
/// Whole press periods by which the result is compared with its neighbours.
const SHIFTS: i32 = 4;
/// A margin below this many presses is reported as doubtful.
const SAFE_MARGIN: f64 = 1.0;
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
    let activity = Activity::new(rates, presses)?;
    let block = &presses[..presses.len().min(BLOCK)];
    let mut map = Map {
        offset_us: coarse_offset(&activity, block),
        drift: 0.0,
    };
    let period = period_us(presses);
    let mut margin = 0.0;
    let mut line = None;
    for _ in 0..=SHIFTS {
        (map, line) = refine(&activity, presses, map)?;
        let (shift, best_margin) = best_shift(&activity, presses, map, period);
        margin = best_margin;
        if shift == 0 {
            break;
        }
        map.offset_us += f64::from(shift) * period;
    }
    let line = line.ok_or("the presses found in the event rates do not lie on a line")?;
    let mut warnings = Vec::new();
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

    /// Mean activity in the bin-wide interval about `t_us`.
    fn at(&self, t_us: f64) -> f64 {
        self.between(t_us - 0.5 * self.bin_us, t_us + 0.5 * self.bin_us)
    }
}

/// Activity inside the expected spans, and in all of the time that the presses and their surroundings take.
fn inside_and_total(
    activity: &Activity,
    presses: &[PressSpan],
    map: Map,
    margin_us: f64,
) -> (f64, f64) {
    let inside = presses
        .iter()
        .map(|p| activity.between(map.camera(p.contact_us), map.camera(p.release_us)))
        .sum();
    let from = presses.first().map_or(0.0, |p| map.camera(p.contact_us)) - margin_us;
    let to = presses.last().map_or(0.0, |p| map.camera(p.release_us)) + margin_us;
    (inside, activity.between(from, to))
}

fn coarse_offset(activity: &Activity, block: &[PressSpan]) -> f64 {
    let period = period_us(block);
    // Half of the block's presses must lie in the recording.
    let middle = block[block.len() / 2];
    let (first, last) = (block[0].contact_us, block[block.len() - 1].release_us);
    let half = (middle.contact_us - first).max(last - middle.contact_us);
    let low = -(first + half);
    let high = activity.length_us() - last + half;
    let steps = ((high - low) / COARSE_STEP_US).ceil().max(0.0) as u64;
    let mut best = (f64::NEG_INFINITY, low);
    for step in 0..=steps {
        let offset_us = low + step as f64 * COARSE_STEP_US;
        let map = Map {
            offset_us,
            drift: 0.0,
        };
        let (inside, total) = inside_and_total(activity, block, map, period);
        let score = 2.0 * inside - total;
        if score > best.0 {
            best = (score, offset_us);
        }
    }
    best.1
}

/// The shift by whole periods that explains most, and by how many presses it beats the next best.
fn best_shift(activity: &Activity, presses: &[PressSpan], map: Map, period: f64) -> (i32, f64) {
    let (inside, _) = inside_and_total(activity, presses, map, 0.0);
    let unit = (inside / presses.len() as f64).max(f64::MIN_POSITIVE);
    // The same stretch of recording for all shifts, so that what one explains the other must leave over.
    let score = |shift: i32| {
        let trial = |nudge: i32| {
            let moved = Map {
                offset_us: map.offset_us
                    + f64::from(shift) * period
                    + f64::from(nudge) * activity.bin_us,
                ..map
            };
            inside_and_total(activity, presses, moved, 0.0).0
        };
        let nudges = if shift == 0 { 0..=0 } else { -10..=10 };
        nudges.map(trial).fold(f64::NEG_INFINITY, f64::max) / unit
    };
    let scores: Vec<(i32, f64)> = (-SHIFTS..=SHIFTS).map(|s| (s, score(s))).collect();
    let best = scores
        .iter()
        .copied()
        .fold((0, score(0)), |b, s| if s.1 > b.1 { s } else { b });
    let next = scores
        .iter()
        .filter(|s| s.0 != best.0)
        .map(|s| s.1)
        .fold(f64::NEG_INFINITY, f64::max);
    (best.0, best.1 - next)
}

/// Refines offset and drift over blocks of presses that double until they are all in.
fn refine(
    activity: &Activity,
    presses: &[PressSpan],
    mut map: Map,
) -> Result<(Map, Option<line::Line>), String> {
    let mut count = presses.len().min(BLOCK);
    let mut round = 0;
    loop {
        let block = &presses[..count];
        let onset = onset_us(activity, block, map);
        map.offset_us += onset;
        let profile = Profile::new(activity, block, map);
        let lag_us = LAGS_US[round.min(LAGS_US.len() - 1)];
        let pairs = lags(activity, block, map, &profile, lag_us);
        let line = line::fit(&pairs, FLOOR_US).ok_or_else(|| {
            format!(
                "expected at least 3 presses to be visible in the event rates, found {}",
                pairs.len()
            )
        })?;
        map = Map {
            offset_us: line.offset_us,
            drift: line.drift,
        };
        round += 1;
        if count == presses.len() && round >= LAGS_US.len() {
            // Last: the onset once more, now that the presses are well aligned.
            map.offset_us += onset_us(activity, presses, map);
            return Ok((map, Some(line)));
        }
        count = (2 * count).min(presses.len());
    }
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
            for (k, v) in values.iter_mut().enumerate() {
                *v += activity.at(start + k as f64 * activity.bin_us);
            }
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
    let steps = (most_us / activity.bin_us).round() as i64;
    let mut pairs = Vec::new();
    for press in presses {
        let contact = map.camera(press.contact_us);
        let start = contact + profile.from_us;
        // All samples that any lag needs, once.
        let samples: Vec<f64> = (-steps - 1..=steps + profile.values.len() as i64)
            .map(|k| activity.at(start + k as f64 * activity.bin_us))
            .collect();
        let matches: Vec<f64> = (0..=(2 * steps + 2) as usize)
            .map(|lag| {
                template
                    .iter()
                    .zip(&samples[lag.min(samples.len() - template.len())..])
                    .map(|(t, s)| t * s)
                    .sum()
            })
            .collect();
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
        let lag = (best as f64 - 1.0 - steps as f64 + part) * activity.bin_us;
        pairs.push(Pair {
            host_us: press.contact_us,
            camera_us: contact + lag,
        });
    }
    pairs
}
