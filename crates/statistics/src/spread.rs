//! Standard deviation between repetitions, averaged over series.

use super::influence::{Measure, RatioTransform, from_terms};
use super::sample::{Clusters, Data, Position};

/// Estimator of the standard deviation of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RepeatEstimator {
    /// Over all repetitions.
    All,
    /// Mean over all pairs of repetitions: the expected result of two repetitions, whatever their number. The std of few
    /// repetitions is biased low; this makes series of different length comparable.
    Pairs,
}

impl RepeatEstimator {
    /// Estimator that is unbiased between samples with series of different length.
    pub(crate) fn for_samples<'a>(samples: impl IntoIterator<Item = &'a Data>) -> Self {
        let clusters = samples.into_iter().filter_map(|data| match data {
            Data::RepeatStd(clusters) => Some(clusters),
            _ => None,
        });
        let mut lengths = clusters.flat_map(Clusters::values).flat_map(|positions| {
            let series = positions.chunk_by(|a, b| a.series == b.series);
            series.map(<[Position]>::len)
        });
        let first = lengths.next();
        if lengths.all(|l| Some(l) == first) {
            Self::All
        } else {
            Self::Pairs
        }
    }
}

/// Sample standard deviation of positions about their mean (Euclidean), mm.
fn of_all(series: &[Position], without: Option<usize>) -> f64 {
    let retained = || {
        let all = series.iter().enumerate();
        all.filter(|(i, _)| Some(*i) != without).map(|(_, p)| p)
    };
    let n = retained().count() as f64;
    let mean = |f: fn(&Position) -> f64| retained().map(f).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.x_mm), mean(|p| p.y_mm));
    let squares = retained().map(|p| (p.x_mm - x).powi(2) + (p.y_mm - y).powi(2));
    (squares.sum::<f64>() / (n - 1.0)).sqrt()
}

/// Mean of [`of_all`] over all pairs.
fn of_pairs(series: &[Position], without: Option<usize>) -> f64 {
    let (mut sum, mut pairs) = (0.0, 0u32);
    for (i, a) in series.iter().enumerate() {
        for (j, b) in series.iter().enumerate().skip(i + 1) {
            if Some(i) != without && Some(j) != without {
                sum += libm::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm);
                pairs += 1;
            }
        }
    }
    sum * std::f64::consts::FRAC_1_SQRT_2 / f64::from(pairs)
}

/// Jackknife pseudo-values (Tukey 1958) of the spread of a series, centred on the spread. Two repetitions share one spread.
fn pseudo_values(series: &[Position], spread: fn(&[Position], Option<usize>) -> f64) -> Vec<f64> {
    let whole = spread(series, None);
    let n = series.len();
    if n < 3 {
        return vec![whole; n];
    }
    let pseudo = |i| n as f64 * whole - (n as f64 - 1.0) * spread(series, Some(i));
    let values: Vec<f64> = (0..n).map(pseudo).collect();
    let shift = whole - values.iter().sum::<f64>() / n as f64;
    values.iter().map(|v| v + shift).collect()
}

/// Mean spread over series; each series has equal weight, however many repetitions it has.
pub(super) fn repeat_std(
    clusters: &Clusters<Position>,
    estimator: RepeatEstimator,
    keep: impl Fn(u32) -> bool,
) -> Option<Measure> {
    let spread = match estimator {
        RepeatEstimator::All => of_all,
        RepeatEstimator::Pairs => of_pairs,
    };
    let retained = clusters.iter().filter(|(k, _)| keep(**k));
    let terms = |positions: &[Position]| {
        let series = positions.chunk_by(|a, b| a.series == b.series);
        let one = |series: &[Position]| {
            let weight = 1.0 / series.len() as f64;
            let values = pseudo_values(series, spread).into_iter();
            values.map(|v| (v * weight, weight)).collect::<Vec<_>>()
        };
        series.flat_map(one).collect()
    };
    let positions = retained.map(|(k, v)| (*k, terms(v)));
    from_terms(positions.collect(), RatioTransform::Same)
}
