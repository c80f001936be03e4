//! What each press contributes to a metric, to first order, and what its inference needs besides.
//!
//! Every metric here is, near its value, its value plus the mean of one number per press. That number (the empirical
//! influence function: Hampel 1974; for surveys the linearised variable: Deville 1999) gives standard errors over
//! locations and variance components alike for all kinds.

use super::ranked::Ranked;

/// Fewer locations than this leave too few different draws: Student's distribution serves instead.
pub(super) const BOOTSTRAP_FROM: usize = 8;

/// By location, ascending: a number per press.
pub(super) type ByPlace = Vec<(u32, Vec<f64>)>;

/// A metric's value, the influence of its presses, and its shape.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Measure {
    /// The metric's value.
    pub value: f64,
    /// The influence of each press; their mean over all presses is 0.
    pub places: ByPlace,
    /// What it is besides.
    pub shape: Shape,
}

/// What the inference of a metric stands on besides influences.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    /// A function of a ratio of sums over locations.
    Ratio(Ratio),
    /// A share of so many trials.
    Share(u32),
    /// Events during an exposure, and their ratio.
    Counts(u32, f64, Ratio),
    /// A rank among times.
    Ranked(Ranked),
    /// The distance between two ranks, low and high, and the correlation of their estimates.
    Width(Ranked, Ranked, f64),
}

impl Shape {
    /// What a bootstrap can draw from: a ratio that enough locations say something about.
    pub fn ratio(&self) -> Option<&Ratio> {
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

/// A ratio of sums over locations and what is made of it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Ratio {
    /// The ratio.
    pub ratio: f64,
    /// (sum - ratio * weight, weight) of each location, in the order of the places.
    pub terms: Vec<(f64, f64)>,
    /// What it is mapped to.
    pub scale: Scale,
}

/// From a ratio to the metric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Scale {
    /// The ratio itself.
    Same,
    /// Its square root.
    Root,
    /// An area in circles of that mean square radius.
    Circles(f64),
}

impl Scale {
    /// The metric and its derivative by the ratio; the derivative at an end of the range is 0.
    pub fn of(self, ratio: f64) -> (f64, f64) {
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
    /// Presses.
    pub fn presses(&self) -> u32 {
        self.places.iter().map(|p| p.1.len() as u32).sum()
    }

    /// Locations.
    pub fn locations(&self) -> usize {
        self.places.len()
    }

    /// What each location contributes to the error of the value.
    pub fn totals(&self) -> Vec<f64> {
        let n = f64::from(self.presses());
        let sums = self.places.iter().map(|p| p.1.iter().sum::<f64>());
        sums.map(|s| s / n).collect()
    }
}

/// Standard error of a sum over locations whose terms add up to 0 (Taylor linearisation with locations as primary
/// units: Cochran 1977, chapter 9A).
pub(super) fn error(totals: &[f64]) -> f64 {
    let k = totals.len() as f64;
    (k / (k - 1.0) * totals.iter().map(|e| e * e).sum::<f64>()).sqrt()
}

/// Correlation of two sums over the same locations; 0 where one does not vary.
pub(super) fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let size = (product(a, a) * product(b, b)).sqrt();
    if size > 0.0 {
        (product(a, b) / size).clamp(-1.0, 1.0)
    } else {
        0.0
    }
}

/// From (sum, weight) of each press; `None` without any.
pub(super) fn from_terms(places: Vec<(u32, Vec<(f64, f64)>)>, scale: Scale) -> Option<Measure> {
    let all = || places.iter().flat_map(|(_, v)| v);
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
    let terms = places.iter().map(|(_, v)| total(v)).collect();
    let places = places
        .iter()
        .map(|(k, v)| (*k, v.iter().map(|t| each * residual(t)).collect()));
    Some(Measure {
        value,
        places: places.collect(),
        shape: Shape::Ratio(Ratio {
            ratio,
            terms,
            scale,
        }),
    })
}
