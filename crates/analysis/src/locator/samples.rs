//! Training data of a field: for one camera, deviations of readings from those expected at the measured positions.

use super::robust::{reference_events, response, scale, weight};
use crate::sets::CalibrationPress;

/// Maximum number of observations of a field. More presses are averaged by location, more locations are thinned evenly.
const MOST: usize = 300;

/// An observation of one camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    location: u32,
    /// Measured position, mm.
    pub at: [f64; 2],
    /// Reading minus the one expected here, px.
    pub residual: f64,
    /// Variance of the reading relative to a press of median response.
    pub response: f64,
    /// Number of presses behind it.
    pub count: f64,
}

impl Sample {
    /// Variance, px², under a fixed one and one that grows as events become fewer.
    pub(super) fn variance(&self, fixed_px2: f64, column_px2: f64) -> f64 {
        (fixed_px2 + column_px2 * self.response) / self.count
    }
}

/// The observations, ordered by location, at most [`MOST`]. `residual`: reading of a press minus the expected one, px; `None`
/// if the press has none.
pub(super) fn samples(
    presses: &[CalibrationPress],
    residual: impl Fn(&CalibrationPress) -> Option<f64>,
) -> Vec<Sample> {
    let reference = reference_events(presses);
    let mut sorted: Vec<&CalibrationPress> = presses.iter().collect();
    sorted.sort_by(|a, b| {
        let key = |p: &CalibrationPress| (p.location, p.repetition);
        let columns = |k: usize| a.columns[k].total_cmp(&b.columns[k]);
        let by_columns = || columns(0).then_with(|| columns(1));
        key(a).cmp(&key(b)).then_with(by_columns)
    });
    let all: Vec<Sample> = sorted
        .into_iter()
        .filter_map(|p| {
            let sample = Sample {
                location: p.location,
                at: [p.truth.x_mm, p.truth.y_mm],
                residual: residual(p)?,
                response: response(p.cluster_events, reference),
                count: 1.0,
            };
            let finite = sample.residual.is_finite();
            finite.then_some(sample)
        })
        .collect();
    if all.len() <= MOST {
        return all;
    }
    let sigma = scale(all.iter().map(|s| s.residual));
    let means: Vec<Sample> = all
        .chunk_by(|a, b| a.location == b.location)
        .map(|group| mean(group, sigma))
        .collect();
    thinned(&means, MOST)
}

/// Mean of one location, with little weight on its outliers.
fn mean(group: &[Sample], sigma: f64) -> Sample {
    let each = group.iter();
    let weights: Vec<f64> = each
        .map(|s| weight((s.residual / sigma).powi(2), 1.0))
        .collect();
    let total: f64 = weights.iter().sum();
    let of = |value: &dyn Fn(&Sample) -> f64| {
        let pairs = group.iter().zip(&weights);
        pairs.map(|(s, w)| w * value(s)).sum::<f64>() / total
    };
    Sample {
        location: group[0].location,
        at: [0, 1].map(|i| of(&|s| s.at[i])),
        residual: of(&|s| s.residual),
        response: of(&|s| s.response),
        count: total,
    }
}

/// At most `most` of the samples, evenly spaced.
pub(crate) fn thinned<T: Clone>(all: &[T], most: usize) -> Vec<T> {
    let count = all.len().min(most);
    (0..count)
        .map(|i| all[i * all.len() / count].clone())
        .collect()
}

/// Samples of a smooth field with scatter and one outlier, for tests.
#[cfg(test)]
pub(super) fn planted(n: u32) -> Vec<Sample> {
    let of = |i: u32| {
        let at = [
            -20.0 + 7.0 * f64::from(i % 6),
            -15.0 + 6.0 * f64::from(i / 6),
        ];
        let scatter = f64::from((i * 7919) % 17) / 17.0 - 0.5;
        Sample {
            location: i,
            at,
            residual: libm::sin(0.08 * at[0]) + 0.3 * scatter + if i == 7 { 9.0 } else { 0.0 },
            response: 0.5 * (1.0 + f64::from(i % 3)),
            count: 1.0,
        }
    };
    (0..n).map(of).collect()
}
