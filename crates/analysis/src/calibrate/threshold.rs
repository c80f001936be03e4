//! Finds how many cluster events a press needs, on the calibration presses alone.
//!
//! A rejected press costs as much as a blind guess: the RMS distance of the true positions from their mean. A kept one costs
//! its cross-validated error, at most that of a position drawn at random from the true ones, which errs by sqrt(2) times as
//! much: so one bad press justifies rejecting one good one, and no more. The threshold with the smallest mean square cost is
//! used if its gain is significant: a permutation test deals the errors of whole locations anew and compares the largest
//! gain over all thresholds, which accounts for the number of candidates. A gain that depends on a single location never
//! suffices.

use super::crossval::mean_difference;
use crate::metrics::spread_mm;
use crate::result::ThresholdChoice;
use crate::sets::CalibrationPress;
use skinrig_statistics::seeded;

/// Largest share of calibration presses to reject; more indicates a broken session, not a threshold.
const MAX_LEFT_OUT: f64 = 0.5;
/// Maximum number of candidates reported.
const REPORTED: usize = 60;
/// A gain with a larger p value keeps the floor.
const LEVEL: f64 = 0.05;
/// Permutations of the test.
const DEALS: u32 = 999;
/// Random stream of the permutations.
const STREAM: u64 = 3 << 32;

/// Chooses from the presses and their cross-validated errors (mm, in the same order). `None` without presses.
///
/// Candidates are `floor` and, for each press above it, the smallest threshold that rejects this press. The floor also stays
/// if even the best threshold is no better than a blind guess.
pub(super) fn choose(
    sights: &[CalibrationPress],
    errors_mm: &[f64],
    floor: u32,
    seed: u64,
) -> Option<ThresholdChoice> {
    let n = sights.len();
    if n == 0 {
        return None;
    }
    let penalty_mm = spread_mm(sights.iter().map(|s| s.truth));
    let penalty = penalty_mm * penalty_mm;
    let retained_errors: Vec<f64> = errors_mm
        .iter()
        .map(|e| (e * e).min(2.0 * penalty))
        .collect();
    let ranked = RankedPresses::new(sights, floor);
    let candidates = ranked.costs(&retained_errors, penalty);
    let (mut best, at_floor) = (*candidates.first()?, *candidates.first()?);
    for candidate in &candidates {
        if candidate.cost < best.cost {
            best = *candidate;
        }
    }
    let gain = at_floor.cost - best.cost;
    let chance =
        (gain > 0.0).then(|| chance(&ranked, sights, &retained_errors, penalty, gain, seed));
    let locations: Vec<u32> = sights.iter().map(|s| s.location).collect();
    let costs = |threshold: u32| -> Vec<f64> {
        let each = sights.iter().zip(&retained_errors);
        each.map(|(s, e)| {
            if s.cluster_events < threshold {
                penalty
            } else {
                *e
            }
        })
        .collect()
    };
    // With the gain of one location the mean is at most its standard error.
    let (mean, error) = mean_difference(&locations, &costs(at_floor.events), &costs(best.events));
    let in_several = error.is_some_and(|e| mean > e);
    if best.cost >= penalty || !in_several || chance.is_none_or(|p| p >= LEVEL) {
        best = at_floor;
    }
    Some(ThresholdChoice {
        events: best.events,
        penalty_mm,
        n: n as u32,
        left_out: best.left_out as u32,
        chance,
        candidates: thinned(&candidates, best.events),
    })
}

/// A candidate threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Candidate {
    events: u32,
    /// Presses rejected.
    left_out: usize,
    /// Mean square cost, mm².
    cost: f64,
}

/// The presses sorted by cluster events.
struct RankedPresses {
    /// Weakest first.
    order: Vec<usize>,
    /// (threshold, presses rejected), ascending.
    thresholds: Vec<(u32, usize)>,
}

impl RankedPresses {
    fn new(sights: &[CalibrationPress], floor: u32) -> Self {
        let n = sights.len();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by_key(|i| sights[*i].cluster_events);
        let events = |rank: usize| sights[order[rank]].cluster_events;
        let most = (MAX_LEFT_OUT * n as f64) as usize;
        let first = (0..n).find(|r| events(*r) >= floor).unwrap_or(n);
        let mut thresholds = vec![(floor, first)];
        let ends_a_group = |rank: &usize| *rank == n || events(*rank) != events(*rank - 1);
        let above = (first + 1..=n.min(most)).filter(ends_a_group);
        thresholds.extend(above.map(|rank| (events(rank - 1).saturating_add(1), rank)));
        Self { order, thresholds }
    }

    /// All candidates, given the costs of kept presses, mm².
    fn costs(&self, retained_errors: &[f64], penalty: f64) -> Vec<Candidate> {
        let n = self.order.len();
        let mut cost: f64 = self.order.iter().map(|i| retained_errors[*i]).sum();
        let mut rank = 0;
        let of = |&(events, left_out): &(u32, usize)| {
            while rank < left_out {
                cost += penalty - retained_errors[self.order[rank]];
                rank += 1;
            }
            Candidate {
                events,
                left_out,
                cost: cost / n as f64,
            }
        };
        self.thresholds.iter().map(of).collect()
    }
}

/// Share of permutations, including the identity, in which some threshold gains at least `gain`, mm². Locations with equally
/// many presses exchange their costs.
fn chance(
    ranked: &RankedPresses,
    sights: &[CalibrationPress],
    retained_errors: &[f64],
    penalty: f64,
    gain: f64,
    seed: u64,
) -> f64 {
    let mut by_place: Vec<usize> = (0..sights.len()).collect();
    by_place.sort_by_key(|i| sights[*i].location);
    let mut places: Vec<&[usize]> = by_place
        .chunk_by(|a, b| sights[*a].location == sights[*b].location)
        .collect();
    places.sort_by_key(|p| p.len());
    let mut rng = seeded::generator(seed, STREAM);
    let reached = (0..DEALS).filter(|_| {
        let mut dealt = retained_errors.to_vec();
        for alike in places.chunk_by(|a, b| a.len() == b.len()) {
            let mut from: Vec<usize> = (0..alike.len()).collect();
            for i in (1..from.len()).rev() {
                from.swap(i, seeded::index(&mut rng, i + 1));
            }
            for (to, from) in alike.iter().zip(from) {
                for (i, other) in to.iter().zip(alike[from]) {
                    dealt[*i] = retained_errors[*other];
                }
            }
        }
        let costs = ranked.costs(&dealt, penalty);
        let least = costs.iter().map(|c| c.cost).fold(f64::INFINITY, f64::min);
        // Rounding of sums in another order must not decide between equal values.
        costs[0].cost - least >= gain * (1.0 - 1e-9)
    });
    (reached.count() + 1) as f64 / f64::from(DEALS + 1)
}

/// At most 60 of the candidates, evenly spaced, including the first, the last and the chosen one.
fn thinned(candidates: &[Candidate], chosen: u32) -> Vec<(u32, f64)> {
    let n = candidates.len();
    let spaced = REPORTED - 1;
    let shown = |i: usize| {
        let step = |k: usize| k * (n - 1) / (spaced - 1);
        n <= REPORTED || candidates[i].events == chosen || (0..spaced).any(|k| step(k) == i)
    };
    let rows = candidates.iter().enumerate().filter(|(i, _)| shown(*i));
    rows.map(|(_, c)| (c.events, c.cost.max(0.0).sqrt()))
        .collect()
}

#[cfg(test)]
mod tests {
    use skinrig_model::{Point2, PressId};

    use super::*;

    /// Presses on a circle of 30 mm, with these (cluster events, error in mm).
    fn presses(rows: &[(u32, f64)]) -> (Vec<CalibrationPress>, Vec<f64>) {
        let sights = rows.iter().enumerate().map(|(i, (events, _))| {
            let angle = std::f64::consts::TAU * i as f64 / rows.len() as f64;
            CalibrationPress {
                press: PressId::from_index(i as u32),
                location: i as u32,
                repetition: 0,
                columns: [320.0; 2],
                spreads: [None; 2],
                truth: Point2::new(30.0 * libm::cos(angle), 30.0 * libm::sin(angle)),
                cluster_events: *events,
            }
        });
        (sights.collect(), rows.iter().map(|r| r.1).collect())
    }

    /// Twenty good presses with 500 to 595 events, then `bad` ones.
    fn session(bad: &[(u32, f64)]) -> ThresholdChoice {
        let good = (0..20u32).map(|i| (500 + 5 * i, 3.0));
        let rows: Vec<_> = good.chain(bad.iter().copied()).collect();
        let (sights, errors) = presses(&rows);
        choose(&sights, &errors, 20, 1).unwrap()
    }

    #[test]
    fn presses_worse_than_the_penalty_are_left_out() {
        let found = session(&[(25, 80.0), (40, 60.0), (31, 90.0)]);
        assert_eq!((found.events, found.left_out, found.n), (41, 3, 23));
        assert!((found.penalty_mm - 30.0).abs() < 1e-9);
        assert_eq!(found.candidates[0].0, 20);
        // Cost of the choice: 20 presses of 3 mm, 3 of 30 mm.
        let expected = ((20.0 * 9.0 + 3.0 * 900.0) / 23.0f64).sqrt();
        let cost = found.candidates.iter().find(|c| c.0 == 41).unwrap().1;
        assert!((cost - expected).abs() < 1e-9);
    }

    #[test]
    fn one_place_alone_never_moves_the_threshold() {
        assert_eq!(session(&[(25, 140.0)]).events, 20);
        assert_eq!(session(&[(25, 140.0), (26, 140.0)]).events, 27);
    }

    #[test]
    fn noise_leaves_the_floor() {
        assert_eq!(session(&[]).events, 20);
        assert_eq!(session(&[(25, 29.0), (30, 31.0), (40, 30.5)]).events, 20);
        // Weak but accurate presses stay, and so does a bad one among strong ones.
        assert_eq!(session(&[(25, 2.0), (26, 1.0), (590, 90.0)]).events, 20);
    }

    #[test]
    fn an_uninformative_geometry_gives_the_floor() {
        let rows: Vec<_> = (0..20).map(|i| (100 + i, 90.0)).collect();
        let (sights, errors) = presses(&rows);
        let found = choose(&sights, &errors, 20, 1).unwrap();
        assert_eq!((found.events, found.left_out), (20, 0));
        assert_eq!(choose(&[], &[], 20, 1), None);
    }

    #[test]
    fn never_below_the_floor_and_never_more_than_half() {
        let bad: Vec<_> = (0..15).map(|i| (30 + i, 140.0)).collect();
        let found = session(&bad);
        assert_eq!((found.events, found.left_out), (45, 15));
        let bad: Vec<_> = (0..30).map(|i| (30 + i, 60.0)).collect();
        let found = session(&bad);
        assert!(2 * found.left_out <= found.n, "{found:?}");
        let (sights, errors) = presses(&[(10, 90.0), (11, 90.0), (50, 1.0), (60, 1.0), (70, 1.0)]);
        let found = choose(&sights, &errors, 15, 1).unwrap();
        assert_eq!((found.events, found.candidates[0].0), (15, 15));
    }

    /// A tenth of outliers among presses whose events do not predict them.
    #[test]
    fn outliers_at_random_seldom_move_the_threshold() {
        let moved = (0..200u64).filter(|seed| {
            let mut rng = seeded::generator(*seed, 9);
            let rows: Vec<_> = (0..60u32)
                .map(|_| {
                    let events = 100 + seeded::index(&mut rng, 900) as u32;
                    let bad = seeded::index(&mut rng, 10) == 0;
                    (events, if bad { 100.0 } else { 3.0 })
                })
                .collect();
            let (sights, errors) = presses(&rows);
            choose(&sights, &errors, 20, *seed).unwrap().events > 20
        });
        let moved = moved.count();
        // At most 5 % by the test's level; 17 of 200 is two standard deviations above.
        assert!(moved <= 17, "{moved} of 200");
    }

    #[test]
    fn a_bad_press_at_the_strong_end_takes_no_good_ones_with_it() {
        // The two weakest are bad, and one in the middle: rejecting that one too would cost ten good ones.
        let found = session(&[(25, 140.0), (26, 140.0), (549, 140.0)]);
        assert_eq!((found.events, found.left_out), (27, 2));
        assert!(found.chance.unwrap() < 0.05);
    }

    #[test]
    fn many_candidates_are_thinned() {
        let rows: Vec<_> = (0..300u32)
            .map(|i| (100 + 2 * i, if i < 3 { 100.0 } else { 1.0 }))
            .collect();
        let (sights, errors) = presses(&rows);
        let found = choose(&sights, &errors, 0, 1).unwrap();
        assert_eq!(found.events, 105);
        assert!(found.candidates.len() <= 60);
        assert!(found.candidates.iter().any(|c| c.0 == 105));
        assert!(found.candidates.is_sorted_by(|a, b| a.0 < b.0));
    }
}
