//! Owns learning one quantity: the regression, its errors at left-out locations, and intervals that follow from these.

use rayon::prelude::*;

use super::features::Observation;
use super::regression::{Prediction, Regression};
use crate::calibrate::Folds;
use crate::locator::{log_density, student_weight};
use crate::result::{NoQuantity, Ranged};
use crate::sets::CalibrationPress;

/// Fewest calibration locations.
const LOCATIONS: u32 = 8;
/// Level of the intervals.
const LEVEL: f64 = 0.95;
/// Factors on the model's variance that are compared: powers of two between these.
const INFLATION_LOG2: std::ops::RangeInclusive<i32> = 0..=10;
/// Standard deviation of the prior of the logarithm of that factor.
const LOOSE: f64 = 2.0;
/// Rounds of the common size.
const ROUNDS: usize = 30;

/// A calibration press with what its quantity measured.
#[derive(Debug, Clone, Copy)]
pub(super) struct Teacher {
    pub press: CalibrationPress,
    pub observation: Observation,
    /// Measured quantity, positive.
    pub measured: f64,
}

/// A learnt quantity.
pub(super) struct Learnt {
    regression: Regression,
    intervals: Intervals,
    /// Smallest and largest measurement of the teachers.
    pub taught: [f64; 2],
    /// Each teacher by a model that has not seen its location.
    pub left_out: Vec<Option<Ranged>>,
}

/// How intervals follow from predictions.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Intervals {
    /// Factor on the model's variance.
    inflation: f64,
    /// Half width in standard deviations; `None` if too few presses determine it.
    factor: Option<f64>,
}

impl Learnt {
    /// Learns from calibration presses.
    pub(super) fn new(teachers: &mut [Teacher], seed: u64) -> Result<Self, NoQuantity> {
        let key = |t: &Teacher| (t.press.location, t.press.repetition, t.press.press);
        teachers.sort_unstable_by_key(key);
        let mut locations: Vec<u32> = teachers.iter().map(|t| t.press.location).collect();
        locations.dedup();
        let found = locations.len() as u32;
        if found < LOCATIONS {
            return Err(NoQuantity::FewLocations {
                needed: LOCATIONS,
                found,
            });
        }
        let pairs: Vec<(Observation, f64)> = teachers
            .iter()
            .map(|t| (t.observation, t.measured))
            .collect();
        let regression = Regression::fit(&pairs, None).ok_or(NoQuantity::Degenerate)?;
        let presses: Vec<CalibrationPress> = teachers.iter().map(|t| t.press).collect();
        let measured = || teachers.iter().map(|t| t.measured);
        let taught = [
            measured().fold(f64::INFINITY, f64::min),
            measured().fold(0.0, f64::max),
        ];
        let folds = Folds::deal(&presses, seed);
        let held = folds.each(|_, kept, held| {
            let part: Vec<_> = kept.iter().map(|i| pairs[*i]).collect();
            let fitted = Regression::fit(&part, Some(regression.logs()))?;
            let each = held.par_iter().map(|i| fitted.predict(&pairs[*i].0));
            Some(each.collect::<Vec<Option<Prediction>>>())
        });
        let held = held.ok_or(NoQuantity::Degenerate)?;
        let errors: Vec<(Prediction, f64)> = held
            .iter()
            .zip(&pairs)
            .filter_map(|(p, (_, measured))| {
                let prediction = (*p)?;
                Some((prediction, libm::log(*measured) - prediction.mean))
            })
            .collect();
        let intervals = Intervals::from_held_out(&errors);
        let left_out = held.into_iter().map(|p| Some(intervals.around(p?)));
        Ok(Self {
            left_out: left_out.collect(),
            regression,
            intervals,
            taught,
        })
    }

    /// The quantity of a press. Beyond what was taught it has no interval: nothing says how the skin answers there.
    pub(super) fn estimate(&self, observation: &Observation) -> Option<Ranged> {
        let prediction = self.regression.predict(observation)?;
        let mut ranged = self.intervals.around(prediction);
        ranged.interval = ranged
            .interval
            .filter(|ends| !is_beyond(ranged.value, *ends, self.taught));
        Some(ranged)
    }
}

/// True if a value with this interval is beyond what was `taught` by more than half of the way to the interval's end: a standard
/// deviation. By noise alone, one of six presses at the outermost depth is.
fn is_beyond(value: f64, [low, high]: [f64; 2], taught: [f64; 2]) -> bool {
    let halfway = |end: f64| (value * end).sqrt();
    halfway(high) < taught[0] || halfway(low) > taught[1]
}

impl Intervals {
    /// The most likely factor on the model's variance, then the conformal quantile: of n + 1 presses, the new one included,
    /// 95 % lie inside.
    fn from_held_out(errors: &[(Prediction, f64)]) -> Self {
        let inflation = INFLATION_LOG2
            .map(|log2| libm::exp2(f64::from(log2)))
            .map(|inflation| (unlikelihood(errors, inflation), inflation))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(1.0, |(_, inflation)| inflation);
        let each = errors.iter();
        let mut sizes: Vec<f64> = each
            .map(|(p, error)| error.abs() / deviation(p, inflation))
            .collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let rank = ((sizes.len() + 1) as f64 * LEVEL).ceil() as usize;
        Self {
            inflation,
            factor: sizes.get(rank - 1).copied(),
        }
    }

    fn around(&self, prediction: Prediction) -> Ranged {
        let sd = deviation(&prediction, self.inflation);
        let end = |side: f64| {
            let half = self.factor? * sd;
            Some(libm::exp(prediction.mean + side * half))
        };
        Ranged {
            value: libm::exp(prediction.mean),
            interval: end(-1.0).zip(end(1.0)).map(|(low, high)| [low, high]),
        }
    }
}

fn deviation(p: &Prediction, inflation: f64) -> f64 {
    (inflation * p.model + p.noise).sqrt()
}

/// Negative logarithm of the posterior density of a factor on the model's variance, up to a constant: errors are those of
/// Student's t with 4 degrees of freedom and a common size.
fn unlikelihood(errors: &[(Prediction, f64)], inflation: f64) -> f64 {
    let each = errors.iter();
    let rows: Vec<(f64, f64)> = each
        .map(|(p, error)| {
            let variance = inflation * p.model + p.noise;
            (error * error / variance, 0.5 * libm::log(variance))
        })
        .collect();
    let n = rows.len().max(1) as f64;
    let mut size = 1.0;
    for _ in 0..ROUNDS {
        let each = rows.iter();
        let sum: f64 = each.map(|(d, _)| d * student_weight(d / size, 1.0)).sum();
        size = (sum / n).max(f64::MIN_POSITIVE);
    }
    let off = libm::log(inflation) / LOOSE;
    let each = rows.iter();
    let sum: f64 = each
        .map(|(d, log_root)| log_root + 0.5 * libm::log(size) - log_density(d / size, 1.0))
        .sum();
    0.5 * off * off + sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_taught_is_beyond() {
        let taught = [1.5, 2.5];
        assert!(is_beyond(1.2, [0.86, 1.68], taught));
        assert!(is_beyond(3.0, [2.5, 3.6], taught));
        // By noise, presses at the ends seem shallower or deeper than they are.
        assert!(!is_beyond(1.45, [1.2, 1.75], taught));
        assert!(!is_beyond(2.6, [2.3, 2.9], taught));
        assert!(!is_beyond(2.0, [1.7, 2.4], taught));
    }

    #[test]
    fn an_interval_is_the_conformal_quantile() {
        let prediction = Prediction {
            mean: 0.0,
            model: 0.0,
            noise: 1.0,
        };
        let errors: Vec<(Prediction, f64)> =
            (1..=19).map(|i| (prediction, 0.1 * f64::from(i))).collect();
        let intervals = Intervals::from_held_out(&errors);
        assert_eq!(intervals.inflation, 1.0);
        // 20 presses with the new one: 19 of them lie inside.
        assert!((intervals.factor.unwrap() - 1.9).abs() < 1e-12);
        assert_eq!(Intervals::from_held_out(&errors[..18]).factor, None);
        let around = intervals.around(prediction).interval.unwrap();
        assert!((around[0] * around[1] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_model_too_sure_of_itself_is_widened() {
        // Errors follow a model variance 16 times as large as stated. Without noise a common size would explain them.
        let errors: Vec<(Prediction, f64)> = (0..200)
            .map(|i| {
                let model = if i % 2 == 0 { 1e-6 } else { 1e-2 };
                let noise = 1e-3;
                let sign = if i % 4 < 2 { 1.0 } else { -1.0 };
                let prediction = Prediction {
                    mean: 0.0,
                    model,
                    noise,
                };
                let z = 0.2 + 0.01 * f64::from(i);
                (prediction, sign * z * (16.0f64 * model + noise).sqrt())
            })
            .collect();
        let found = Intervals::from_held_out(&errors).inflation;
        assert!((8.0..=32.0).contains(&found), "{found}");
    }
}
