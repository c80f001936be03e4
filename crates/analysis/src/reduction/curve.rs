//! Rows of a reduction curve: means over seeds, intervals over locations (exact ones for shares of 0 and 1).

use rayon::prelude::*;
use skinrig_model::AnalysisSettings;

use super::trials::{Outcome, Trial};
use crate::bit_rates::in_bytes;
use crate::exact;
use crate::metrics::{quantile, tail};
use crate::result::{Estimate, ReductionRow};
use crate::seeded;

/// Data common to the rows of all curves.
pub(super) struct CurveContext<'a> {
    pub settings: &'a AnalysisSettings,
    /// Smaller errors pass, mm.
    pub pass_threshold_mm: Option<f64>,
    /// Mean idle rate of both cameras before the presses.
    pub idle_events_per_s: Estimate,
}

/// Counts and squared errors of some presses at one factor.
#[derive(Debug, Clone, PartialEq)]
struct Sums {
    presses: f64,
    /// Per seed: presses located, and the sum of their squared errors, mm².
    seeds: Vec<[f64; 2]>,
    /// Presses that pass and presses within the limit, summed over seeds.
    passed: f64,
    within: f64,
    /// Events per second of both cameras, summed over seeds.
    events_per_s: f64,
}

/// RMSE, pass rate, within rate, located rate and events per second: means over seeds.
type Values = [Option<f64>; 5];
/// Indices of the RMSE and the events per second; the others are shares.
const RMSE: usize = 0;
const RATE: usize = 4;

impl Sums {
    fn new(seeds: usize) -> Self {
        Self {
            presses: 0.0,
            seeds: vec![[0.0; 2]; seeds],
            passed: 0.0,
            within: 0.0,
            events_per_s: 0.0,
        }
    }

    fn add(&mut self, other: &Self) {
        self.presses += other.presses;
        self.passed += other.passed;
        self.within += other.within;
        self.events_per_s += other.events_per_s;
        for (sum, term) in self.seeds.iter_mut().zip(&other.seeds) {
            sum[0] += term[0];
            sum[1] += term[1];
        }
    }

    /// RMSE of each seed that locates any press, mm.
    fn rmse_of_seeds_mm(&self) -> impl Iterator<Item = f64> {
        let located = self.seeds.iter().filter(|[n, _]| *n > 0.0);
        located.map(|[n, squares]| (squares / n).sqrt())
    }

    /// `passes` is false without a pass threshold.
    fn values(&self, passes: bool) -> Values {
        let (mut sum, mut count) = (0.0, 0.0);
        for rmse in self.rmse_of_seeds_mm() {
            sum += rmse;
            count += 1.0;
        }
        let trials = self.presses * self.seeds.len() as f64;
        let share = |n: f64| (trials > 0.0).then(|| n / trials);
        let located: f64 = self.seeds.iter().map(|s| s[0]).sum();
        [
            (count > 0.0).then(|| sum / count),
            share(self.passed).filter(|_| passes),
            share(self.within),
            share(located),
            share(self.events_per_s),
        ]
    }
}

impl CurveContext<'_> {
    /// Rows of the curve for one kind of thinning, factor 1 first.
    pub(super) fn rows(&self, outcomes: &[Outcome], kind: usize) -> Vec<ReductionRow> {
        let mut sorted: Vec<&Outcome> = outcomes.iter().collect();
        sorted.sort_by_key(|o| o.location);
        let places: Vec<&[&Outcome]> = sorted.chunk_by(|a, b| a.location == b.location).collect();
        let powers = 0..=self.settings.reduction.max_power as usize;
        powers
            .into_par_iter()
            .map(|power| self.row(&places, kind, power))
            .collect()
    }

    fn row(&self, places: &[&[&Outcome]], kind: usize, power: usize) -> ReductionRow {
        let seeds = self.settings.reduction.seeds as usize;
        let place_sums: Vec<Sums> = places
            .iter()
            .map(|place| self.sums(place, kind, power))
            .collect();
        let mut total = Sums::new(seeds);
        place_sums.iter().for_each(|s| total.add(s));
        let estimates = self.estimates(&place_sums, &total);
        let outcomes = || places.iter().flat_map(|place| place.iter());
        let trials = || outcomes().flat_map(|o| (0..seeds).map(move |s| o.trial(s, kind, power)));
        let located = outcomes()
            .filter(|o| (0..seeds).any(|s| o.trial(s, kind, power).error_mm.is_some()))
            .count();
        let mean = |of: fn(&Trial) -> f64| trials().map(of).sum::<f64>() / trials().count() as f64;
        let bits = self.settings.bits_per_event;
        let factor = 1u32 << power;
        let [rmse, pass_rate, within_rate, located_rate, rate] = estimates;
        ReductionRow {
            factor,
            events_per_view: mean(|t| f64::from(t.events)) / 2.0,
            rmse_mm: Estimate {
                n: located as u32,
                ..rmse
            },
            rmse_of_seeds_mm: (located > 0).then(|| {
                let all = || total.rmse_of_seeds_mm();
                (
                    all().fold(f64::INFINITY, f64::min),
                    all().fold(0.0, f64::max),
                )
            }),
            pass_rate,
            within_rate,
            located_rate,
            press_bytes_per_s: in_bytes(&rate, bits),
            idle_bytes_per_s: in_bytes(&self.idle_events_per_s, bits / f64::from(factor)),
        }
    }

    fn sums(&self, place: &[&Outcome], kind: usize, power: usize) -> Sums {
        let mut sums = Sums::new(self.settings.reduction.seeds as usize);
        sums.presses = place.len() as f64;
        for outcome in place {
            for (seed, of_seed) in sums.seeds.iter_mut().enumerate() {
                sums.events_per_s += outcome.trial(seed, kind, power).events_per_s;
                let Some(error) = outcome.trial(seed, kind, power).error_mm else {
                    continue;
                };
                of_seed[0] += 1.0;
                of_seed[1] += error * error;
                sums.passed += f64::from(self.pass_threshold_mm.is_some_and(|t| error < t));
                sums.within += f64::from(error <= self.settings.within_mm);
            }
        }
        sums
    }

    fn estimates(&self, places: &[Sums], total: &Sums) -> [Estimate; 5] {
        let resamples = self.settings.bootstrap_resamples;
        let passes = self.pass_threshold_mm.is_some();
        let values = total.values(passes);
        let samples: Vec<Values> = if places.len() > 1 && resamples > 1 {
            (0..resamples)
                .map(|sample| {
                    let mut rng = seeded::generator(self.settings.seed, u64::from(sample));
                    let mut drawn = Sums::new(total.seeds.len());
                    for _ in 0..places.len() {
                        drawn.add(&places[seeded::index(&mut rng, places.len())]);
                    }
                    drawn.values(passes)
                })
                .collect()
        } else {
            Vec::new()
        };
        std::array::from_fn(|k| {
            let mut sampled: Vec<f64> = samples.iter().filter_map(|s| s[k]).collect();
            let mut end = |q: f64| quantile(&mut sampled, q);
            let outside = tail(places.len());
            let bootstrap = end(outside).zip(end(1.0 - outside));
            let ends = values[k].zip(bootstrap).map(|(value, ends)| match k {
                RMSE | RATE => ends,
                _ => exact::share(value, places.len(), ends),
            });
            Estimate {
                value: values[k],
                low: ends.map(|e| e.0),
                high: ends.map(|e| e.1),
                n: total.presses as u32,
            }
        })
    }
}
