//! Splits a mean square error into parts and attributes the change of each part to factors.

use super::factor::Factor;
use super::presses::{PressFactors, SkinPresses};

/// Smaller changes of ln(cluster excess) count as no change.
const MIN_EXCESS: f64 = 0.05;

/// A bias below this share of scatter + bias is indistinguishable from zero.
const MIN_BIAS: f64 = 0.05;

/// Same order as [`ChangeParts::by_factor`].
pub(super) const FACTORS: [Factor; 7] = [
    Factor::Settings,
    Factor::Calibration,
    Factor::Robot,
    Factor::Signal,
    Factor::Noise,
    Factor::Spread,
    Factor::Skin,
];

/// Change of the mean square error and its parts, mm².
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ChangeParts {
    pub mse: [f64; 2],
    pub change: f64,
    /// Indexed like [`FACTORS`]; adds up to `change`.
    pub by_factor: [f64; FACTORS.len()],
}

/// Error budget of one skin under one set of analysis settings, mm² unless stated.
#[derive(Debug, Clone, Copy)]
struct ErrorBudget {
    mse: f64,
    calibration: f64,
    robot: f64,
    /// Variance between repetitions at one location, and the error that all repetitions at a location share.
    scatter: f64,
    bias: f64,
    /// Natural logarithms of 1 / n, w², q and the idle event rate.
    per_event: f64,
    width2: f64,
    excess: f64,
    idle: f64,
}

/// Attributes the change from the first to the second skin to factors. With two variants (settings of the first skin,
/// settings of the second) both are averaged, and the remainder is the contribution of the settings.
pub(super) fn contributions(variants: &[[SkinPresses; 2]], locations: &[usize]) -> ChangeParts {
    let budgets: Vec<[ErrorBudget; 2]> = variants
        .iter()
        .map(|pair| {
            [
                error_budget(&pair[0], locations),
                error_budget(&pair[1], locations),
            ]
        })
        .collect();
    let mse = [budgets[0][0].mse, budgets[budgets.len() - 1][1].mse];
    let mut parts = ChangeParts {
        mse,
        change: mse[1] - mse[0],
        ..ChangeParts::default()
    };
    for pair in &budgets {
        for (sum, part) in parts.by_factor.iter_mut().zip(split_change(pair)) {
            *sum += part / budgets.len() as f64;
        }
    }
    parts.by_factor[0] = parts.change - parts.by_factor.iter().skip(1).sum::<f64>();
    if budgets.len() == 1 {
        // Only rounding errors remain.
        parts.by_factor[0] = 0.0;
    }
    parts
}

fn error_budget(of: &SkinPresses, locations: &[usize]) -> ErrorBudget {
    let presses: Vec<&PressFactors> = locations.iter().flat_map(|i| of.at(*i)).collect();
    let n = presses.len() as f64;
    let mean = |value: &dyn Fn(&PressFactors) -> f64| {
        let values = presses.iter().map(|o| value(o)).filter(|v| v.is_finite());
        let (sum, count) = values.fold((0.0, 0.0), |(s, c), v| (s + v, c + 1.0));
        sum / count
    };
    let square = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
    let mse = mean(&|o| square(o.used));
    let fitted = mean(&|o| square(o.fitted));
    let centre = |of: fn(&PressFactors) -> [f64; 2]| [mean(&|o| of(o)[0]), mean(&|o| of(o)[1])];
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
    // Ground-truth errors shift position errors in the opposite direction, so a positive slope is chance.
    let slope = slope.min(0.0);
    let robot = slope * slope * alone / n;
    let left = |o: &PressFactors| [0, 1].map(|k| o.fitted[k] - slope * (o.off_plan[k] - off[k]));
    let scatter = scatter(of, locations, left);
    let (per_event, width2, cluster) = (
        mean(&|o| o.per_event),
        mean(&|o| o.width2),
        mean(&|o| o.cluster),
    );
    // The scatter of calibration presses propagates into the fit; count that share as scatter.
    let calibration = mse - fitted;
    let by_scatter = (of.calibration_cost() * scatter).min(calibration).max(0.0);
    let bias = fitted - robot - scatter;
    let scatter = scatter + by_scatter;
    let calibration = calibration - by_scatter;
    ErrorBudget {
        mse,
        calibration,
        robot,
        scatter,
        bias,
        per_event: libm::log(per_event),
        width2: libm::log(width2),
        excess: libm::log(cluster / (width2 * per_event)),
        idle: libm::log(mean(&|o| o.idle_per_s).max(1.0)),
    }
}

/// Pooled variance of errors between repetitions at one location, summed over both axes; 0 without repetitions.
fn scatter(
    of: &SkinPresses,
    locations: &[usize],
    error: impl Fn(&PressFactors) -> [f64; 2],
) -> f64 {
    let (mut sum, mut freedom) = (0.0, 0.0);
    for presses in locations.iter().map(|i| of.at(*i)).filter(|p| p.len() > 1) {
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

fn split_change(pair: &[ErrorBudget; 2]) -> [f64; FACTORS.len()] {
    let [a, b] = pair;
    let logs = LogChanges::between(a, b);
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
    let over = libm::log(b.scatter / a.scatter) - direct.iter().sum::<f64>();
    let more = attribute(over, &reach, 1.0);
    let of_scatter = parts(a.scatter, b.scatter, [0, 1, 2].map(|i| direct[i] + more[i]));
    let bias = [a, b].map(|t| t.bias.max(MIN_BIAS * (t.scatter + t.bias)));
    let log = libm::log(bias[1] / bias[0]);
    let of_bias = attribute(log, &reach, 2.0).map(|part| {
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

/// Changes of logarithms between two skins; 0 for a quantity that was not measured.
struct LogChanges {
    /// Change of ln(1 / events).
    events: f64,
    /// Change of ln(width²).
    width: f64,
    /// Change of ln(cluster excess), split by what changed the noise per event.
    excess_by_signal: f64,
    excess_by_noise: f64,
    /// Change of ln(noise per event), split by what changed it; 0 where noise does not join clusters.
    pull_by_signal: f64,
    pull_by_noise: f64,
}

impl LogChanges {
    fn between(a: &ErrorBudget, b: &ErrorBudget) -> Self {
        let known = |v: f64| if v.is_finite() { v } else { 0.0 };
        let events = known(b.per_event - a.per_event);
        let idle = known(b.idle - a.idle);
        let excess = known(b.excess - a.excess);
        // The excess follows the noise per event, so the factor that changed the noise per event gets it. A factor that
        // moved the other way gets none.
        let ratio = events + idle;
        let share = |part: f64| (part * ratio).max(0.0);
        let all = share(events) + share(idle);
        let joins = all > 0.0 && excess * ratio > 0.0 && excess.abs() > MIN_EXCESS;
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

/// Splits a change of a logarithm among the factors with the same sign, in proportion to their own change `reach`. In total
/// they get at most `times` their reach.
fn attribute(log: f64, reach: &[f64; 3], times: f64) -> [f64; 3] {
    let along = reach.map(|r| if r * log > 0.0 { r } else { 0.0 });
    let all: f64 = along.iter().sum();
    if all == 0.0 || !log.is_finite() {
        return [0.0; 3];
    }
    let share = (log / all).min(times);
    along.map(|r| share * r)
}

/// (a - b) / ln(a / b); `a` when both are equal.
fn logarithmic_mean(a: f64, b: f64) -> f64 {
    let ratio = libm::log(b / a);
    if ratio.abs() < 1e-9 {
        a
    } else {
        (b - a) / ratio
    }
}

/// Seeded bootstrap draws of `n` locations with replacement.
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
