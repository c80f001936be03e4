//! Sizes of the 95 % regions from held-out calibration presses.

use super::prediction::{Uncertainty, distance};
use super::robust::{log_density, student_weight};
use crate::result::{LocatorModel, RegionLevel};

/// Level of the regions of the press table.
pub(super) const LEVEL: f64 = 0.95;
/// Levels of the regions.
const LEVELS: [f64; 6] = [0.5, 0.7, 0.8, 0.9, LEVEL, 0.99];
/// Fewest locations that determine a region.
const FEWEST: usize = 5;
/// Held-out presses outside the region, on average, below which the distribution of the distances is assumed.
const TAIL_PRESSES: f64 = 2.0;
/// A distance counts at most this many medians where the distribution is assumed.
const BOUND_MEDIANS: f64 = 9.0;

/// Rounds of the common size.
const ROUNDS: usize = 30;
/// Factors on the variance of the model that are compared: powers of two between these.
const INFLATION_LOG2: std::ops::RangeInclusive<i32> = 0..=14;
/// Standard deviation of the prior of the logarithm of that factor about 1.
const LOOSE: f64 = 2.0;
/// Degrees of freedom of a scatter per location. Errors of presses have heavier tails than normal ones, because some presses dent the skin
/// little: with an excess kurtosis k a variance is known as from 2 / (2 + k) times as many. Our choice, k = 0.9.
const FREEDOM: f64 = 0.7;

/// The error of a held-out calibration press, mm, and what was predicted about it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct HeldOutError {
    pub uncertainty: Uncertainty,
    pub error: [f64; 2],
}

/// How large regions are, from held-out calibration presses.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Regions {
    /// Factor on the variance of the model.
    pub inflation: f64,
    /// Squared sizes in units of the covariance with that factor.
    pub levels: Vec<RegionLevel>,
}

impl Regions {
    /// From held-out presses that have a position; a region is a statement about those. `locations`: number of their
    /// locations.
    ///
    /// A model learnt from few presses underestimates its error between and beyond them: its variance is multiplied by the most likely
    /// factor that leaves presses the scatter that they have by themselves. What remains is a common size, which [`levels`] finds.
    pub(super) fn from_held_out(reached: &[HeldOutError], locations: usize) -> Self {
        let likely = INFLATION_LOG2
            .map(|log2| libm::exp2(f64::from(log2)))
            .filter_map(|inflation| Some((Likely::new(reached, inflation)?, inflation)))
            .filter(|(likely, inflation)| *inflation == 1.0 || likely.size >= 1.0)
            .min_by(|(a, _), (b, _)| a.cost.total_cmp(&b.cost));
        let inflation = likely.map_or(1.0, |(_, inflation)| inflation);
        let each = reached.iter();
        let distances: Vec<f64> = each
            .filter_map(|r| distance(r.uncertainty.covariance(inflation)?, r.error))
            .collect();
        Self {
            inflation,
            levels: levels(&distances, locations),
        }
    }
}

/// How likely a factor on the variance of the model is.
struct Likely {
    /// Negative logarithm of its posterior density, up to a constant.
    cost: f64,
    /// Most likely common factor on all variances.
    size: f64,
}

impl Likely {
    /// Errors are those of Student's t with 4 degrees of freedom and a common size. `None` if a covariance is degenerate.
    fn new(reached: &[HeldOutError], inflation: f64) -> Option<Self> {
        let mut rows = Vec::with_capacity(reached.len());
        for r in reached {
            let covariance = r.uncertainty.covariance(inflation)?;
            let [xx, xy, yy] = covariance;
            rows.push((
                distance(covariance, r.error)?,
                0.5 * libm::log(xx * yy - xy * xy),
            ));
        }
        let n = rows.len() as f64;
        let mut size = 1.0;
        for _ in 0..ROUNDS {
            let each = rows.iter();
            let sum: f64 = each.map(|(d, _)| d * student_weight(d / size, 2.0)).sum();
            size = (sum / (2.0 * n)).max(f64::MIN_POSITIVE);
        }
        let off = libm::log(inflation) / LOOSE;
        let each = rows.iter();
        let sum: f64 = each
            .map(|(d, log_root)| log_root + libm::log(size) - log_density(d / size, 2.0))
            .sum();
        let cost = 0.5 * off * off + sum;
        (n > 0.0 && sum.is_finite()).then_some(Self { cost, size })
    }
}

/// Sizes from the squared distances of held-out presses at `locations` locations.
///
/// With enough presses a size is the conformal quantile: of n + 1 presses, the new one included, the share `level` lies
/// inside, whatever the distribution. With fewer, errors are assumed normal, with the scatter that the model states or a larger one, known
/// from [`FREEDOM`] times `locations - 2` degrees of freedom, and the larger of both counts.
fn levels(distances: &[f64], locations: usize) -> Vec<RegionLevel> {
    if locations < FEWEST || distances.is_empty() {
        return Vec::new();
    }
    let mut sorted = distances.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let median = sorted[sorted.len() / 2];
    let bounded = sorted.iter().map(|d| d.min(BOUND_MEDIANS * median));
    let variance = (bounded.sum::<f64>() / (2.0 * n)).max(1.0);
    let freedom = FREEDOM * (locations - 2) as f64;
    let of = |level: f64| {
        let rank = ((n + 1.0) * level).ceil() as usize;
        let conformal = sorted.get(rank.max(1) - 1).copied();
        let factor = if n * (1.0 - level) >= TAIL_PRESSES {
            conformal?
        } else {
            // Quantile of F with 2 and `freedom` degrees of freedom, in closed form.
            let tail = libm::pow(1.0 - level, -2.0 / freedom);
            (variance * freedom * (tail - 1.0)).max(conformal.unwrap_or(0.0))
        };
        let usable = factor.is_finite() && factor > 0.0;
        usable.then_some(RegionLevel { level, factor })
    };
    LEVELS.into_iter().filter_map(of).collect()
}

/// How much larger the variances are than the model states: by the region of a level, in units of that of two normal
/// coordinates. 1 without regions.
pub(super) fn size(model: &LocatorModel, level: f64) -> f64 {
    let found = model.levels.iter().find(|l| l.level == level);
    found.map_or(1.0, |l| l.factor / (-2.0 * libm::log(1.0 - level)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factor(distances: &[f64], locations: usize, level: f64) -> Option<f64> {
        let all = levels(distances, locations);
        all.iter().find(|l| l.level == level).map(|l| l.factor)
    }

    #[test]
    fn a_region_is_the_conformal_quantile_or_wider() {
        let hundred: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(factor(&hundred, 100, 0.95), Some(96.0));
        assert_eq!(factor(&hundred, 100, 0.5), Some(51.0));
        // Twenty equal distances: one expected outside is too few, Student's tail counts.
        let few = factor(&[2.0; 20], 20, 0.95).unwrap();
        assert!(
            (few - 12.6 * (libm::pow(20f64, 1.0 / 6.3) - 1.0)).abs() < 1e-9,
            "{few}"
        );
        assert_eq!(levels(&[1.0; 4], 4), []);
        assert_eq!(levels(&[], 9), []);
    }
}
