//! Populations of presses with known errors: their sessions, and the true value of every metric.

use skinrig_analysis::metrics::{Exclusions, metrics, penalised};
use skinrig_analysis::result::Estimate;
use skinrig_analysis::sets::ScoreSet;
use skinrig_model::{SkinOutline, Verdict};
use skinrig_planted::grid::Random;

use crate::metrics::row;

/// Names of the metrics, in the order of [`Population::estimates`].
pub(crate) const METRICS: [&str; 11] = [
    "RMSE",
    "RMSE x",
    "RMSE y",
    "bias x",
    "bias y",
    "median",
    "95th percentile",
    "std between repetitions",
    "located",
    "within 5 mm",
    "RMSE with failures",
];
/// Resamples of the bootstrap: the default.
const RESAMPLES: u32 = 2000;
const WITHIN_MM: f64 = 5.0;
/// Set, so that its size is no random number.
const PENALTY_MM: f64 = 30.0;
/// Locations of the session whose metrics are the true values.
const MANY: u32 = 100_000;

/// Independent locations with a common error at each, and presses about it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Population {
    pub name: &'static str,
    pub places: u32,
    pub repetitions: u32,
    /// Standard deviation per axis of the error that the presses of a location share, and of a press about it, mm.
    pub place_mm: f64,
    pub press_mm: f64,
    /// Share of locations with errors four times as large.
    pub outlying: f64,
    /// Share of presses that are not located.
    pub failing: f64,
}

impl Population {
    pub(crate) const USUAL: Self = Self {
        name: "100 locations, 2 repetitions",
        places: 100,
        repetitions: 2,
        place_mm: 1.5,
        press_mm: 1.0,
        outlying: 0.0,
        failing: 0.05,
    };

    fn set(&self, places: u32, random: &mut Random) -> ScoreSet {
        let mut presses = Vec::new();
        for location in 0..places {
            let size = if random.unit() < self.outlying {
                4.0
            } else {
                1.0
            };
            let mut pair =
                |mm: f64, about: [f64; 2]| about.map(|centre| centre + size * mm * random.normal());
            let place = pair(self.place_mm, [0.4, -0.2]);
            let errors: Vec<[f64; 2]> = (0..self.repetitions)
                .map(|_| pair(self.press_mm, place))
                .collect();
            for error in errors {
                let is_located = random.unit() >= self.failing;
                let verdict = if is_located {
                    Verdict::Valid
                } else {
                    Verdict::Excluded
                };
                presses.push(row(location, is_located.then(|| error.into()), verdict));
            }
        }
        ScoreSet::from_presses(&presses, &[])
    }

    fn estimates(set: &ScoreSet, resamples: u32) -> [Estimate; METRICS.len()] {
        let outline = SkinOutline::PAPER;
        let m = metrics(set, Exclusions::Applied, &outline, WITHIN_MM, resamples, 1);
        let failures = penalised(set, Some(PENALTY_MM), resamples, 1);
        [
            m.rmse_mm,
            m.rmse_x_mm,
            m.rmse_y_mm,
            m.bias_x_mm,
            m.bias_y_mm,
            m.median_mm,
            m.p95_mm,
            m.repeat_std_mm,
            m.located_rate,
            m.within_rate,
            failures.rmse_mm,
        ]
    }

    /// The true values: those of a very large session.
    pub(crate) fn truth(&self) -> [Option<f64>; METRICS.len()] {
        let set = self.set(MANY, &mut Random(99));
        Self::estimates(&set, 0).map(|e| e.value)
    }

    /// The estimates of the session with this number.
    pub(crate) fn session(&self, number: u64) -> [Estimate; METRICS.len()] {
        let mut random = Random(number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        for _ in 0..8 {
            random.unit();
        }
        Self::estimates(&self.set(self.places, &mut random), RESAMPLES)
    }
}
