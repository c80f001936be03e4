//! Estimates of a detector at one threshold, with intervals over locations: ranks for percentiles of the onsets, expanded percentiles
//! of a bootstrap (Hesterberg 2015) for their width and the detected share; exact ones for false alarms, and where nothing or
//! everything was detected.

use rayon::prelude::*;

use super::sweep::OnsetStatistics;
use crate::exact;
use crate::metrics::quantile;
use crate::over_locations::Draws;
use crate::result::Estimate;
use skinrig_statistics::distributions::{normal_cdf, student_quantile};
use skinrig_statistics::{Sample, SampleFault, seeded};

/// Probability outside a 95 % interval on each side.
const TAIL: f64 = 0.025;

/// Number of quantities with an interval, in the order of [`Figures`].
const COUNT: usize = 2;
/// (value, n) of each: detected share, width.
type Figures = [(Option<f64>, u32); COUNT];
const DETECTED: usize = 0;

/// One trial at one threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Location of the press.
    pub location: u32,
    /// Onset after contact, ms; `None` if not detected, or preceded by a false alarm.
    pub onset_ms: Option<f64>,
    /// True if a false alarm ended the search.
    pub false_alarm: bool,
    /// Time in which a detection is a false alarm, s.
    pub at_risk_s: f64,
}

/// Estimated quantities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimates {
    /// Share of trials with a counting onset; n: trials. For a share of 0 or 1 the interval is the exact binomial one over
    /// the locations.
    pub detected_rate: Estimate,
    /// Width of the counting onsets, ms; n: their number.
    pub width_ms: Estimate,
    /// Median of all onsets, ms; n: their number.
    pub median_ms: Estimate,
    /// False alarms divided by the time at risk, per second; n: trials. The interval is the exact Poisson interval.
    pub false_alarms_per_s: Estimate,
    /// 5th, 50th and 95th percentile of the onsets, ms; n: their number.
    pub from_contact_ms: [Estimate; 3],
}

/// Parameters of the estimation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plan {
    /// An onset counts if it is this close to the median, ms.
    pub window_ms: f64,
    /// Bootstrap resamples.
    pub resamples: u32,
    /// Seed of the bootstrap.
    pub seed: u64,
}

impl Plan {
    /// Estimates with bootstrap intervals over whole locations. Threshold and margins stay fixed.
    #[must_use]
    pub fn estimate(&self, outcomes: &[Outcome]) -> Estimates {
        let mut sorted = outcomes.to_vec();
        sorted.sort_by_key(|o| o.location);
        let places: Vec<&[Outcome]> = sorted.chunk_by(|a, b| a.location == b.location).collect();
        let figures = self.figures(&places);
        let samples: Vec<Figures> = if places.len() > 1 && self.resamples > 1 {
            let draw = |sample: u32| {
                let mut rng = seeded::generator(self.seed, u64::from(sample));
                let one = |_| places[seeded::index(&mut rng, places.len())];
                let drawn: Vec<&[Outcome]> = (0..places.len()).map(one).collect();
                self.figures(&drawn)
            };
            (0..self.resamples).into_par_iter().map(draw).collect()
        } else {
            Vec::new()
        };
        let estimate = |k: usize| {
            let (value, n) = figures[k];
            let mut values: Vec<f64> = samples.iter().filter_map(|s| s[k].0).collect();
            let mut end = |q| quantile(&mut values, q);
            let outside = tail(places.len());
            let bootstrap = end(outside).zip(end(1.0 - outside));
            let ends = value.zip(bootstrap).map(|(value, ends)| match k {
                DETECTED => exact::share(value, places.len(), ends),
                _ => ends,
            });
            Estimate {
                value,
                low: ends.map(|e| e.0),
                high: ends.map(|e| e.1),
                n,
            }
        };
        let median_ms = self.percentile(outcomes, 0.5, false, |all| {
            Sample::median(all.iter().map(|(at, ms)| (*at, Some(*ms))))
        });
        let outer = |q: f64, low: bool| {
            self.percentile(outcomes, q, low, |all| {
                Sample::percentile_95(all.iter().copied())
            })
        };
        Estimates {
            detected_rate: estimate(DETECTED),
            width_ms: estimate(1),
            median_ms,
            false_alarms_per_s: false_alarms_per_s(outcomes),
            from_contact_ms: [outer(0.05, true), median_ms, outer(0.95, false)],
        }
    }

    /// A percentile of all onsets with its interval by ranks; of the onsets with the other sign if `low`. Where an end lies beyond
    /// all onsets there is no interval.
    fn percentile(
        &self,
        outcomes: &[Outcome],
        q: f64,
        low: bool,
        sample: impl Fn(&[(u32, f64)]) -> Result<Sample, SampleFault>,
    ) -> Estimate {
        let sign = if low { -1.0 } else { 1.0 };
        let onset = |o: &Outcome| Some((o.location, sign * o.onset_ms?));
        let onsets: Vec<(u32, f64)> = outcomes.iter().filter_map(onset).collect();
        let draws = Draws {
            resamples: self.resamples,
            seed: self.seed,
        };
        let ends = draws.ends(sample(&onsets));
        let ends = ends.map(|(a, b)| if low { (-b, -a) } else { (a, b) });
        let mut values: Vec<f64> = onsets.iter().map(|o| sign * o.1).collect();
        Estimate::new(quantile(&mut values, q), ends, onsets.len())
    }

    fn figures(&self, places: &[&[Outcome]]) -> Figures {
        let all = || places.iter().flat_map(|p| p.iter());
        let trials = all().count() as u32;
        let onsets: Vec<f64> = all().filter_map(|o| o.onset_ms).collect();
        let hits = OnsetStatistics::of(onsets, self.window_ms);
        let share = (trials > 0).then(|| f64::from(hits.count) / f64::from(trials));
        [(share, trials), (hits.width_ms, hits.count)]
    }
}

/// Probability outside the percentile interval of a bootstrap over so many locations on each side. Percentiles at
/// [`TAIL`] are too narrow, as a normal interval is that ignores that its scale is estimated and divides by n instead of n - 1.
fn tail(places: usize) -> f64 {
    let n = places.max(2) as f64;
    let wider = student_quantile(1.0 - TAIL, n - 1.0) * (n / (n - 1.0)).sqrt();
    normal_cdf(-wider)
}

/// Without time at risk there is no rate, not even 0.
fn false_alarms_per_s(outcomes: &[Outcome]) -> Estimate {
    let count = outcomes.iter().filter(|o| o.false_alarm).count();
    let at_risk_s: f64 = outcomes.iter().map(|o| o.at_risk_s).sum();
    let known = at_risk_s > 0.0;
    let ends = known.then(|| exact::rate_per_s(count as u64, at_risk_s));
    Estimate {
        value: known.then(|| count as f64 / at_risk_s),
        low: ends.map(|e| e.0),
        high: ends.map(|e| e.1),
        n: outcomes.len() as u32,
    }
}
