//! Owns the arithmetic of the causes: parts of a mean square error, and the change of each.

use super::factor::Factor;
use super::presses::{One, Pressed};

/// A change of the logarithm of the clusters' excess that is none.
const LEAST_EXCESS: f64 = 0.05;

/// A bias smaller than this share of what is left is not told from none.
const LEAST_BIAS: f64 = 0.05;

/// In the order of [`Parts::of`].
pub(super) const FACTORS: [Factor; 7] = [
    Factor::Settings,
    Factor::Calibration,
    Factor::Robot,
    Factor::Signal,
    Factor::Noise,
    Factor::Spread,
    Factor::Skin,
];

/// The change of a mean square error, and what carries it, mm².
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Parts {
    pub mse: [f64; 2],
    pub change: f64,
    /// By factor; adds up to `change`.
    pub of: [f64; FACTORS.len()],
}

/// One skin in one world.
#[derive(Debug, Clone, Copy)]
struct Taken {
    mse: f64,
    calibration: f64,
    robot: f64,
    /// What is left between repetitions at one place, and what stays at a place.
    scatter: f64,
    bias: f64,
    /// Logarithms of 1 / n, w², q and of the noise.
    per_event: f64,
    width2: f64,
    excess: f64,
    idle: f64,
}

/// What carries the change from the first to the second skin. With two worlds (the settings of the first, those of the
/// second) the mean of both counts, and what is left is the settings'.
pub(super) fn contributions(worlds: &[[Pressed; 2]], places: &[usize]) -> Parts {
    let taken: Vec<[Taken; 2]> = worlds
        .iter()
        .map(|pair| [take(&pair[0], places), take(&pair[1], places)])
        .collect();
    let mse = [taken[0][0].mse, taken[taken.len() - 1][1].mse];
    let mut parts = Parts {
        mse,
        change: mse[1] - mse[0],
        ..Parts::default()
    };
    for pair in &taken {
        for (sum, part) in parts.of.iter_mut().zip(change(pair)) {
            *sum += part / taken.len() as f64;
        }
    }
    parts.of[0] = parts.change - parts.of.iter().skip(1).sum::<f64>();
    if taken.len() == 1 {
        // Nothing but rounding is left.
        parts.of[0] = 0.0;
    }
    parts
}

fn take(of: &Pressed, places: &[usize]) -> Taken {
    let presses: Vec<&One> = places.iter().flat_map(|i| of.at(*i)).collect();
    let n = presses.len() as f64;
    let mean = |value: &dyn Fn(&One) -> f64| {
        let values = presses.iter().map(|o| value(o)).filter(|v| v.is_finite());
        let (sum, count) = values.fold((0.0, 0.0), |(s, c), v| (s + v, c + 1.0));
        sum / count
    };
    let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
    let mse = mean(&|o| square(o.used));
    let fitted = mean(&|o| square(o.fitted));
    let centre = |of: fn(&One) -> [f64; 2]| [mean(&|o| of(o)[0]), mean(&|o| of(o)[1])];
    let (error, off) = (centre(|o| o.fitted), centre(|o| o.off_plan));
    let (mut together, mut alone) = (0.0, 0.0);
    for o in &presses {
        for k in 0..2 {
            let d = o.off_plan[k] - off[k];
            together += d * (o.fitted[k] - error[k]);
            alone += d * d;
        }
    }
    let slope = if alone > 0.0 { together / alone } else { 0.0 };
    // A truth that errs pulls errors the other way: a slope above 0 is chance.
    let slope = slope.min(0.0);
    let robot = slope * slope * alone / n;
    let left = |o: &One| [0, 1].map(|k| o.fitted[k] - slope * (o.off_plan[k] - off[k]));
    let scatter = scatter(of, places, left);
    let (per_event, width2, cluster) = (
        mean(&|o| o.per_event),
        mean(&|o| o.width2),
        mean(&|o| o.cluster),
    );
    // What the scatter of the calibrating presses costs a fit is the scatter's.
    let calibration = mse - fitted;
    let by_scatter = (of.calibration_cost() * scatter).min(calibration).max(0.0);
    let bias = fitted - robot - scatter;
    let scatter = scatter + by_scatter;
    let calibration = calibration - by_scatter;
    Taken {
        mse,
        calibration,
        robot,
        scatter,
        bias,
        per_event: per_event.ln(),
        width2: width2.ln(),
        excess: (cluster / (width2 * per_event)).ln(),
        idle: mean(&|o| o.idle_per_s).max(1.0).ln(),
    }
}

/// Variance of errors between repetitions at one place, both axes together, pooled over places; 0 where nothing was repeated.
fn scatter(of: &Pressed, places: &[usize], error: impl Fn(&One) -> [f64; 2]) -> f64 {
    let (mut sum, mut freedom) = (0.0, 0.0);
    for presses in places.iter().map(|i| of.at(*i)).filter(|p| p.len() > 1) {
        let n = presses.len() as f64;
        freedom += n - 1.0;
        for k in 0..2 {
            let mean = presses.iter().map(|o| error(o)[k]).sum::<f64>() / n;
            sum += presses
                .iter()
                .map(|o| (error(o)[k] - mean).powi(2))
                .sum::<f64>();
        }
    }
    if freedom > 0.0 { sum / freedom } else { 0.0 }
}

fn change(pair: &[Taken; 2]) -> [f64; FACTORS.len()] {
    let [a, b] = pair;
    let logs = Logs::between(a, b);
    let parts = |from: f64, to: f64, logs: [f64; 3]| {
        let known = from > 0.0 && to > 0.0;
        logs.map(|log| {
            if known {
                logarithmic_mean(from, to) * log
            } else {
                0.0
            }
        })
    };
    let reach = [
        logs.events + logs.pull_by_signal,
        logs.pull_by_noise,
        logs.width,
    ];
    let direct = [
        logs.events + logs.excess_by_signal,
        logs.excess_by_noise,
        logs.width,
    ];
    let over = (b.scatter / a.scatter).ln() - direct.iter().sum::<f64>();
    let more = carried(over, &reach, 1.0);
    let of_scatter = parts(a.scatter, b.scatter, [0, 1, 2].map(|i| direct[i] + more[i]));
    let bias = [a, b].map(|t| t.bias.max(LEAST_BIAS * (t.scatter + t.bias)));
    let log = (bias[1] / bias[0]).ln();
    let of_bias = carried(log, &reach, 2.0).map(|part| {
        let share = if log.abs() > 1e-9 { part / log } else { 0.0 };
        share * (b.bias - a.bias)
    });
    let [signal, noise, spread] = [0, 1, 2].map(|i| of_scatter[i] + of_bias[i]);
    let rest = b.scatter + b.bias - a.scatter - a.bias;
    [
        0.0,
        b.calibration - a.calibration,
        b.robot - a.robot,
        signal,
        noise,
        spread,
        rest - signal - noise - spread,
    ]
}

/// Changes of logarithms; 0 for what was not measured.
struct Logs {
    /// Of 1 / events.
    events: f64,
    /// Of the squared width.
    width: f64,
    /// Of the excess of the clusters, by who changed the noise per event.
    excess_by_signal: f64,
    excess_by_noise: f64,
    /// Of the noise per event, by who changed it, where it joins the clusters.
    pull_by_signal: f64,
    pull_by_noise: f64,
}

impl Logs {
    fn between(a: &Taken, b: &Taken) -> Self {
        let known = |v: f64| if v.is_finite() { v } else { 0.0 };
        let events = known(b.per_event - a.per_event);
        let idle = known(b.idle - a.idle);
        let excess = known(b.excess - a.excess);
        // The excess follows the noise per event: who changed that carries it. What goes against it carries none.
        let ratio = events + idle;
        let share = |part: f64| (part * ratio).max(0.0);
        let all = share(events) + share(idle);
        let joins = all > 0.0 && excess * ratio > 0.0 && excess.abs() > LEAST_EXCESS;
        let of = |whole: f64, part: f64| {
            if joins {
                whole * share(part) / all
            } else {
                0.0
            }
        };
        Self {
            events,
            width: known(b.width2 - a.width2),
            excess_by_signal: of(excess, events),
            excess_by_noise: of(excess, idle),
            pull_by_signal: of(ratio, events),
            pull_by_noise: of(ratio, idle),
        }
    }
}

/// What of a change of a logarithm factors carry that changed by `reach`: those that go its way, in proportion, altogether at
/// most so many times their reach.
fn carried(log: f64, reach: &[f64; 3], times: f64) -> [f64; 3] {
    let along = reach.map(|r| if r * log > 0.0 { r } else { 0.0 });
    let all: f64 = along.iter().sum();
    if all == 0.0 || !log.is_finite() {
        return [0.0; 3];
    }
    let share = (log / all).min(times);
    along.map(|r| share * r)
}

/// (a - b) / ln(a / b); a where they are equal.
fn logarithmic_mean(a: f64, b: f64) -> f64 {
    let ratio = (b / a).ln();
    if ratio.abs() < 1e-9 {
        a
    } else {
        (b - a) / ratio
    }
}

/// Seeded draws of `n` places with replacement.
pub(super) fn draws(n: usize, resamples: u32, seed: u64) -> impl Iterator<Item = Vec<usize>> {
    // SplitMix64 (Steele, Lea and Flood 2014).
    let mut state = seed;
    let mut next = move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    (0..resamples).map(move |_| {
        (0..n)
            .map(|_| ((u128::from(next()) * n as u128) >> 64) as usize)
            .collect()
    })
}

#[cfg(test)]
mod tests;
