//! Percentiles of times with missed trials.
//!
//! A miss counts as later than every time (censored at the end of the window), so percentiles below the misses need no model
//! of them. Limits follow Woodruff (1952): take the interval of the share of trials up to the percentile, and read its ends
//! off the times.

use super::error::{ComparisonError, Side};
use super::influence::{InferenceData, Measure, ValuesByLocation, correlation, error};
use super::percentile::{Percentile, between};
use super::sample::{Clusters, late};
use super::scores;
use crate::distributions::normal_quantile;

/// Value at rank `q` of sorted values (type 7 of Hyndman and Fan 1996). Infinite values are misses: a rank among them is
/// infinite, where [`skinrig_model::quantile()`] is not a number.
fn at_rank(sorted: &[f64], q: f64) -> f64 {
    let position = q.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    let index = position.floor() as usize;
    let next = sorted.get(index + 1).copied().unwrap_or(f64::INFINITY);
    between(sorted[index], next, position - index as f64)
}

/// Percentile `q` of all trials.
///
/// # Errors
/// [`ComparisonError::Empty`], [`ComparisonError::BeyondWindow`].
pub(super) fn quantile(
    clusters: &Clusters<Option<f64>>,
    keep: impl Fn(u32) -> bool,
    q: f64,
    side: Side,
) -> Result<Measure, ComparisonError> {
    let (locations, percentile) = percentile(clusters, keep, q, side)?;
    Ok(Measure {
        value: percentile.value,
        by_location: locations,
        shape: InferenceData::Percentile(percentile),
    })
}

/// Distance from the 5th to the 95th percentile.
///
/// # Errors
/// [`ComparisonError::Empty`], [`ComparisonError::BeyondWindow`].
pub(super) fn width(
    clusters: &Clusters<Option<f64>>,
    keep: impl Fn(u32) -> bool,
    side: Side,
) -> Result<Measure, ComparisonError> {
    let (early, low) = percentile(clusters, &keep, 0.05, side)?;
    let (late, high) = percentile(clusters, &keep, 0.95, side)?;
    let totals = |locations: &ValuesByLocation| -> Vec<f64> {
        locations.iter().map(|(_, u)| u.iter().sum()).collect()
    };
    let together = correlation(&totals(&early), &totals(&late));
    let difference = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| b - a).collect();
    let pairs = early.iter().zip(&late);
    Ok(Measure {
        value: high.value - low.value,
        by_location: pairs
            .map(|((k, a), (_, b))| (*k, difference(a, b)))
            .collect(),
        shape: InferenceData::Width(low, high, together),
    })
}

fn percentile(
    clusters: &Clusters<Option<f64>>,
    keep: impl Fn(u32) -> bool,
    q: f64,
    side: Side,
) -> Result<(ValuesByLocation, Percentile), ComparisonError> {
    let retained = || clusters.iter().filter(|(k, _)| keep(**k));
    let mut sorted: Vec<f64> = retained().flat_map(|(_, v)| v).map(|t| late(*t)).collect();
    if sorted.is_empty() {
        return Err(ComparisonError::Empty { side });
    }
    sorted.sort_by(f64::total_cmp);
    let times = sorted.partition_point(|t| t.is_finite());
    let value = at_rank(&sorted, q);
    if !value.is_finite() {
        return Err(ComparisonError::BeyondWindow {
            side,
            percentile: 100.0 * q,
            missed: (sorted.len() - times) as u32,
            trials: sorted.len() as u32,
        });
    }
    let n = sorted.len() as f64;
    let below = sorted.partition_point(|t| *t <= value) as f64 / n;
    let residual = |t: &Option<f64>| below - f64::from(u8::from(late(*t) <= value));
    let shares: Vec<f64> = retained()
        .map(|(_, v)| v.iter().map(residual).sum::<f64>() / n)
        .collect();
    let effective = scores::effective(below, n, error(&shares), shares.len());
    let density = density(&sorted[..times], sorted.len(), q);
    let locations =
        retained().map(|(k, v)| (*k, v.iter().map(|t| residual(t) / density).collect()));
    let locations = locations.collect();
    let percentile = Percentile {
        value,
        q,
        sorted,
        effective,
    };
    Ok((locations, percentile))
}

/// Density of times at percentile `q`: difference quotient of the ranks over the bandwidth of Hall and Sheather (1988),
/// truncated at the ends; infinite where times coincide.
fn density(times: &[f64], trials: usize, q: f64) -> f64 {
    let n = trials as f64;
    let z = normal_quantile(q);
    let phi = libm::exp(-0.5 * z * z) / (2.0 * std::f64::consts::PI).sqrt();
    let width = libm::cbrt(1.96 * 1.96 * 1.5 * phi * phi / (2.0 * z * z + 1.0) / n);
    // Convert ranks among the times to ranks among the trials.
    let scale = (n - 1.0).max(1.0) / (times.len() as f64 - 1.0).max(1.0);
    let (low, high) = ((q - width).max(0.0), (q + width).min(1.0 / scale));
    let gap = at_rank(times, high * scale) - at_rank(times, low * scale);
    if gap > 0.0 && high > low {
        (high - low) / gap
    } else {
        f64::INFINITY
    }
}
