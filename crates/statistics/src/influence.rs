//! Influence of each press on a metric, to first order, and the data that inference needs besides.
//!
//! Near its value, every metric equals its value plus the mean of one number per press. That number (the empirical influence
//! function: Hampel 1974; in surveys the linearised variable: Deville 1999) gives standard errors over locations and
//! variance components for all kinds of metric.

use super::percentile::Percentile;

/// Below this many locations there are too few distinct draws, and Student's t is used.
pub(super) const BOOTSTRAP_FROM: usize = 8;

/// One number per press, grouped by location number, ascending.
pub(super) type ValuesByLocation = Vec<(u32, Vec<f64>)>;

/// Value of a metric, influence of its presses, and data for inference.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Measure {
    pub value: f64,
    /// Influence of each press; the mean over all presses is 0.
    pub by_location: ValuesByLocation,
    /// Data for inference.
    pub shape: InferenceData,
}

/// Data for inference besides influences.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum InferenceData {
    /// Function of a ratio of sums over locations.
    Ratio(Ratio),
    /// Share of this many trials.
    Share(u32),
    /// Events, exposure, and their ratio.
    Counts(u32, f64, Ratio),
    /// Percentile of times.
    Percentile(Percentile),
    /// Distance between two percentiles, low and high, and the correlation of their estimates.
    Width(Percentile, Percentile, f64),
}

impl InferenceData {
    /// Ratio for the bootstrap; `None` if too few locations contribute.
    pub(super) fn ratio(&self) -> Option<&Ratio> {
        match self {
            Self::Ratio(ratio) => Some(ratio),
            Self::Counts(_, _, ratio) => {
                let counted =
                    |(residual, weight): &&(f64, f64)| residual + ratio.ratio * weight > 0.5;
                let many = ratio.terms.iter().filter(counted).count() >= BOOTSTRAP_FROM;
                many.then_some(ratio)
            }
            _ => None,
        }
    }
}

/// Ratio of sums over locations, and its mapping to the metric.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ratio {
    pub ratio: f64,
    /// (sum - ratio * weight, weight) of each location, in ascending order of location number.
    pub terms: Vec<(f64, f64)>,
    /// Mapping from ratio to metric.
    pub scale: RatioTransform,
}

/// Mapping from a ratio to the metric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RatioTransform {
    /// Identity.
    Same,
    /// Square root.
    Root,
    /// Number of circles with this mean square radius in the area, mm².
    Circles(f64),
}

impl RatioTransform {
    /// True if the metric is never below 0.
    pub(super) const fn is_positive(self) -> bool {
        matches!(self, Self::Root | Self::Circles(_))
    }

    /// Metric and its derivative with respect to the ratio; the derivative is 0 at the end of the range.
    pub(super) fn of(self, ratio: f64) -> (f64, f64) {
        match self {
            Self::Same => (ratio, 1.0),
            Self::Root if ratio > 0.0 => (ratio.sqrt(), 0.5 / ratio.sqrt()),
            Self::Root => (0.0, 0.0),
            Self::Circles(area) => {
                let value = area / (std::f64::consts::PI * ratio);
                (value, -value / ratio)
            }
        }
    }
}

impl Measure {
    /// Number of presses.
    pub(super) fn presses(&self) -> u32 {
        self.by_location.iter().map(|p| p.1.len() as u32).sum()
    }

    /// Number of locations.
    pub(super) fn locations(&self) -> usize {
        self.by_location.len()
    }

    /// Contribution of each location to the error of the value.
    pub(super) fn totals(&self) -> Vec<f64> {
        let n = f64::from(self.presses());
        let sums = self.by_location.iter().map(|p| p.1.iter().sum::<f64>());
        sums.map(|s| s / n).collect()
    }
}

/// Standard error of a sum over locations whose terms add up to 0 (Taylor linearisation with locations as primary units:
/// Cochran 1977, chapter 9A).
pub(super) fn error(totals: &[f64]) -> f64 {
    let k = totals.len() as f64;
    (k / (k - 1.0) * totals.iter().map(|e| e * e).sum::<f64>()).sqrt()
}

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Sample variance; 0 for fewer than two values.
pub(super) fn variance(values: &[f64]) -> f64 {
    if values.len() < 2 {
        return 0.0;
    }
    let centre = mean(values);
    let squares: f64 = values.iter().map(|v| (v - centre).powi(2)).sum();
    squares / (values.len() as f64 - 1.0)
}

/// Correlation of two sums over the same locations; 0 if one of them does not vary.
pub(super) fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let size = (product(a, a) * product(b, b)).sqrt();
    if size > 0.0 {
        (product(a, b) / size).clamp(-1.0, 1.0)
    } else {
        0.0
    }
}

/// Computes the ratio of sums from (value, weight) of each press; `None` without presses.
pub(super) fn from_terms(
    locations: Vec<(u32, Vec<(f64, f64)>)>,
    scale: RatioTransform,
) -> Option<Measure> {
    let all = || locations.iter().flat_map(|(_, v)| v);
    let n = all().count();
    if n == 0 {
        return None;
    }
    let (mut sum, mut weight) = (0.0, 0.0);
    for (s, w) in all() {
        sum += s;
        weight += w;
    }
    let ratio = sum / weight;
    let (value, slope) = scale.of(ratio);
    let each = slope * n as f64 / weight;
    let residual = |(s, w): &(f64, f64)| s - ratio * w;
    let total = |v: &[(f64, f64)]| {
        let residuals = v.iter().map(residual).sum();
        (residuals, v.iter().map(|t| t.1).sum())
    };
    let terms = locations.iter().map(|(_, v)| total(v)).collect();
    let locations = locations
        .iter()
        .map(|(k, v)| (*k, v.iter().map(|t| each * residual(t)).collect()));
    Some(Measure {
        value,
        by_location: locations.collect(),
        shape: InferenceData::Ratio(Ratio {
            ratio,
            terms,
            scale,
        }),
    })
}
