//! Percentiles of times among which some were missed.
//!
//! A miss is later than every time (censored at the end of the window), so that percentiles below the misses are what
//! they are without a model of the misses. Limits are those of Woodruff (1952): the share of trials up to the percentile
//! has an interval, and its ends are read off the times.

use super::influence::{ByPlace, Measure, Shape, correlation, error};
use super::ranked::{Ranked, between};
use super::refusal::{Refusal, Side};
use super::sample::{Clusters, late};
use super::scores;
use skinrig_analysis::distributions::normal_quantile;

/// The value at rank `q` of sorted values (type 7 of Hyndman and Fan 1996).
fn at_rank(sorted: &[f64], q: f64) -> f64 {
    let position = q.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    let index = position.floor() as usize;
    let next = sorted.get(index + 1).copied().unwrap_or(f64::INFINITY);
    between(sorted[index], next, position - index as f64)
}

/// The percentile `q` of all trials.
///
/// # Errors
/// [`Refusal::Empty`], [`Refusal::BeyondWindow`].
pub(super) fn quantile(
    clusters: &Clusters<Option<f64>>,
    keep: impl Fn(u32) -> bool,
    q: f64,
    side: Side,
) -> Result<Measure, Refusal> {
    let (places, ranked) = ranked(clusters, keep, q, side)?;
    Ok(Measure {
        value: ranked.value,
        places,
        shape: Shape::Ranked(ranked),
    })
}

/// The distance from the 5th to the 95th percentile.
///
/// # Errors
/// [`Refusal::Empty`], [`Refusal::BeyondWindow`].
pub(super) fn width(
    clusters: &Clusters<Option<f64>>,
    keep: impl Fn(u32) -> bool,
    side: Side,
) -> Result<Measure, Refusal> {
    let (early, low) = ranked(clusters, &keep, 0.05, side)?;
    let (late, high) = ranked(clusters, &keep, 0.95, side)?;
    let totals =
        |places: &ByPlace| -> Vec<f64> { places.iter().map(|(_, u)| u.iter().sum()).collect() };
    let together = correlation(&totals(&early), &totals(&late));
    let difference = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| b - a).collect();
    let pairs = early.iter().zip(&late);
    Ok(Measure {
        value: high.value - low.value,
        places: pairs
            .map(|((k, a), (_, b))| (*k, difference(a, b)))
            .collect(),
        shape: Shape::Width(low, high, together),
    })
}

fn ranked(
    clusters: &Clusters<Option<f64>>,
    keep: impl Fn(u32) -> bool,
    q: f64,
    side: Side,
) -> Result<(ByPlace, Ranked), Refusal> {
    let kept = || clusters.iter().filter(|(k, _)| keep(**k));
    let mut sorted: Vec<f64> = kept().flat_map(|(_, v)| v).map(|t| late(*t)).collect();
    if sorted.is_empty() {
        return Err(Refusal::Empty { side });
    }
    sorted.sort_by(f64::total_cmp);
    let times = sorted.partition_point(|t| t.is_finite());
    let value = at_rank(&sorted, q);
    if !value.is_finite() {
        return Err(Refusal::BeyondWindow {
            side,
            percentile: 100.0 * q,
            missed: (sorted.len() - times) as u32,
            trials: sorted.len() as u32,
        });
    }
    let n = sorted.len() as f64;
    let below = sorted.partition_point(|t| *t <= value) as f64 / n;
    let residual = |t: &Option<f64>| below - f64::from(u8::from(late(*t) <= value));
    let shares: Vec<f64> = kept()
        .map(|(_, v)| v.iter().map(residual).sum::<f64>() / n)
        .collect();
    let effective = scores::effective(below, n, error(&shares), shares.len());
    let density = density(&sorted[..times], sorted.len(), q);
    let places = kept().map(|(k, v)| (*k, v.iter().map(|t| residual(t) / density).collect()));
    let places = places.collect();
    let ranked = Ranked {
        value,
        q,
        sorted,
        effective,
    };
    Ok((places, ranked))
}

/// The density of times at their percentile `q`: the difference quotient of the ranks over the bandwidth of Hall and
/// Sheather (1988), cut where times end; infinite where times coincide.
fn density(times: &[f64], trials: usize, q: f64) -> f64 {
    let n = trials as f64;
    let z = normal_quantile(q);
    let phi = libm::exp(-0.5 * z * z) / (2.0 * std::f64::consts::PI).sqrt();
    let width = libm::cbrt(1.96 * 1.96 * 1.5 * phi * phi / (2.0 * z * z + 1.0) / n);
    // Ranks among the times are ranks among the trials, scaled.
    let scale = (n - 1.0).max(1.0) / (times.len() as f64 - 1.0).max(1.0);
    let (low, high) = ((q - width).max(0.0), (q + width).min(1.0 / scale));
    let gap = at_rank(times, high * scale) - at_rank(times, low * scale);
    if gap > 0.0 && high > low {
        (high - low) / gap
    } else {
        f64::INFINITY
    }
}
