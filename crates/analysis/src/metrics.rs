//! Localisation metrics: errors over the scored presses, with bootstrap intervals.
//!
//! Intervals are expanded percentile intervals (Hesterberg 2015) of a bootstrap that resamples *locations* with all their
//! repetitions, because presses at one location share its systematic error. Shares of 0 and 1, which no resample changes, get
//! exact binomial intervals over the locations. `tests/analysis/intervals` measures what they cover.

use rayon::prelude::*;
use skinrig_model::{Point2, SkinOutline, quantile as sorted_quantile};

use crate::distributions::{normal_cdf, student_quantile};
use crate::exact;
use crate::result::{Estimate, Metrics, PenalisedRmse};
use crate::seeded;
use crate::sets::{ScoreSet, ScoredPress};
use crate::sums::{self, Sum};

/// Probability outside a 95 % interval on each side.
const TAIL: f64 = 0.025;
/// Fewest locations with an interval of the 95th percentile: with fewer, the largest error is below it with a chance above
/// [`TAIL`], and so may be the whole interval.
const P95_LOCATIONS: usize = 72;
/// Fewest locations with failures for an interval of the RMSE with failures: fewer do not tell how many to expect.
const FAILING_LOCATIONS: usize = 5;
/// Index of the 95th percentile.
const P95: usize = 6;
/// Number of metrics with an interval, in the order of [`Values`].
const COUNT: usize = 10;
/// (value, n) of each metric: rmse, x, y, bias x, bias y, median, p95, repeat std, located rate, within
/// rate.
type Values = [(Option<f64>, u32); COUNT];
/// Indices of the shares.
const SHARES: [usize; 2] = [8, 9];

/// Presses whose estimates count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exclusions {
    /// Valid presses only.
    Applied,
    /// Every press with an estimate, whatever its verdict.
    Ignored,
}

/// The presses of one location.
struct LocationErrors {
    attempted: u32,
    within: u32,
    /// Sums of x², y², x and y of the errors.
    totals: [f64; 4],
    lengths: Vec<f64>,
    /// Standard deviation between repetitions, for each depth with at least two.
    repeat_std: Vec<f64>,
}

/// Metrics of `set` on a skin with this outline, with `resamples` bootstrap samples from `seed`.
#[must_use]
pub fn metrics(
    set: &ScoreSet,
    exclusions: Exclusions,
    outline: &SkinOutline,
    within_mm: f64,
    resamples: u32,
    seed: u64,
) -> Metrics {
    let places = places(set, exclusions, within_mm);
    let all: Vec<&LocationErrors> = places.iter().collect();
    let values = evaluate(&all);
    let intervals = bootstrap(&places, resamples, seed);
    let estimate = |k: usize| {
        let (value, n) = values[k];
        let ends = value.zip(intervals[k]).map(|(value, ends)| {
            if SHARES.contains(&k) {
                exact::share(value, places.len(), ends)
            } else {
                ends
            }
        });
        Estimate {
            value,
            low: ends.map(|e| e.0),
            high: ends.map(|e| e.1),
            n,
        }
    };
    let rmse_mm = estimate(0);
    Metrics {
        rmse_mm,
        rmse_x_mm: estimate(1),
        rmse_y_mm: estimate(2),
        bias_x_mm: estimate(3),
        bias_y_mm: estimate(4),
        median_mm: estimate(5),
        p95_mm: estimate(6),
        repeat_std_mm: estimate(7),
        located_rate: estimate(8),
        within_rate: estimate(9),
        rmse_diagonal_percent: rmse_mm.value.map(|r| 100.0 * r / outline.diagonal_mm()),
    }
}

fn places(set: &ScoreSet, exclusions: Exclusions, within_mm: f64) -> Vec<LocationErrors> {
    let mut presses: Vec<&ScoredPress> = set.presses().iter().collect();
    presses.sort_by_key(|p| p.location);
    presses
        .chunk_by(|a, b| a.location == b.location)
        .map(|group| place(group, exclusions, within_mm))
        .collect()
}

fn place(group: &[&ScoredPress], exclusions: Exclusions, within_mm: f64) -> LocationErrors {
    let counts = |p: &ScoredPress| exclusions == Exclusions::Ignored || p.valid;
    let mut found: Vec<_> = group
        .iter()
        .filter(|p| counts(p))
        .filter_map(|p| p.found.map(|(at, error)| (p.depth_mm, at, error)))
        .collect();
    let errors: Vec<[f64; 2]> = found.iter().map(|(.., e)| *e).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let repeat_std = found
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|repeats| repeats.len() >= 2)
        .map(|repeats| {
            let n = repeats.len() as f64;
            spread_mm(repeats.iter().map(|(_, at, _)| *at)) * (n / (n - 1.0)).sqrt()
        })
        .collect();
    let lengths: Vec<f64> = errors.iter().map(|e| libm::hypot(e[0], e[1])).collect();
    let total = |f: fn(&[f64; 2]) -> f64| sums::sum(errors.iter().map(f));
    LocationErrors {
        totals: [
            total(|e| e[0] * e[0]),
            total(|e| e[1] * e[1]),
            total(|e| e[0]),
            total(|e| e[1]),
        ],
        attempted: group.len() as u32,
        within: lengths.iter().filter(|e| **e <= within_mm).count() as u32,
        lengths,
        repeat_std,
    }
}

fn evaluate(places: &[&LocationErrors]) -> Values {
    let mut totals = [Sum::default(); 4];
    let mut std_sum = Sum::default();
    let mut lengths = Vec::new();
    let (mut attempted, mut within, mut stds) = (0u32, 0u32, 0u32);
    for place in places {
        attempted += place.attempted;
        within += place.within;
        lengths.extend_from_slice(&place.lengths);
        for (sum, term) in totals.iter_mut().zip(place.totals) {
            sum.add(term);
        }
        stds += place.repeat_std.len() as u32;
        place.repeat_std.iter().for_each(|s| std_sum.add(*s));
    }
    let n = lengths.len() as u32;
    let [xx, yy, x, y] = totals.map(|s| s.total() / f64::from(n));
    let some = |value: f64| (n > 0).then_some(value);
    [
        (some((xx + yy).sqrt()), n),
        (some(xx.sqrt()), n),
        (some(yy.sqrt()), n),
        (some(x), n),
        (some(y), n),
        (quantile(&mut lengths, 0.5), n),
        (quantile(&mut lengths, 0.95), n),
        ((stds > 0).then(|| std_sum.total() / f64::from(stds)), stds),
        (
            (attempted > 0).then(|| f64::from(n) / f64::from(attempted)),
            attempted,
        ),
        (
            (attempted > 0).then(|| f64::from(within) / f64::from(attempted)),
            attempted,
        ),
    ]
}

/// RMSE of all attempted presses of `set` with failures counted. A failed press (one without a counting estimate) counts the
/// penalty, or its own error if it has an estimate with a larger error.
///
/// The penalty is `stated_mm`, or the RMS distance of the attempted presses' true (or planned) positions from their mean,
/// which is the error of a blind guess. It is never below the RMSE of the counting presses, nor below that of all presses
/// with an estimate. Therefore counting failures never lowers the RMSE, whatever is excluded.
#[must_use]
pub fn penalised(
    set: &ScoreSet,
    stated_mm: Option<f64>,
    resamples: u32,
    seed: u64,
) -> PenalisedRmse {
    let presses = set.presses();
    let stated = stated_mm.unwrap_or_else(|| spread_mm(presses.iter().map(|p| p.at)));
    let length = |p: &ScoredPress| p.found.map(|(_, [dx, dy])| libm::hypot(dx, dy));
    let rms = |of: &dyn Fn(&&ScoredPress) -> bool| {
        sums::root_mean_square(presses.iter().filter(of).filter_map(length)).unwrap_or(0.0)
    };
    let penalty = stated.max(rms(&|_| true)).max(rms(&|p| p.valid));
    let error = |p: &ScoredPress| match length(p) {
        Some(own) if p.valid => own,
        Some(own) => own.max(penalty),
        None => penalty,
    };
    let errors: Vec<(u32, f64)> = presses.iter().map(|p| (p.location, error(p))).collect();
    let failures = || presses.iter().filter(|p| !p.valid || p.found.is_none());
    let beyond = failures().filter(|p| length(p).is_some_and(|own| own > penalty));
    let mut failing: Vec<u32> = failures().map(|p| p.location).collect();
    failing.sort_unstable();
    failing.dedup();
    let mut rmse_mm = bootstrap_over_locations(&errors, resamples, seed, root_mean_square);
    if failing.len() < FAILING_LOCATIONS {
        (rmse_mm.low, rmse_mm.high) = (None, None);
    }
    PenalisedRmse {
        penalty_mm: penalty,
        derived: stated_mm.is_none(),
        raised: penalty > stated,
        failures: failures().count() as u32,
        beyond_penalty: beyond.count() as u32,
        rmse_mm,
    }
}

/// Root mean square distance of points from their mean, mm; 0 without points.
pub(crate) fn spread_mm(points: impl Iterator<Item = Point2> + Clone) -> f64 {
    let variance = |f: fn(Point2) -> f64| sums::variance(points.clone().map(f)).unwrap_or(0.0);
    (variance(|p| p.x_mm) + variance(|p| p.y_mm)).sqrt()
}

/// Root mean square; `None` without values.
pub(crate) fn root_mean_square(values: &mut [f64]) -> Option<f64> {
    sums::root_mean_square(values.iter().copied())
}

/// Arithmetic mean; `None` without values.
pub(crate) fn mean(values: &mut [f64]) -> Option<f64> {
    sums::mean(values.iter().copied())
}

/// Mean of all values, with the expanded percentile interval of a bootstrap over whole locations. Each value comes with its
/// location, in any order.
#[must_use]
pub fn mean_over_locations(values: &[(u32, f64)], resamples: u32, seed: u64) -> Estimate {
    bootstrap_over_locations(values, resamples, seed, mean)
}

/// `statistic` of all values, with the expanded percentile interval of a bootstrap over whole locations. Each value comes
/// with its location, in any order; `statistic` may reorder its input.
pub(crate) fn bootstrap_over_locations(
    values: &[(u32, f64)],
    resamples: u32,
    seed: u64,
    statistic: fn(&mut [f64]) -> Option<f64>,
) -> Estimate {
    let mut sorted = values.to_vec();
    sorted.sort_by_key(|v| v.0);
    let places: Vec<Vec<f64>> = sorted
        .chunk_by(|a, b| a.0 == b.0)
        .map(|group| group.iter().map(|v| v.1).collect())
        .collect();
    let mut all: Vec<f64> = sorted.iter().map(|v| v.1).collect();
    let value = statistic(&mut all);
    let (mut low, mut high) = (None, None);
    if value.is_some() && places.len() > 1 && resamples > 1 {
        let mut samples: Vec<f64> = (0..resamples)
            .into_par_iter()
            .filter_map(|sample| {
                let mut rng = seeded::generator(seed, u64::from(sample));
                let mut drawn = Vec::with_capacity(values.len() + 8);
                for _ in 0..places.len() {
                    drawn.extend_from_slice(&places[seeded::index(&mut rng, places.len())]);
                }
                statistic(&mut drawn)
            })
            .collect();
        let tail = tail(places.len());
        low = quantile(&mut samples, tail);
        high = quantile(&mut samples, 1.0 - tail);
    }
    Estimate {
        value,
        low,
        high,
        n: values.len() as u32,
    }
}

/// Share of values that are true, each with its location: interval over locations, exact for 0 and 1.
#[must_use]
pub fn share_over_locations(values: &[(u32, bool)], resamples: u32, seed: u64) -> Estimate {
    let numbers: Vec<(u32, f64)> = values
        .iter()
        .map(|(location, is)| (*location, f64::from(u8::from(*is))))
        .collect();
    let mut share = bootstrap_over_locations(&numbers, resamples, seed, mean);
    if let (Some(value), Some(low), Some(high)) = (share.value, share.low, share.high) {
        let mut locations: Vec<u32> = values.iter().map(|v| v.0).collect();
        locations.sort_unstable();
        locations.dedup();
        let ends = exact::share(value, locations.len(), (low, high));
        (share.low, share.high) = (Some(ends.0), Some(ends.1));
    }
    share
}

fn bootstrap(places: &[LocationErrors], resamples: u32, seed: u64) -> [Option<(f64, f64)>; COUNT] {
    if places.len() < 2 || resamples < 2 {
        return [None; COUNT];
    }
    let samples: Vec<Values> = (0..resamples)
        .into_par_iter()
        .map(|sample| {
            let mut rng = seeded::generator(seed, u64::from(sample));
            let drawn: Vec<&LocationErrors> = (0..places.len())
                .map(|_| &places[seeded::index(&mut rng, places.len())])
                .collect();
            evaluate(&drawn)
        })
        .collect();
    let tail = tail(places.len());
    std::array::from_fn(|k| {
        if k == P95 && places.len() < P95_LOCATIONS {
            return None;
        }
        let mut values: Vec<f64> = samples.iter().filter_map(|s| s[k].0).collect();
        Some((
            quantile(&mut values, tail)?,
            quantile(&mut values, 1.0 - tail)?,
        ))
    })
}

/// Probability outside the percentile interval of a bootstrap over so many locations on each side. Percentiles at
/// [`TAIL`] are too narrow, as a normal interval is that ignores that its scale is estimated and divides by n instead of n - 1.
pub(crate) fn tail(places: usize) -> f64 {
    let n = places.max(2) as f64;
    let wider = student_quantile(1.0 - TAIL, n - 1.0) * (n / (n - 1.0)).sqrt();
    normal_cdf(-wider)
}

/// [`sorted_quantile`] of values in any order, in linear time; `None` without values. Reorders `values`.
pub(crate) fn quantile(values: &mut [f64], q: f64) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let position = q * (values.len() - 1) as f64;
    let index = position.floor() as usize;
    let (_, &mut low, above) = values.select_nth_unstable_by(index, f64::total_cmp);
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    sorted_quantile(&[low, high], position - index as f64)
}
