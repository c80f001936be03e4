//! Fewer calibrating presses: 27 locations chosen beforehand, against all 81 of a grid, on planted skins.

use std::ops::Range;

use rayon::prelude::*;
use skinrig_analysis::sets::CalibrationSet;
use skinrig_model::{Locator, Point2, PressRole};
use skinrig_protocol::best_locations;

use super::skins::{DRAWN, Noise, Skin, Spreads, errors, learn_set};

/// A way to choose 27 of the 81 locations; `seed` is the skin's.
type Design = fn(locations: &[Point2], seed: u64) -> Vec<usize>;

const FEW: usize = 27;

fn skin(seed: u64) -> Skin {
    let mut noise = Noise::new(seed ^ 0xde_5196);
    Skin {
        side: 9,
        bend_px: [0.0, 7.0, 14.0][(noise.unit() * 3.0) as usize],
        noise_px: [1.0, 3.0][(noise.unit() * 2.0) as usize],
        spreads: [Spreads::Absent, Spreads::Near(0.1)][(noise.unit() * 2.0) as usize],
        ..Skin::new(seed)
    }
}

/// An error as large as the skin stands for a press without position.
const LOST_MM: f64 = 100.0;

/// Scored presses of one skin, or of several together.
#[derive(Debug, Clone, Copy)]
struct Judged {
    squares: f64,
    located: usize,
    lost: usize,
}

impl Judged {
    fn rmse_mm(&self) -> f64 {
        (self.squares / self.located as f64).sqrt()
    }
}

/// Other presses, at the locations of a finer grid, after calibration at the chosen locations.
fn judge(skin: &Skin, design: impl Fn(&[Point2], u64) -> Vec<usize>) -> Judged {
    let mut presses = skin.presses();
    let locations: Vec<Point2> = presses.iter().map(|p| p.planned).collect();
    let chosen = design(&locations, skin.seed);
    for (i, press) in presses.iter_mut().enumerate() {
        press.role = if chosen.contains(&i) {
            PressRole::Calibrate
        } else {
            PressRole::Score
        };
    }
    let learnt = learn_set(&CalibrationSet::from_presses(&presses), Locator::Auto);
    let others = Skin {
        side: 13,
        session: 1,
        ..skin.clone()
    };
    let lengths = errors(&others, &learnt);
    let located: Vec<f64> = lengths.into_iter().filter(|e| *e < LOST_MM).collect();
    Judged {
        squares: located.iter().map(|e| e * e).sum(),
        located: located.len(),
        lost: others
            .presses()
            .iter()
            .filter(|p| p.role == PressRole::Score)
            .count()
            - located.len(),
    }
}

const ALL: Design = |locations, _| (0..locations.len()).collect();
const EVERY_THIRD: Design = |locations, _| (0..locations.len()).step_by(3).collect();
const BY_CHANCE: Design = |locations, seed| {
    let mut noise = Noise::new(seed ^ 0xcafe);
    let mut keyed: Vec<(f64, usize)> = (0..locations.len()).map(|i| (noise.unit(), i)).collect();
    keyed.sort_by(|a, b| a.0.total_cmp(&b.0));
    keyed.into_iter().take(FEW).map(|(_, i)| i).collect()
};

const BEST: Design = |locations, _| best_locations(locations, &DRAWN, FEW, 14.0);

/// Each skin of `seeds`.
fn over(seeds: Range<u64>, design: impl Fn(&[Point2], u64) -> Vec<usize> + Sync) -> Vec<Judged> {
    let each = seeds.into_par_iter();
    each.map(|seed| judge(&skin(seed), &design)).collect()
}

fn together(each: &[Judged]) -> Judged {
    Judged {
        squares: each.iter().map(|j| j.squares).sum(),
        located: each.iter().map(|j| j.located).sum(),
        lost: each.iter().map(|j| j.lost).sum(),
    }
}

/// Median over skins of the ratio to the RMSE after all 81.
fn median_ratio(few: &[Judged], all: &[Judged]) -> f64 {
    let pairs = few.iter().zip(all);
    let mut each: Vec<f64> = pairs.map(|(f, a)| f.rmse_mm() / a.rmse_mm()).collect();
    each.sort_by(f64::total_cmp);
    each[each.len() / 2]
}

/// RMSE of all presses relative to that after all 81, the median over skins, and presses without position.
#[expect(clippy::print_stdout, reason = "the measurement prints its table")]
fn compare(name: &str, few: &[Judged], all: &[Judged]) -> (f64, f64, usize) {
    let (sum, median) = (together(few), median_ratio(few, all));
    let rmse_mm = sum.rmse_mm();
    let ratio = rmse_mm / together(all).rmse_mm();
    println!(
        "{name}: {rmse_mm:.3} mm, {} of {} without position; ratio {ratio:.3}, median of skins {median:.3}",
        sum.lost,
        sum.lost + sum.located
    );
    (ratio, median, sum.lost)
}

#[test]
fn chosen_locations_cost_little() {
    let all = over(0..8, ALL);
    let (ratio, median, lost) = compare("chosen", &over(0..8, BEST), &all);
    assert!(
        ratio < 1.4 && median < 1.3 && lost < 5,
        "{ratio} {median} {lost}"
    );
}

#[test]
#[ignore = "half a minute: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig-analysis-tests -- --ignored --nocapture chosen_locations"]
fn chosen_locations_against_eighty_one_on_fifty_skins() {
    // Other skins settled the default length.
    let seeds = || 200..250;
    let all = over(seeds(), ALL);
    compare("all 81", &all, &all);
    let chosen = compare("chosen", &over(seeds(), BEST), &all);
    let third = compare("every third", &over(seeds(), EVERY_THIRD), &all);
    let chance = compare("by chance", &over(seeds(), BY_CHANCE), &all);
    assert!(chosen.0 < third.0 && chosen.0 < chance.0);
}
