//! What to press to find a difference of a given size: locations x repetitions from measured variance.

use serde::{Deserialize, Serialize};

use super::measure::measure as measured;
use super::refusal::{Refusal, Side};
use super::sample::Sample;
use super::spread::Repeats;
use skinrig_analysis::distributions::student_quantile;

/// Where the variance of one skin's metric comes from. With `k` locations pressed `r` times each its value has variance
/// `between / k + within / (k r)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Its value.
    pub value: f64,
    /// Variance between locations beyond what repetitions explain.
    pub between: f64,
    /// Variance between repetitions at one location; `None` when nothing was pressed twice.
    pub within: Option<f64>,
    /// Locations that this stands on.
    pub locations: u32,
}

/// What is to be found, and how sure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Difference to detect, in the unit of the metric.
    pub difference: f64,
    /// Probability of detecting it.
    pub power: f64,
    /// Probability of claiming one when there is none.
    pub alpha: f64,
    /// Share of the variance between locations that two skins have in common, 0..1: 0 when nothing is known, which asks
    /// for the most.
    pub common: f64,
    /// Time of one press, s; with it proposals have a duration.
    pub seconds_per_press: Option<f64>,
}

/// One way to press.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Proposal {
    /// Locations.
    pub locations: u32,
    /// Repetitions at each.
    pub repetitions: u32,
    /// Presses of one skin.
    pub presses: u32,
    /// Expected half width of the interval of the difference.
    pub half_width: f64,
    /// Time for one skin, s.
    pub seconds: Option<f64>,
}

/// Ways to press, by repetitions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PowerPlan {
    /// What it was made for.
    pub target: Target,
    /// What it was made from.
    pub measured: Measured,
    /// Proposals, fewest repetitions first.
    pub proposals: Vec<Proposal>,
    /// Index of the one with the fewest presses.
    pub cheapest: usize,
}

/// Repetitions that are proposed.
const REPETITIONS: [u32; 6] = [1, 2, 3, 5, 10, 20];
/// More locations than anybody presses.
const MOST: u32 = 100_000;

/// The variance of a sample, taken apart.
///
/// # Errors
/// [`Refusal`].
pub fn measure(sample: &Sample) -> Result<Measured, Refusal> {
    let of = measured(sample.data(), Repeats::All, Side::A, |_| true)?;
    let locations = of.places.len() as u32;
    if locations < 2 {
        return Err(Refusal::TooFewLocations { locations });
    }
    let (between, within) = super::components::alone(&of);
    Ok(Measured {
        value: of.value,
        between,
        within,
        locations,
    })
}

/// Locations x repetitions that detect `target.difference` between two skins like the one measured, pressed at the same
/// locations.
///
/// # Errors
/// [`Refusal::Setting`] for a target out of range.
pub fn plan(measured: &Measured, target: &Target) -> Result<PowerPlan, Refusal> {
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
            "a share between 0 and 1",
            share(target.power),
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
    ] {
        if !good {
            return Err(Refusal::setting(name, expected, found));
        }
    }
    let between = 2.0 * (1.0 - target.common) * measured.between;
    let tried: &[u32] = if measured.within.is_some() {
        &REPETITIONS
    } else {
        &[1]
    };
    let proposals: Vec<Proposal> = tried
        .iter()
        .filter_map(|&r| {
            let variance = between + 2.0 * measured.within.unwrap_or(0.0) / f64::from(r);
            proposal(variance, r, target)
        })
        .collect();
    let cheapest = (0..proposals.len()).min_by_key(|i| proposals[*i].presses);
    let cheapest = cheapest.ok_or_else(|| {
        let expected = format!("one that {MOST} locations can show");
        Refusal::setting("difference", &expected, target.difference)
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
    if !enough(MOST) {
        return None;
    }
    let (mut low, mut high) = (2, MOST);
    while low < high {
        let middle = low.midpoint(high);
        if enough(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    let presses = low.checked_mul(repetitions)?;
    Some(Proposal {
        locations: low,
        repetitions,
        presses,
        half_width: quantiles(low).0 * error(low),
        seconds: target.seconds_per_press.map(|s| s * f64::from(presses)),
    })
}
