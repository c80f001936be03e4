//! What a field learns from: residuals of the calibration presses, and how much each of them counts.

use super::base::{Base, robust_sigma, weight};
use crate::result::Scatter;
use crate::sets::CalibrationPress;

/// Maximum number of observations of a field. More presses are averaged by location, more locations are thinned evenly.
const MOST: usize = 300;

/// An observation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    location: u32,
    /// Columns, px.
    pub columns: [f64; 2],
    /// Truth minus base position, mm.
    pub residual: [f64; 2],
    /// Mean square change of a coordinate by the columns, mm²/px².
    pub magnification: f64,
    /// Variance of the columns relative to a press of median response.
    pub response: f64,
    /// Number of presses behind it.
    pub count: f64,
}

impl Sample {
    /// Variance of either coordinate under this scatter, mm².
    pub(super) fn variance(&self, fixed_mm2: f64, column_px2: f64) -> f64 {
        (fixed_mm2 + column_px2 * self.magnification * self.response) / self.count
    }

    /// Squared length of the residual, mm².
    pub(super) fn square(&self) -> f64 {
        self.residual[0] * self.residual[0] + self.residual[1] * self.residual[1]
    }
}

/// Column variance of a press with this many cluster events relative to one with the median number.
pub(super) fn response(cluster_events: u32, reference_events: f64) -> f64 {
    reference_events / f64::from(cluster_events.max(1))
}

/// Median cluster events, at least 1.
pub(super) fn reference_events(presses: &[CalibrationPress]) -> f64 {
    let mut events: Vec<u32> = presses.iter().map(|p| p.cluster_events).collect();
    events.sort_unstable();
    f64::from(events.get(events.len() / 2).copied().unwrap_or(1).max(1))
}

/// The observations of `presses`, ordered by location, at most [`MOST`]. Presses that the base does not locate teach nothing.
pub(super) fn samples(base: &Base, presses: &[CalibrationPress]) -> Vec<Sample> {
    let reference = reference_events(presses);
    let mut sorted: Vec<&CalibrationPress> = presses.iter().collect();
    sorted.sort_by(|a, b| {
        let key = |p: &CalibrationPress| (p.location, p.repetition);
        let columns = || a.columns[0].total_cmp(&b.columns[0]);
        key(a).cmp(&key(b)).then_with(columns)
    });
    let all: Vec<Sample> = sorted
        .into_iter()
        .filter_map(|p| {
            let anchor = base.anchor(p.columns)?;
            let sample = Sample {
                location: p.location,
                columns: p.columns,
                residual: [p.truth.x_mm - anchor.at[0], p.truth.y_mm - anchor.at[1]],
                magnification: 0.5 * (anchor.by_columns[0] + anchor.by_columns[2]),
                response: response(p.cluster_events, reference),
                count: 1.0,
            };
            let numbers = [sample.square(), sample.magnification];
            numbers.iter().all(|v| v.is_finite()).then_some(sample)
        })
        .collect();
    if all.len() <= MOST {
        return all;
    }
    let squares: Vec<f64> = all.iter().map(Sample::square).collect();
    let variance = robust_sigma(&squares).powi(2);
    let means: Vec<Sample> = all
        .chunk_by(|a, b| a.location == b.location)
        .map(|group| mean(group, variance))
        .collect();
    thinned(&means, MOST)
}

/// Mean of one location, with little weight on its outliers.
fn mean(group: &[Sample], variance: f64) -> Sample {
    let weights: Vec<f64> = group.iter().map(|s| weight(s.square() / variance)).collect();
    let total: f64 = weights.iter().sum();
    let of = |value: &dyn Fn(&Sample) -> f64| {
        let pairs = group.iter().zip(&weights);
        pairs.map(|(s, w)| w * value(s)).sum::<f64>() / total
    };
    Sample {
        location: group[0].location,
        columns: [0, 1].map(|k| of(&|s| s.columns[k])),
        residual: [0, 1].map(|k| of(&|s| s.residual[k])),
        magnification: of(&|s| s.magnification),
        response: of(&|s| s.response),
        count: total,
    }
}

/// At most `most` of the samples, evenly spaced.
pub(super) fn thinned<T: Clone>(all: &[T], most: usize) -> Vec<T> {
    let count = all.len().min(most);
    (0..count).map(|i| all[i * all.len() / count].clone()).collect()
}

/// Scatter of the residuals without a field, by maximum likelihood; little weight on outliers. `None` without samples.
pub(super) fn scatter(samples: &[Sample], reference_events: f64) -> Option<Scatter> {
    super::field::scatter(samples).map(|[fixed_mm, column_px]| Scatter {
        fixed_mm,
        column_px,
        reference_events,
    })
}
