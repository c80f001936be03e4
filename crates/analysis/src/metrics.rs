//! Localisation metrics: errors over the scored presses, with intervals over locations.
//!
//! Each metric has the interval that comparisons of skins use (`skinrig_statistics`): bootstrap-t for means and mean squares,
//! score limits for shares, ranks for percentiles. They resample or count whole *locations*, because presses at one location
//! share its systematic error. `tests/analysis/intervals` measures what they cover.

use skinrig_model::{Point2, SkinOutline, quantile as sorted_quantile};
use skinrig_statistics::{Position, Sample, SampleFault};

use crate::over_locations::Draws;
pub use crate::over_locations::{mean_over_locations, rms_over_locations, share_over_locations};
use crate::result::{Estimate, Metrics, PenalisedRmse};
use crate::sets::{ScoreSet, ScoredPress};
use crate::sums;

/// Presses whose estimates count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Exclusions {
    /// Valid presses only.
    Applied,
    /// Every press with an estimate, whatever its verdict.
    Ignored,
}

/// Metrics of `set` on a skin with this outline; intervals from `resamples` bootstrap samples from `seed`, none for fewer than 39.
#[must_use]
pub fn metrics(
    set: &ScoreSet,
    exclusions: Exclusions,
    outline: &SkinOutline,
    within_mm: f64,
    resamples: u32,
    seed: u64,
) -> Metrics {
    let counts = |p: &&ScoredPress| exclusions == Exclusions::Ignored || p.valid;
    let located: Vec<(&ScoredPress, [f64; 2])> = (set.presses().iter().filter(counts))
        .filter_map(|p| Some((p, p.found?.1)))
        .collect();
    let errors = |of: fn([f64; 2]) -> f64| -> Vec<(u32, f64)> {
        let each = located.iter();
        each.map(|(p, error)| (p.location, of(*error))).collect()
    };
    let lengths = errors(|[x, y]| libm::hypot(x, y));
    let share = |of: &dyn Fn(f64) -> bool| {
        let trials: Vec<(u32, bool)> = (set.presses().iter())
            .map(|p| {
                let found = p.found.filter(|_| counts(&p));
                let is = found.is_some_and(|(_, [x, y])| of(libm::hypot(x, y)));
                (p.location, is)
            })
            .collect();
        share_over_locations(&trials, resamples, seed)
    };
    let draws = Draws { resamples, seed };
    let percentile = |q: f64, sample: Sampling| {
        let mut values: Vec<f64> = lengths.iter().map(|l| l.1).collect();
        let ends = draws.ends(sample(&lengths));
        Estimate::new(quantile(&mut values, q), ends, values.len())
    };
    let rms = |of| rms_over_locations(&errors(of), resamples, seed);
    let mean = |of| mean_over_locations(&errors(of), resamples, seed);
    let rmse_mm = rms(|[x, y]| libm::hypot(x, y));
    Metrics {
        rmse_mm,
        rmse_x_mm: rms(|[x, _]| x),
        rmse_y_mm: rms(|[_, y]| y),
        bias_x_mm: mean(|[x, _]| x),
        bias_y_mm: mean(|[_, y]| y),
        median_mm: percentile(0.5, |lengths| {
            Sample::median(lengths.iter().map(|(l, v)| (*l, Some(*v))))
        }),
        p95_mm: percentile(0.95, |lengths| {
            Sample::percentile_95(lengths.iter().copied())
        }),
        repeat_std_mm: repeat_std(&located, draws),
        located_rate: share(&|_| true),
        within_rate: share(&|length| length <= within_mm),
        rmse_diagonal_percent: rmse_mm.value.map(|r| 100.0 * r / outline.diagonal_mm()),
    }
}

/// Makes a sample of values by location.
type Sampling = fn(&[(u32, f64)]) -> Result<Sample, SampleFault>;

/// Mean standard deviation between repetitions at one location and depth; n: how many there are.
fn repeat_std(located: &[(&ScoredPress, [f64; 2])], draws: Draws) -> Estimate {
    let mut found: Vec<(u32, f64, Point2)> = located
        .iter()
        .filter_map(|(p, _)| Some((p.location, p.depth_mm, p.found?.0)))
        .collect();
    found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let series = || {
        let all = found.chunk_by(|a, b| a.0 == b.0 && a.1 == b.1);
        all.filter(|repeats| repeats.len() >= 2)
    };
    let each = series().map(|repeats| {
        let n = repeats.len() as f64;
        spread_mm(repeats.iter().map(|(.., at)| *at)) * (n / (n - 1.0)).sqrt()
    });
    let positions = series().zip(0u32..).flat_map(|(repeats, series)| {
        let position = move |at: Point2| Position {
            series,
            x_mm: at.x_mm,
            y_mm: at.y_mm,
        };
        repeats
            .iter()
            .map(move |(location, _, at)| (*location, position(*at)))
    });
    let ends = draws.ends(Sample::repeat_std(positions));
    Estimate::new(sums::mean(each), ends, series().count())
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
    let fails = |p: &ScoredPress| !p.valid || p.found.is_none();
    let failures = || presses.iter().filter(|p| fails(p));
    let beyond = failures().filter(|p| length(p).is_some_and(|own| own > penalty));
    let counting = presses.iter().filter(|p| !fails(p));
    let ends = Draws { resamples, seed }.ends_with_failures(
        counting.map(|p| (p.location, error(p))),
        presses.iter().map(|p| (p.location, fails(p))),
        sums::root_mean_square(failures().map(error)).unwrap_or(penalty),
    );
    let value = sums::root_mean_square(presses.iter().map(error));
    let rmse_mm = Estimate::new(value, ends, presses.len());
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

/// [`skinrig_model::quantile()`] of values in any order, in linear time; `None` without values. Reorders `values`.
pub fn quantile(values: &mut [f64], q: f64) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let position = q * (values.len() - 1) as f64;
    let index = position.floor() as usize;
    let (_, &mut low, above) = values.select_nth_unstable_by(index, f64::total_cmp);
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    sorted_quantile(&[low, high], position - index as f64)
}
