//! Explains why two skins differ: which factor accounts for the change of the mean square error.
//!
//! The mean square error of a skin (`MSE`, mm²) over the shared locations has four parts:
//!
//! - *calibration*: how much a geometry fitted to the scored presses themselves would lower the error (corrected for the
//!   fitted parameters). A moved camera or too simple a camera model costs this much;
//! - *robot*: error correlated with the measured deviation from plan, by regression. It comes from ground truth that
//!   scatters about the true tip position (slope -1: none of the measured deviation is real motion);
//! - *scatter*: variance between repetitions at one location. The centroid of `n` events whose columns spread by `s` has
//!   variance `s² / n`, so scatter is modelled as `k w² q / n`: `w` the width of a press, `n` the events added by the press,
//!   `q` the widening of clusters by noise, and `k` the remainder;
//! - *bias*: the error that all repetitions at a location share.
//!
//! This model assumes independent events. Sparse clusters break up, lose their rims and absorb noise. Therefore the part of
//! scatter and bias that the model leaves unexplained is attributed to signal, noise and width as well, as far as they
//! changed in the same direction: up to the square of their own effect (for ln(bias), up to twice). Only the remainder
//! belongs to the skin. The scatter of calibration presses also propagates into the fit: up to twice its expected value
//! counts as scatter, not calibration.
//!
//! The change of scatter and bias is divided among its factors by logarithmic shares (logarithmic mean Divisia index, Ang
//! 2005, Energy Policy 33: exact, independent of order, no remainder); the share of `k` is the skin's. The change of `q` is
//! divided between noise and signal by how much each changed their ratio. Analysis settings are another factor if they
//! differ: both skins are analysed with both settings, and both orders are averaged (Shapley 1953 for two factors). All
//! parts add up to the change.

mod cross_evaluation;
mod decompose;
mod factor;
mod presses;

use serde::Serialize;

use crate::locations::Locations;
use crate::subject::Subject;
pub use cross_evaluation::CrossEvaluation;
use cross_evaluation::cross_evaluate;
use decompose::{FACTORS, contributions, draws};
pub use factor::{Contribution, Factor, FactorMeasurement, Reanalysis};
use presses::SkinPresses;
use skinrig_statistics::Interval;

/// Decomposition of the difference between a skin and the first one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Causes {
    /// Mean square error of both skins over the shared locations, mm².
    pub mse_mm2: [f64; 2],
    /// Change of the mean square error with a 95 % bootstrap interval over locations, mm².
    pub change_mm2: Interval,
    /// Contributions of the factors; they add up to the change.
    pub contributions: Vec<Contribution>,
    /// The dominant factor: the largest certain contribution above a third of a certain change. Certain: the interval
    /// excludes zero.
    pub carried_by: Option<Factor>,
    /// Supporting measurements.
    pub measured: Vec<FactorMeasurement>,
    /// Both skins evaluated with the calibration and the settings of the other.
    pub exchanged: Vec<CrossEvaluation>,
    /// Number of shared locations.
    #[serde(rename = "places")]
    pub locations: u32,
    /// Number of presses of each skin at the shared locations.
    pub presses: [u32; 2],
}

/// Smallest share of the change for a factor to be named as the cause.
const MIN_SHARE: f64 = 1.0 / 3.0;

/// Explains why `b` differs from `a`; `None` with fewer than four shared locations that have counting presses. `reanalysis`:
/// both skins analysed with the settings of the other, if these differ.
#[must_use]
pub fn causes(
    a: &Subject,
    b: &Subject,
    reanalysis: Option<Reanalysis<'_>>,
    resamples: u32,
    seed: u64,
) -> Option<Causes> {
    const MIN_LOCATIONS: usize = 4;
    let pair = [a.clone(), b.clone()];
    let locations = Locations::of(&pair);
    let shared = locations.shared([a, b]);
    let of = |subject: &Subject| SkinPresses::of(subject, &locations, &shared);
    let mut own = [of(a), of(b)];
    let both: Vec<u32> = own[0].locations().filter(|p| own[1].contains(*p)).collect();
    if both.len() < MIN_LOCATIONS {
        return None;
    }
    own.iter_mut().for_each(|p| p.retain_locations(&both));
    // One pair under the settings of B, one under those of A: within a pair only the skins differ.
    let variants: Vec<[SkinPresses; 2]> = match reanalysis {
        None => vec![own],
        Some(reanalysis) => {
            let [a, b] = own;
            let mut others = [of(reanalysis.first), of(reanalysis.second)];
            others.iter_mut().for_each(|p| p.retain_locations(&both));
            let [a_as_b, b_as_a] = others;
            vec![[a, b_as_a], [a_as_b, b]]
        }
    };
    let all: Vec<usize> = (0..both.len()).collect();
    let whole = contributions(&variants, &all);
    let drawn: Vec<_> = draws(both.len(), resamples, seed)
        .map(|locations| contributions(&variants, &locations))
        .collect();
    let around = |value: f64, of: &dyn Fn(&decompose::ChangeParts) -> f64| {
        let mut values: Vec<f64> = drawn.iter().map(of).filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let last = values.len().checked_sub(1)?;
            values.get((share * last as f64).round() as usize).copied()
        };
        Interval {
            value,
            low: at(0.025),
            high: at(0.975),
        }
    };
    let change = around(whole.change, &|p| p.change);
    let contributions: Vec<Contribution> = (0..FACTORS.len())
        .filter(|i| variants.len() > 1 || FACTORS[*i] != Factor::Settings)
        .map(|i| Contribution {
            factor: FACTORS[i],
            mm2: around(whole.by_factor[i], &|p| p.by_factor[i]),
        })
        .collect();
    let is_certain =
        |i: &Interval| i.low.is_some_and(|l| l > 0.0) || i.high.is_some_and(|h| h < 0.0);
    let most = contributions
        .iter()
        .filter(|c| c.mm2.value / change.value > MIN_SHARE && is_certain(&c.mm2))
        .max_by(|x, y| x.mm2.value.abs().total_cmp(&y.mm2.value.abs()));
    let first = &variants[0][0];
    let last = &variants[variants.len() - 1][1];
    Some(Causes {
        mse_mm2: whole.mse,
        carried_by: most.filter(|_| is_certain(&change)).map(|c| c.factor),
        change_mm2: change,
        contributions,
        measured: presses::measurements([first, last]),
        exchanged: cross_evaluate(a, b, reanalysis, &locations, &both),
        locations: both.len() as u32,
        presses: [first.count(), last.count()],
    })
}
