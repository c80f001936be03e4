//! Estimates over presses, with 95 % intervals that take each location as one draw, because its presses share an error.

use skinrig_statistics::{ComparisonError, Interval, Sample, SampleFault, Settings};

use crate::distinct::distinct;
use crate::exact;
use crate::result::Estimate;

/// How to draw for an interval.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Draws {
    /// Bootstrap resamples; too few for an interval (below 39) give none.
    pub resamples: u32,
    pub seed: u64,
}

impl Draws {
    fn settings(self) -> Settings {
        Settings {
            resamples: self.resamples,
            seed: self.seed,
            ..Settings::default()
        }
    }

    /// Both ends of the interval of a sample; `None` if it has none, or one that is open.
    pub(crate) fn ends(self, sample: Result<Sample, SampleFault>) -> Option<(f64, f64)> {
        Self::both(skinrig_statistics::estimate(
            &sample.ok()?,
            &self.settings(),
        ))
    }

    /// The same for a root mean square with failures.
    pub(crate) fn ends_with_failures(
        self,
        errors: impl IntoIterator<Item = (u32, f64)>,
        failures: impl IntoIterator<Item = (u32, bool)>,
        failed: f64,
    ) -> Option<(f64, f64)> {
        let errors = Sample::rms(errors).ok()?;
        let failures = Sample::share(failures);
        let settings = self.settings();
        Self::both(skinrig_statistics::rms_with_failures(
            &errors, &failures, failed, &settings,
        ))
    }

    fn both(found: Result<Interval, ComparisonError>) -> Option<(f64, f64)> {
        found.ok().and_then(|i| i.low.zip(i.high))
    }

    /// Ends of a share over locations: exact if it is 0 or 1. Each trial was repeated `times` on the same data.
    pub(crate) fn ends_of_share(self, trials: &[(u32, bool)], times: u32) -> Option<(f64, f64)> {
        let sample = Sample::share_of_repeated(trials.iter().copied(), times);
        let ends = self.ends(Ok(sample))?;
        let locations = distinct(trials.iter().map(|(location, _)| *location));
        let successes = trials.iter().filter(|(_, is)| *is).count();
        let share = successes as f64 / trials.len() as f64;
        Some(exact::share(share, locations.len(), ends))
    }
}

/// Mean of all values with its interval. Each value comes with its location, in any order.
#[must_use]
pub fn mean_over_locations(values: &[(u32, f64)], resamples: u32, seed: u64) -> Estimate {
    let value = crate::sums::mean(values.iter().map(|v| v.1));
    let ends = Draws { resamples, seed }.ends(Sample::mean(values.iter().copied()));
    Estimate::new(value, ends, values.len())
}

/// The same for values that are never below 0: neither is the interval.
pub(crate) fn rate_over_locations(values: &[(u32, f64)], resamples: u32, seed: u64) -> Estimate {
    let mean = mean_over_locations(values, resamples, seed);
    Estimate {
        low: mean.low.map(|low| low.max(0.0)),
        ..mean
    }
}

/// Root mean square of all values with its interval. Each value comes with its location, in any order.
#[must_use]
pub fn rms_over_locations(values: &[(u32, f64)], resamples: u32, seed: u64) -> Estimate {
    let value = crate::sums::root_mean_square(values.iter().map(|v| v.1));
    let ends = Draws { resamples, seed }.ends(Sample::rms(values.iter().copied()));
    Estimate::new(value, ends, values.len())
}

/// Share of values that are true, each with its location: interval over locations, exact for 0 and 1.
#[must_use]
pub fn share_over_locations(values: &[(u32, bool)], resamples: u32, seed: u64) -> Estimate {
    let numbers = values.iter().map(|(_, is)| f64::from(u8::from(*is)));
    let value = crate::sums::mean(numbers);
    let ends = Draws { resamples, seed }.ends_of_share(values, 1);
    Estimate::new(value, ends, values.len())
}
