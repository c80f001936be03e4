//! Sample size planning: locations and repetitions that detect a given difference, from measured variance.

use serde::{Deserialize, Serialize};

use super::error::{ComparisonError, Side};
use super::measure::measure as measure_sample;
use super::sample::Sample;
use super::spread::RepeatEstimator;
use crate::distributions::student_quantile;

/// Variance components of one skin's metric. With `k` locations pressed `r` times each, the value has variance `between / k
/// + within / (k r)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MetricVariance {
    /// Value of the metric.
    pub value: f64,
    /// Variance between locations, beyond what repetitions explain.
    pub between: f64,
    /// Variance between repetitions at one location; `None` without repetitions.
    pub within: Option<f64>,
    /// Number of locations measured.
    pub locations: u32,
}

/// Difference to detect, and the required certainty.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Difference to detect, in the unit of the metric.
    pub difference: f64,
    /// Probability of detecting the difference.
    pub power: f64,
    /// Probability of claiming a difference when there is none.
    pub alpha: f64,
    /// Share of the variance between locations that both skins have in common, 0..1. Use 0 when unknown; it requires the
    /// most presses.
    pub common: f64,
    /// Standard deviations of the other skin relative to those measured: 1 if it is alike. An RMSE scatters in proportion to its value.
    pub scatter: f64,
    /// Share of the locations with a press that counts on both skins, more than 0 and at most 1: proposals have as many more.
    pub counting: f64,
    /// Time per press, s; gives proposals a duration.
    pub seconds_per_press: Option<f64>,
}

/// A sampling design: locations and repetitions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Proposal {
    /// Locations.
    pub locations: u32,
    /// Repetitions at each location.
    pub repetitions: u32,
    /// Presses per skin.
    pub presses: u32,
    /// Expected half width of the interval of the difference.
    pub half_width: f64,
    /// Time per skin, s.
    pub seconds: Option<f64>,
}

/// Proposed designs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PowerPlan {
    /// What the proposals must detect.
    pub target: Target,
    /// Variance components behind the proposals.
    pub measured: MetricVariance,
    /// Ascending by repetitions.
    pub proposals: Vec<Proposal>,
    /// Index of the proposal with the fewest presses.
    pub cheapest: usize,
}

/// Repetitions considered.
const REPETITIONS: [u32; 6] = [1, 2, 3, 5, 10, 20];
/// Upper limit of the search for locations.
const MAX_LOCATIONS: u32 = 100_000;

/// Estimates the variance components of a sample.
///
/// # Errors
/// [`ComparisonError`].
pub fn measure(sample: &Sample) -> Result<MetricVariance, ComparisonError> {
    let of = measure_sample(sample.data(), RepeatEstimator::All, Side::A, |_| true)?;
    let locations = of.by_location.len() as u32;
    if locations < 2 {
        return Err(ComparisonError::TooFewLocations { locations });
    }
    let (between, within) = super::components::alone(&of);
    Ok(MetricVariance {
        value: of.value,
        between,
        within,
        locations,
    })
}

/// Proposes designs that detect `target.difference` between two skins like the measured one, pressed at the same locations.
///
/// # Errors
/// [`ComparisonError::Setting`] for a target out of range.
pub fn plan(measured: &MetricVariance, target: &Target) -> Result<PowerPlan, ComparisonError> {
    let share = |v: f64| v > 0.0 && v < 1.0;
    let above_zero = |v: f64| v > 0.0 && v.is_finite();
    for (name, found, expected, good) in [
        (
            "difference",
            target.difference,
            "a number above 0",
            above_zero(target.difference),
        ),
        (
            "power",
            target.power,
            "a share above alpha and below 1",
            share(target.power) && target.power > target.alpha,
        ),
        (
            "alpha",
            target.alpha,
            "a share between 0 and 1",
            share(target.alpha),
        ),
        (
            "common",
            target.common,
            "a share from 0 to 1",
            (0.0..=1.0).contains(&target.common),
        ),
        (
            "scatter",
            target.scatter,
            "a number above 0",
            above_zero(target.scatter),
        ),
        (
            "counting",
            target.counting,
            "a share above 0 and at most 1",
            target.counting > 0.0 && target.counting <= 1.0,
        ),
    ] {
        if !good {
            return Err(ComparisonError::setting(name, expected, found));
        }
    }
    let both = 1.0 + target.scatter * target.scatter;
    let between = both * (1.0 - target.common) * measured.between;
    let tried: &[u32] = if measured.within.is_some() {
        &REPETITIONS
    } else {
        &[1]
    };
    let proposals: Vec<Proposal> = tried
        .iter()
        .filter_map(|&r| {
            let variance = between + both * measured.within.unwrap_or(0.0) / f64::from(r);
            proposal(variance, r, target)
        })
        .collect();
    let cheapest = (0..proposals.len()).min_by_key(|i| proposals[*i].presses);
    let cheapest = cheapest.ok_or_else(|| {
        let expected = format!("a difference that {MAX_LOCATIONS} locations can detect");
        ComparisonError::setting("difference", &expected, target.difference)
    })?;
    Ok(PowerPlan {
        target: *target,
        measured: *measured,
        proposals,
        cheapest,
    })
}

fn proposal(variance: f64, repetitions: u32, target: &Target) -> Option<Proposal> {
    let quantiles = |k: u32| {
        let df = f64::from(k - 1);
        let tail = student_quantile(1.0 - 0.5 * target.alpha, df);
        (tail, tail + student_quantile(target.power, df))
    };
    let error = |k: u32| (variance / f64::from(k)).sqrt();
    let enough = |k: u32| quantiles(k).1 * error(k) <= target.difference;
    if !enough(MAX_LOCATIONS) {
        return None;
    }
    let (mut low, mut high) = (2, MAX_LOCATIONS);
    while low < high {
        let middle = low.midpoint(high);
        if enough(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    let locations = (f64::from(low) / target.counting).ceil();
    let locations = (locations <= f64::from(MAX_LOCATIONS)).then_some(locations as u32)?;
    let presses = locations.checked_mul(repetitions)?;
    Some(Proposal {
        locations,
        repetitions,
        presses,
        half_width: quantiles(low).0 * error(low),
        seconds: target.seconds_per_press.map(|s| s * f64::from(presses)),
    })
}
