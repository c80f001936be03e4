//! What each press contributes to a metric, to first order: its influence.
//!
//! Every metric here is, near its value, its value plus the mean of one number per press. That number (the empirical
//! influence function: Hampel 1974; for surveys the linearised variable: Deville 1999) gives standard errors over
//! locations and variance components alike for all kinds.

use super::refusal::{Refusal, Side};
use super::sample::{Clusters, Count, Data, Position, late};

/// A metric's value and the influence of its presses.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Influences {
    /// The metric's value.
    pub value: f64,
    /// By location, ascending: the influence of each press; their mean over all presses is 0.
    pub places: Vec<(u32, Vec<f64>)>,
}

impl Influences {
    /// Presses.
    pub fn presses(&self) -> u32 {
        self.places.iter().map(|p| p.1.len() as u32).sum()
    }

    /// What each location contributes to the error of the value.
    pub fn totals(&self) -> Vec<f64> {
        let n = f64::from(self.presses());
        self.places
            .iter()
            .map(|p| p.1.iter().sum::<f64>() / n)
            .collect()
    }
}

/// Of the values at the locations that `keep` keeps.
///
/// # Errors
/// [`Refusal::Empty`], and what keeps the metric from having a value.
pub(super) fn influences(
    data: &Data,
    side: Side,
    keep: impl Fn(u32) -> bool,
) -> Result<Influences, Refusal> {
    let found = match data {
        Data::Mean(c) => ratio(c, &keep, |v| (*v, 1.0)),
        Data::Rms(c) => ratio(c, &keep, |v| (v * v, 1.0)).map(|i| root(&i)),
        Data::Taxels(area_mm2, c) => {
            let squares = ratio(c, &keep, |v| (v * v, 1.0));
            return squares.map_or(Err(Refusal::Empty { side }), |i| taxels(*area_mm2, i, side));
        }
        Data::RepeatStd(c) => repeat_std(c, &keep),
        Data::Share(c) => ratio(c, &keep, |v| (f64::from(u8::from(*v)), 1.0)),
        Data::CountRate(c) => ratio(c, &keep, |v: &Count| (f64::from(v.events), v.exposure)),
        Data::Median(c) => return quantile_influences(c, &keep, 0.5, side),
        Data::Width(c) => {
            let low = quantile_influences(c, &keep, 0.05, side)?;
            let high = quantile_influences(c, &keep, 0.95, side)?;
            return Ok(minus(&high, &low));
        }
    };
    found.ok_or(Refusal::Empty { side })
}

fn ratio<T>(
    clusters: &Clusters<T>,
    keep: impl Fn(u32) -> bool,
    term: impl Fn(&T) -> (f64, f64),
) -> Option<Influences> {
    let kept = || clusters.iter().filter(|(k, _)| keep(**k));
    let (mut sum, mut weight, mut n) = (0.0, 0.0, 0u32);
    for value in kept().flat_map(|(_, v)| v) {
        let (s, w) = term(value);
        sum += s;
        weight += w;
        n += 1;
    }
    if n == 0 {
        return None;
    }
    let (value, each) = (sum / weight, weight / f64::from(n));
    let influence = |v: &T| {
        let (s, w) = term(v);
        (s - value * w) / each
    };
    let places = kept().map(|(k, v)| (*k, v.iter().map(influence).collect()));
    Some(Influences {
        value,
        places: places.collect(),
    })
}

/// `f(value)` whose derivative is `slope`.
fn mapped(of: &Influences, value: f64, slope: f64) -> Influences {
    let places = of.places.iter();
    Influences {
        value,
        places: places
            .map(|(k, u)| (*k, u.iter().map(|u| slope * u).collect()))
            .collect(),
    }
}

fn root(squares: &Influences) -> Influences {
    let value = squares.value.sqrt();
    // Where all is 0 nothing has any influence.
    let slope = if value > 0.0 { 0.5 / value } else { 0.0 };
    mapped(squares, value, slope)
}

fn taxels(area_mm2: f64, squares: Influences, side: Side) -> Result<Influences, Refusal> {
    if squares.value <= 0.0 {
        return Err(Refusal::NoError { side });
    }
    let value = area_mm2 / (std::f64::consts::PI * squares.value);
    Ok(mapped(&squares, value, -value / squares.value))
}

fn minus(a: &Influences, b: &Influences) -> Influences {
    let pairs = a.places.iter().zip(&b.places);
    Influences {
        value: a.value - b.value,
        places: pairs
            .map(|((k, a), (_, b))| (*k, a.iter().zip(b).map(|(a, b)| a - b).collect()))
            .collect(),
    }
}

/// Sample standard deviation of positions about their mean, mm.
fn spread_mm(series: &[Position], without: Option<usize>) -> f64 {
    let kept = || {
        series
            .iter()
            .enumerate()
            .filter(|(i, _)| Some(*i) != without)
    };
    let n = kept().count() as f64;
    let mean = |f: fn(&Position) -> f64| kept().map(|(_, p)| f(p)).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.x_mm), mean(|p| p.y_mm));
    let squares = kept().map(|(_, p)| (p.x_mm - x).powi(2) + (p.y_mm - y).powi(2));
    (squares.sum::<f64>() / (n - 1.0)).sqrt()
}

/// The spread of a series, and what each repetition adds to it: pseudo-values of the jackknife (Tukey 1958), centred on
/// the spread. Two repetitions share one spread.
fn series_influences(series: &[Position]) -> (f64, Vec<f64>) {
    let spread = spread_mm(series, None);
    let n = series.len();
    if n < 3 {
        return (spread, vec![spread; n]);
    }
    let pseudo = |i| n as f64 * spread - (n as f64 - 1.0) * spread_mm(series, Some(i));
    let values: Vec<f64> = (0..n).map(pseudo).collect();
    let shift = spread - values.iter().sum::<f64>() / n as f64;
    (spread, values.iter().map(|v| v + shift).collect())
}

fn repeat_std(clusters: &Clusters<Position>, keep: impl Fn(u32) -> bool) -> Option<Influences> {
    let mut series: Vec<(u32, f64, Vec<f64>)> = Vec::new();
    for (location, places) in clusters.iter().filter(|(k, _)| keep(**k)) {
        for one in places.chunk_by(|a, b| a.series == b.series) {
            let (spread, values) = series_influences(one);
            series.push((*location, spread, values));
        }
    }
    if series.is_empty() {
        return None;
    }
    let value = series.iter().map(|s| s.1).sum::<f64>() / series.len() as f64;
    let presses: usize = series.iter().map(|s| s.2.len()).sum();
    let each = presses as f64 / series.len() as f64;
    let mut places: Vec<(u32, Vec<f64>)> = Vec::new();
    for (location, _, values) in series {
        // Each series counts alike, however often it was repeated.
        let weight = each / values.len() as f64;
        let values = values.iter().map(|v| weight * (v - value));
        match places.last_mut() {
            Some((last, all)) if *last == location => all.extend(values),
            _ => places.push((location, values.collect())),
        }
    }
    Some(Influences { value, places })
}

/// The value at rank `q` of sorted values, between neighbours in proportion (type 7 of Hyndman and Fan 1996); infinite
/// when a neighbour that counts is.
pub(super) fn at_rank(sorted: &[f64], q: f64) -> f64 {
    let position = q.clamp(0.0, 1.0) * (sorted.len() - 1) as f64;
    let index = position.floor() as usize;
    let share = position - index as f64;
    let low = sorted[index];
    if share == 0.0 {
        low
    } else {
        low + share * (sorted[index + 1] - low)
    }
}

fn quantile_influences(
    clusters: &Clusters<Option<f64>>,
    keep: impl Fn(u32) -> bool,
    q: f64,
    side: Side,
) -> Result<Influences, Refusal> {
    let kept = || clusters.iter().filter(|(k, _)| keep(**k));
    let mut sorted: Vec<f64> = kept().flat_map(|(_, v)| v).map(|t| late(*t)).collect();
    if sorted.is_empty() {
        return Err(Refusal::Empty { side });
    }
    sorted.sort_by(f64::total_cmp);
    let value = at_rank(&sorted, q);
    if !value.is_finite() {
        return Err(Refusal::BeyondWindow {
            side,
            percentile: 100.0 * q,
            missed: sorted.iter().filter(|t| !t.is_finite()).count() as u32,
            trials: sorted.len() as u32,
        });
    }
    let times = &sorted[..sorted.partition_point(|t| t.is_finite())];
    let density = density(times, sorted.len(), q);
    let below = times.partition_point(|t| *t <= value) as f64 / sorted.len() as f64;
    let influence = |t: &Option<f64>| {
        let under = f64::from(u8::from(late(*t) <= value));
        (below - under) / density
    };
    let places = kept().map(|(k, v)| (*k, v.iter().map(influence).collect()));
    Ok(Influences {
        value,
        places: places.collect(),
    })
}

/// The density of times at their quantile `q`, from the difference quotient of the quantile function over the bandwidth
/// of Hall and Sheather (1988), cut where times end; infinite where times coincide.
fn density(times: &[f64], trials: usize, q: f64) -> f64 {
    let n = trials as f64;
    let z = super::distributions::normal_quantile(q);
    let phi = libm::exp(-0.5 * z * z) / (2.0 * std::f64::consts::PI).sqrt();
    let width = libm::cbrt(1.96 * 1.96 * 1.5 * phi * phi / (2.0 * z * z + 1.0) / n);
    // Ranks among the times are ranks among the trials, scaled.
    let scale = (n - 1.0).max(1.0) / (times.len() as f64 - 1.0).max(1.0);
    let (low, high) = ((q - width).max(0.0), (q + width).min(1.0 / scale));
    let gap = at_rank(times, high * scale) - at_rank(times, low * scale);
    if gap > 0.0 {
        (high - low) / gap
    } else {
        f64::INFINITY
    }
}
