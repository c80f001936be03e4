//! Rows of a reduction curve: figures over all presses and seeds, intervals over locations.

use rayon::prelude::*;
use skinrig_model::AnalysisSettings;

use super::trials::{Outcome, Trial};
use crate::bit_rates::in_bytes;
use crate::over_locations::{Draws, rate_over_locations, rms_over_locations};
use crate::result::{Estimate, ReductionRow};
use crate::sums;

/// Data common to the rows of all curves.
pub(super) struct CurveContext<'a> {
    pub settings: &'a AnalysisSettings,
    /// Smaller errors pass, mm.
    pub pass_threshold_mm: Option<f64>,
    /// Mean idle rate of both cameras before the presses.
    pub idle_events_per_s: Estimate,
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
        let outcomes = || places.iter().flat_map(|place| place.iter());
        let of_seed =
            |seed: usize| outcomes().map(move |o| (o.location, o.trial(seed, kind, power)));
        let trials = || (0..seeds).flat_map(of_seed);
        let errors: Vec<(u32, f64)> = trials()
            .filter_map(|(location, t)| Some((location, t.error_mm?)))
            .collect();
        let rmse_of = |seed| sums::root_mean_square(of_seed(seed).filter_map(|t| t.1.error_mm));
        let rmse_of_seeds: Vec<f64> = (0..seeds).filter_map(rmse_of).collect();
        let n = outcomes().count();
        let share = |of: &dyn Fn(f64) -> bool| {
            let is = |t: &Trial| t.error_mm.is_some_and(of);
            let all: Vec<(u32, bool)> = trials().map(|(at, t)| (at, is(t))).collect();
            let passed = all.iter().filter(|(_, is)| *is).count() as f64;
            let value = (!all.is_empty()).then(|| passed / all.len() as f64);
            Estimate::new(value, self.draws().ends_of_share(&all, seeds as u32), n)
        };
        let rates: Vec<(u32, f64)> = trials().map(|(at, t)| (at, t.events_per_s)).collect();
        let mean = |of: fn(&Trial) -> f64| sums::mean(trials().map(|(_, t)| of(t)));
        let (resamples, seed) = (self.settings.bootstrap_resamples, self.settings.seed);
        let bits = self.settings.bits_per_event;
        let factor = 1u32 << power;
        let located =
            |o: &&&Outcome| (0..seeds).any(|s| o.trial(s, kind, power).error_mm.is_some());
        ReductionRow {
            factor,
            events_per_view: mean(|t| f64::from(t.events)).unwrap_or(0.0) / 2.0,
            rmse_mm: Estimate {
                n: outcomes().filter(located).count() as u32,
                ..rms_over_locations(&errors, resamples, seed)
            },
            rmse_of_seeds_mm: rmse_of_seeds
                .iter()
                .copied()
                .reduce(f64::min)
                .zip(rmse_of_seeds.iter().copied().reduce(f64::max)),
            pass_rate: match self.pass_threshold_mm {
                Some(threshold) => share(&|error| error < threshold),
                None => Estimate::new(None, None, n),
            },
            within_rate: share(&|error| error <= self.settings.within_mm),
            located_rate: share(&|_| true),
            press_bytes_per_s: in_bytes(
                &Estimate {
                    n: n as u32,
                    ..rate_over_locations(&rates, resamples, seed)
                },
                bits,
            ),
            idle_bytes_per_s: in_bytes(&self.idle_events_per_s, bits / f64::from(factor)),
        }
    }

    const fn draws(&self) -> Draws {
        Draws {
            resamples: self.settings.bootstrap_resamples,
            seed: self.settings.seed,
        }
    }
}
