//! Why two skins differ: which factor carries the change of the mean square error.
//!
//! The mean square error of a skin (`MSE`, mm²) over the places that both have is taken apart:
//!
//! - *calibration*: by how much another geometry, fitted to the scored presses themselves (their errors corrected for the
//!   parameters that it cost), would lower it: what a camera that moved, or too small a model, costs;
//! - *robot*: the part of the rest that goes with where the robot says that it was: a truth that scatters about where the
//!   tip really is, found by regressing errors on the measured deviations from plan (slope -1: all of it is no motion);
//! - the *scatter* is what is left between repetitions at one place. A centroid of `n` events with columns that spread by
//!   `s` errs by `s² / n`, so it is written as `k w² q / n`: `w` the width of a touch, `n` the events that a press adds to
//!   the noise, `q` how much wider than a touch its clusters are, because noise joins them, and `k` what is left;
//! - the *bias* is what stays at a place.
//!
//! That is the theory of independent events. Clusters that thin out break up, lose their rims and are pulled by the noise that
//! joins them, so what the theory leaves over of scatter and bias goes with signal, noise and width too, as far as they went
//! the same way: up to the square of their own effect (the logarithm of a bias, up to twice). Only what lies beyond is the
//! skin's. And the scatter of calibrating presses costs their fit: up to twice its expectation is the scatter's, not the
//! calibration's.
//!
//! The change of scatter and bias is divided among their factors by logarithmic shares (logarithmic mean Divisia index, Ang
//! 2005, Energy Policy 33: exact, whatever the order, no remainder); what `k` carries is called the skin's. The change of
//! `q` is divided between noise and signal by how much each changed their ratio. Settings of the analysis are a further
//! factor when they differ: both skins are analysed with both, and the mean of both orders counts (Shapley 1953 for two
//! factors). All parts add up to the change.

mod decompose;
mod exchange;
mod factor;
mod presses;

use serde::Serialize;

use crate::places::Places;
use crate::statistics::Interval;
use crate::subject::Subject;
use decompose::{FACTORS, contributions, draws};
pub use exchange::Exchange;
use exchange::exchange;
pub use factor::{Again, Contribution, Factor, Measured};
use presses::Pressed;

/// Why a skin differs from the first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Causes {
    /// Mean square error of both over the places that they share, mm².
    pub mse_mm2: [f64; 2],
    /// Its change with its 95 % interval over places, mm².
    pub change_mm2: Interval,
    /// What carries it; adds up to the change.
    pub contributions: Vec<Contribution>,
    /// The factor that carries most of it, more than a third, when the change is one and its part too: both intervals without zero.
    pub carried_by: Option<Factor>,
    /// What was measured.
    pub measured: Vec<Measured>,
    /// Both skins with the calibration and the settings of the other.
    pub exchanged: Vec<Exchange>,
    /// Places and presses of both that it stands on.
    pub places: u32,
    /// See `places`.
    pub presses: [u32; 2],
}

/// A factor carries a change when it is more than this share of it.
const LEAST_SHARE: f64 = 1.0 / 3.0;

/// Why `b` differs from `a`; `None` when they share fewer than four places with presses that count. `again`: both analysed
/// with the settings of the other, when these differ.
#[must_use]
pub fn causes(
    a: &Subject,
    b: &Subject,
    again: Option<Again<'_>>,
    resamples: u32,
    seed: u64,
) -> Option<Causes> {
    const LEAST_PLACES: usize = 4;
    let pair = [a.clone(), b.clone()];
    let places = Places::of(&pair);
    let shared = places.shared([a, b]);
    let of = |subject: &Subject| Pressed::of(subject, &places, &shared);
    let mut own = [of(a), of(b)];
    let both: Vec<u32> = own[0].places().filter(|p| own[1].has(*p)).collect();
    if both.len() < LEAST_PLACES {
        return None;
    }
    own.iter_mut().for_each(|p| p.keep(&both));
    // With the settings of B and of A: the world in which only the skins differ.
    let worlds: Vec<[Pressed; 2]> = match again {
        None => vec![own],
        Some(again) => {
            let [a, b] = own;
            let mut others = [of(again.first), of(again.second)];
            others.iter_mut().for_each(|p| p.keep(&both));
            let [a_as_b, b_as_a] = others;
            vec![[a, b_as_a], [a_as_b, b]]
        }
    };
    let all: Vec<usize> = (0..both.len()).collect();
    let whole = contributions(&worlds, &all);
    let drawn: Vec<_> = draws(both.len(), resamples, seed)
        .map(|places| contributions(&worlds, &places))
        .collect();
    let around = |value: f64, of: &dyn Fn(&decompose::Parts) -> f64| {
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
        .filter(|i| worlds.len() > 1 || FACTORS[*i] != Factor::Settings)
        .map(|i| Contribution {
            factor: FACTORS[i],
            mm2: around(whole.of[i], &|p| p.of[i]),
        })
        .collect();
    let sure = |i: &Interval| i.low.is_some_and(|l| l > 0.0) || i.high.is_some_and(|h| h < 0.0);
    let most = contributions
        .iter()
        .filter(|c| c.mm2.value / change.value > LEAST_SHARE && sure(&c.mm2))
        .max_by(|x, y| x.mm2.value.abs().total_cmp(&y.mm2.value.abs()));
    let first = &worlds[0][0];
    let last = &worlds[worlds.len() - 1][1];
    Some(Causes {
        mse_mm2: whole.mse,
        carried_by: most.filter(|_| sure(&change)).map(|c| c.factor),
        change_mm2: change,
        contributions,
        measured: presses::measured([first, last]),
        exchanged: exchange(a, b, again, &places, &both),
        places: both.len() as u32,
        presses: [first.count(), last.count()],
    })
}
