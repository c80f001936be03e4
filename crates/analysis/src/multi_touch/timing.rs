//! When the touches of a press end in one camera, and how likely each difference of their ends is.

use super::mixture::Mixture;
use super::profile::Profile;
use super::sight::{TouchSight, bin};

/// Step of the times, ms.
const STEP_MS: f64 = 0.25;
/// Time before the first and after the last end that decides about them, ms.
const NEAR_MS: usize = 15;
/// Least rate of a touch, events/ms.
const LEAST_RATE: f64 = 1e-3;
/// Differences of ends up to this are considered, ms.
const LONGEST_MS: f64 = 100.0;
const LAGS: usize = (2.0 * LONGEST_MS / STEP_MS) as usize + 1;
/// How far the same end may be apart in two cameras, ms (standard deviation).
const TOLERANCE_MS: f64 = 0.35;

/// Log likelihood of the ends of the two touches, and of their difference, from [`-LONGEST_MS`](LONGEST_MS) on.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ends {
    /// First time, ms, and number of times of the table.
    from_ms: f64,
    times: usize,
    /// `table[i * times + k]`: touch 1 ends at time `i`, touch 2 at time `k`.
    table: Vec<f64>,
    lags: Vec<f64>,
}

impl Ends {
    /// Of the touches in one camera; `None` unless there are two.
    pub(super) fn new(profile: &Profile, sight: &TouchSight, mixture: &Mixture) -> Option<Self> {
        let [one, two] = mixture.components.as_slice() else {
            return None;
        };
        let from = (sight.times.turn_ms - sight.times.from_ms).max(0.0) as usize;
        let falls = [one, two].map(|c| Fall::of(&c.course, from));
        let first = falls[0].at.min(falls[1].at).saturating_sub(NEAR_MS);
        let last = falls[0].at.max(falls[1].at) + NEAR_MS;
        let from_ms = sight.times.from_ms + first as f64;
        let steps = ((last - first) as f64 / STEP_MS) as usize;
        let templates = [one, two].map(|c| profile.template(c.mean, c.width));
        let sums = prefix_sums(sight, &templates, &falls, from_ms, steps);
        let mut lags = vec![f64::NEG_INFINITY; LAGS];
        let mut table = Vec::with_capacity((steps + 1) * (steps + 1));
        for i in 0..=steps {
            for k in 0..=steps {
                let (first, last) = (i.min(k), i.max(k));
                let between = if i < k { 1 } else { 2 };
                let nats = sums[first][0] + sums[last][between] - sums[first][between]
                    + sums[steps][3]
                    - sums[last][3];
                let lag = i + LAGS / 2;
                if let Some(at) = lag.checked_sub(k).and_then(|l| lags.get_mut(l)) {
                    *at = at.max(nats);
                }
                table.push(nats);
            }
        }
        Some(Self {
            from_ms,
            times: steps + 1,
            table,
            lags: tolerant(&lags),
        })
    }

    /// Likeliest ends of both touches, in the order of camera 1, if camera 2 has them in the same or the other order, ms.
    pub(super) fn together(one: &Self, two: &Self, crossed: bool) -> Option<[f64; 2]> {
        let offset = ((two.from_ms - one.from_ms) / STEP_MS).round() as isize;
        let second = |i: usize, k: usize| {
            let [i, k] = [i, k].map(|t| usize::try_from(t as isize - offset).ok());
            let (i, k) = i.zip(k).filter(|(i, k)| *i.max(k) < two.times)?;
            let at = if crossed {
                k * two.times + i
            } else {
                i * two.times + k
            };
            two.table.get(at)
        };
        let mut best = (f64::NEG_INFINITY, None);
        for (at, nats) in one.table.iter().enumerate() {
            let (i, k) = (at / one.times, at % one.times);
            if let Some(more) = second(i, k)
                && nats + more > best.0
            {
                best = (nats + more, Some([i, k]));
            }
        }
        best.1.map(|t| t.map(|k| one.from_ms + k as f64 * STEP_MS))
    }

    /// Log odds that the touches end in the same order in both cameras.
    pub(super) fn odds(one: &Self, two: &Self) -> f64 {
        let best = |crossed: bool| {
            let second = |k: usize| two.lags[if crossed { LAGS - 1 - k } else { k }];
            let sums = one.lags.iter().enumerate().map(|(k, a)| a + second(k));
            sums.fold(f64::NEG_INFINITY, f64::max)
        };
        let odds = best(false) - best(true);
        if odds.is_nan() { 0.0 } else { odds }
    }
}

/// Log likelihood with the tolerance: each difference may stand for one nearby.
fn tolerant(lags: &[f64]) -> Vec<f64> {
    let cost = 0.5 * STEP_MS * STEP_MS / (2.0 * TOLERANCE_MS * TOLERANCE_MS);
    let reach = |k: usize| {
        let off = |i: usize| cost * (i.abs_diff(k) * i.abs_diff(k)) as f64;
        let each = lags.iter().enumerate();
        each.map(|(i, nats)| nats - off(i))
            .fold(f64::NEG_INFINITY, f64::max)
    };
    (0..lags.len()).map(reach).collect()
}

/// Sums of the log likelihood of a camera's events over time, in each state of the touches; bit `k` of a state: touch `k` has ended.
fn prefix_sums(
    sight: &TouchSight,
    templates: &[Vec<f64>; 2],
    falls: &[Fall; 2],
    from_ms: f64,
    steps: usize,
) -> Vec<[f64; 4]> {
    let mut sums = vec![[0.0; 4]; steps + 1];
    let rate = |state: usize, k: usize| falls[k].rates[(state >> k) & 1];
    for e in &sight.events {
        let step = (e.t_ms - from_ms) / STEP_MS;
        if step < 0.0 || step >= steps as f64 {
            continue;
        }
        let bin = bin(e.x);
        for (state, sum) in sums[step as usize + 1].iter_mut().enumerate() {
            let rates = [0, 1].map(|k| rate(state, k) * templates[k][bin]);
            *sum += libm::log(sight.idle[bin] + rates[0] + rates[1]);
        }
    }
    let mut before = [0.0; 4];
    for row in sums.iter_mut().skip(1) {
        for (state, sum) in row.iter_mut().enumerate() {
            *sum += before[state] - STEP_MS * (rate(state, 0) + rate(state, 1));
        }
        before = *row;
    }
    sums
}

/// The largest fall of a touch's rate after the turn.
#[derive(Debug, Clone, Copy)]
struct Fall {
    /// Index in the course.
    at: usize,
    /// Events/ms before and after.
    rates: [f64; 2],
}

impl Fall {
    fn of(course: &[f64], from: usize) -> Self {
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len().max(1) as f64;
        let mut fall = Self {
            at: from,
            rates: [LEAST_RATE; 2],
        };
        let mut most = 0.0;
        for at in from..course.len() {
            let before = mean(&course[at.saturating_sub(NEAR_MS)..at]);
            let after = mean(&course[at..(at + NEAR_MS).min(course.len())]);
            if before - after > most {
                most = before - after;
                let rates = [before.max(LEAST_RATE), after.max(LEAST_RATE)];
                fall = Self { at, rates };
            }
        }
        fall
    }
}
