//! Owns the search for the scale of a table of positions: the factors along x and y that make the session likeliest.
//!
//! Columns alone do not tell a table of half the size from cameras at half the distance, so a calibration absorbs a wrong
//! scale and finds errors that are smaller by it. Only the distances of the cameras in the rig description contradict it. A
//! camera that is off by some cm contradicts them as a scale does: where cameras near the drawn ones follow the positions,
//! only a few factors about 0 are tried; where none does, any factor about any likely point.

use skinrig_model::Point2;

use super::frames::Frame;
use super::readings::{Path, Reading, ScoredReading};
use crate::result::Origin;

/// Cost of one factor, nats: one of about 20 that can be told apart (3.0), and rarer than a wrong unit.
const FREE_FACTOR: f64 = 4.0;
/// Ratio of neighbouring factors of the first search. On a recording of 289 places the cost fell steadily towards the right factor
/// from 1/18 of it and from 18 times it.
const RATIO: f64 = 1.5;
/// Steps to either side: factors from 1/58 to 58, beyond the ratio of inch and mm.
const STEPS: i32 = 10;
/// Factors about 0 where cameras near the drawn ones follow, and their costs, nats: a pitch that was typed wrong, a ruler read in another
/// scale. A wall that refracts looks like a scale of 0.8, too: of 14 simulated skins with nine places one was a quarter off by 9 nats.
const NEAR_FACTORS: [(f64, f64); 6] = [
    (0.5, FREE_FACTOR),
    (0.625, FREE_FACTOR),
    (0.8, 2.0 * FREE_FACTOR),
    (1.25, 2.0 * FREE_FACTOR),
    (1.6, FREE_FACTOR),
    (2.0, FREE_FACTOR),
];
/// Iterations of the refinement, each to 0.62 of the interval: two steps to 2 per cent.
const REFINEMENTS: usize = 8;
/// Presses for the search; what it finds is refined with all.
const SEARCH_PRESSES: usize = 60;
/// Fixed points closer than this are one, mm: ten times as large about either, positions differ by 4.5 mm, less than cameras may
/// be off.
const SAME_POINT_MM: f64 = 0.5;
/// Inverse of the golden ratio.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Readings with another scale of the positions than in `as_is`, where the streams may follow them.
pub(super) fn stretched(
    path: &Path<'_>,
    as_is: &ScoredReading<'_>,
    does_follow: bool,
) -> Vec<Reading> {
    if does_follow {
        let zero = (Origin::Zero, Point2::default());
        let factors = NEAR_FACTORS.into_iter();
        let all = factors.flat_map(|(f, cost)| [[f, f], [f, 1.0], [1.0, f]].map(|by| (by, cost)));
        return all
            .map(|(factors, cost)| stretched_by(path, factors, zero, cost))
            .collect();
    }
    searched(path, as_is)
}

/// Readings with the likeliest factors along both axes, along each, and along the two independently, about each point that a
/// table may be scaled about.
fn searched(path: &Path<'_>, as_is: &ScoredReading<'_>) -> Vec<Reading> {
    let sample = path.thinned(SEARCH_PRESSES);
    let worth_a_factor = sample.score(as_is.reading).cost - FREE_FACTOR;
    let mut all = Vec::new();
    for fixed in fixed_points(path) {
        let cost = |of: &Path<'_>, factors| of.score(&stretched_by(of, factors, fixed, 0.0)).cost;
        let mut best: Option<(f64, [f64; 2])> = None;
        for axes in [[1.0, 1.0], [1.0, 0.0], [0.0, 1.0]] {
            let factors = |ln: f64| axes.map(|on| libm::exp(on * ln));
            let (ln, found) = search(|ln| cost(&sample, factors(ln)));
            if found < worth_a_factor {
                let (ln, found) = refine(|ln| cost(path, factors(ln)), ln);
                all.push(stretched_by(path, factors(ln), fixed, FREE_FACTOR));
                if best.is_none_or(|(least, _)| found < least) {
                    best = Some((found, factors(ln)));
                }
            }
        }
        if let Some((_, factors)) = best {
            let factors = both_apart(|factors| cost(path, factors), factors);
            all.push(stretched_by(path, factors, fixed, 2.0 * FREE_FACTOR));
        }
    }
    all
}

/// Factors along x and y, each refined in turn from `factors`.
fn both_apart(cost: impl Fn([f64; 2]) -> f64, mut factors: [f64; 2]) -> [f64; 2] {
    for axis in [0, 1, 0, 1] {
        let along = |ln: f64| {
            let mut there = factors;
            there[axis] = libm::exp(ln);
            there
        };
        let (ln, _) = refine(|ln| cost(along(ln)), libm::log(factors[axis]));
        factors = along(ln);
    }
    factors
}

/// Logarithm of the cheapest factor, and its cost.
fn search(cost: impl Fn(f64) -> f64) -> (f64, f64) {
    let step = libm::log(RATIO);
    let grid = (-STEPS..=STEPS).map(|k| f64::from(k) * step);
    let costs = grid.map(|ln| (ln, cost(ln)));
    let best = costs.min_by(|a, b| a.1.total_cmp(&b.1));
    refine(cost, best.map_or(0.0, |(ln, _)| ln))
}

/// Golden-section search one step to either side of `around`: the argument and its cost.
fn refine(cost: impl Fn(f64) -> f64, around: f64) -> (f64, f64) {
    let step = libm::log(RATIO);
    let (mut low, mut high) = (around - step, around + step);
    let inner = |low: f64, high: f64| (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut a, mut b) = inner(low, high);
    let (mut at_a, mut at_b) = (cost(a), cost(b));
    for _ in 0..REFINEMENTS {
        if at_a <= at_b {
            high = b;
            (b, at_b) = (a, at_a);
            a = inner(low, high).0;
            at_a = cost(a);
        } else {
            low = a;
            (a, at_a) = (b, at_b);
            b = inner(low, high).1;
            at_b = cost(b);
        }
    }
    if at_a <= at_b { (a, at_a) } else { (b, at_b) }
}

/// The positions multiplied by `factors` about a point.
fn stretched_by(
    path: &Path<'_>,
    factors: [f64; 2],
    (origin, about): (Origin, Point2),
    penalty: f64,
) -> Reading {
    let mut reading = path.in_frame(&Frame::stretched(factors, origin, about));
    reading.penalty = penalty;
    reading
}

/// Points that a table may be scaled about: 0, the skin's centre, and the middle of its positions.
fn fixed_points(path: &Path<'_>) -> Vec<(Origin, Point2)> {
    let n = path.presses_seen.len().max(1) as f64;
    let mean =
        |of: fn(&Point2) -> f64| path.presses_seen.iter().map(|t| of(&t.at())).sum::<f64>() / n;
    let middle = Point2::new(mean(|p| p.x_mm), mean(|p| p.y_mm));
    let mut points: Vec<(Origin, Point2)> = Vec::new();
    for (origin, about) in [
        (Origin::Zero, Point2::default()),
        (Origin::Centre, path.rig.outline.centre),
        (Origin::Table, middle),
    ] {
        if points
            .iter()
            .all(|p| p.1.distance_mm(about) > SAME_POINT_MM)
        {
            points.push((origin, about));
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_search_finds_a_minimum_between_the_steps_and_at_the_ends() {
        for wanted in [-3.9, -0.3, 0.0, 0.17, 2.2, 4.0] {
            let (found, cost) = search(|ln| (ln - wanted) * (ln - wanted));
            assert!((found - wanted).abs() < 0.02, "{found} for {wanted}");
            assert!((cost - (found - wanted).powi(2)).abs() < 1e-15);
        }
        let [x, y] = both_apart(
            |[x, y]| libm::log(x / 1.3).powi(2) + libm::log(y / 0.8).powi(2),
            [1.0, 1.0],
        );
        assert!((x / 1.3 - 1.0).abs() < 0.02 && (y / 0.8 - 1.0).abs() < 0.02);
    }
}
