//! How many clustered events a press needs, found on the calibrating presses alone.
//!
//! A press that is left out costs what an answer that knows nothing costs: the RMS distance of the true positions from
//! their mean. One that is kept costs its cross-validated error. The threshold with the least mean square cost is
//! taken if it gains more than one standard error over the floor, locations being the independent units; a gain that
//! stands on a single location never does.

use super::crossval::mean_difference;
use crate::metrics::spread_mm;
use crate::result::ThresholdChoice;
use crate::sets::Sight;

/// At most this share of the calibrating presses is left out: what lies above is no threshold but a broken session.
const MOST_LEFT_OUT: f64 = 0.5;
/// Most candidates that are reported.
const REPORTED: usize = 60;

/// Chooses from the presses and their cross-validated errors (mm, in the same order). `None` without presses.
///
/// Candidates are `floor` and, of each press above it, the least threshold that leaves this press out. The floor also
/// stays when not even the best threshold does better than an answer that knows nothing.
pub fn choose(sights: &[Sight], errors_mm: &[f64], floor: u32) -> Option<ThresholdChoice> {
    let n = sights.len();
    if n == 0 {
        return None;
    }
    let penalty_mm = spread_mm(sights.iter().map(|s| s.truth));
    let penalty = penalty_mm * penalty_mm;
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|i| sights[*i].cluster_events);
    let events = |rank: usize| sights[order[rank]].cluster_events;
    let most = (MOST_LEFT_OUT * n as f64) as usize;
    // (threshold, presses left out, mean square cost).
    let mut cost: f64 = order.iter().map(|i| errors_mm[*i] * errors_mm[*i]).sum();
    let mut candidates: Vec<(u32, usize, f64)> = Vec::new();
    let first = (0..n).find(|r| events(*r) >= floor).unwrap_or(n);
    for rank in 0..=n {
        let ends_a_group =
            rank == first || (rank > first && (rank == n || events(rank) != events(rank - 1)));
        if ends_a_group && (rank == first || rank <= most) {
            let threshold = if rank == first {
                floor
            } else {
                events(rank - 1).saturating_add(1)
            };
            candidates.push((threshold, rank, cost / n as f64));
        }
        if rank < n {
            let error = errors_mm[order[rank]];
            cost += penalty - error * error;
        }
    }
    let (mut best, at_floor) = (*candidates.first()?, *candidates.first()?);
    for candidate in &candidates {
        if candidate.2 < best.2 {
            best = *candidate;
        }
    }
    let locations: Vec<u32> = sights.iter().map(|s| s.location).collect();
    let costs = |threshold: u32| -> Vec<f64> {
        let each = sights.iter().zip(errors_mm);
        each.map(|(s, e)| {
            if s.cluster_events < threshold {
                penalty
            } else {
                e * e
            }
        })
        .collect()
    };
    let (gain, error) = mean_difference(&locations, &costs(at_floor.0), &costs(best.0));
    if best.2 >= penalty || error.is_none_or(|e| gain <= e) {
        best = at_floor;
    }
    Some(ThresholdChoice {
        events: best.0,
        penalty_mm,
        n: n as u32,
        left_out: best.1 as u32,
        candidates: thinned(&candidates, best.0),
    })
}

/// At most 60 of the candidates, evenly, with the first, the last and the chosen one among them.
fn thinned(candidates: &[(u32, usize, f64)], chosen: u32) -> Vec<(u32, f64)> {
    let n = candidates.len();
    let spaced = REPORTED - 1;
    let shown = |i: usize| {
        let step = |k: usize| k * (n - 1) / (spaced - 1);
        n <= REPORTED || candidates[i].0 == chosen || (0..spaced).any(|k| step(k) == i)
    };
    let rows = candidates.iter().enumerate().filter(|(i, _)| shown(*i));
    rows.map(|(_, &(threshold, _, cost))| (threshold, cost.max(0.0).sqrt()))
        .collect()
}

#[cfg(test)]
mod tests {
    use skinrig_model::{Point2, PressId};

    use super::*;

    /// Presses on a circle of 30 mm, with these (cluster events, error in mm).
    fn presses(rows: &[(u32, f64)]) -> (Vec<Sight>, Vec<f64>) {
        let sights = rows.iter().enumerate().map(|(i, (events, _))| {
            let angle = std::f64::consts::TAU * i as f64 / rows.len() as f64;
            Sight {
                press: PressId::from_index(i as u32),
                location: i as u32,
                columns: [320.0; 2],
                truth: Point2::new(30.0 * angle.cos(), 30.0 * angle.sin()),
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
        choose(&sights, &errors, 20).unwrap()
    }

    #[test]
    fn presses_that_are_worse_than_nothing_are_left_out() {
        let found = session(&[(25, 80.0), (40, 60.0), (31, 90.0)]);
        assert_eq!((found.events, found.left_out, found.n), (41, 3, 23));
        assert!((found.penalty_mm - 30.0).abs() < 1e-9);
        assert_eq!(found.candidates[0].0, 20);
        // The cost of the choice: 20 presses of 3 mm, 3 of 30 mm.
        let wanted = ((20.0 * 9.0 + 3.0 * 900.0) / 23.0f64).sqrt();
        let cost = found.candidates.iter().find(|c| c.0 == 41).unwrap().1;
        assert!((cost - wanted).abs() < 1e-9);
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
        // Weak presses that are accurate stay, and so does a bad one among strong ones.
        assert_eq!(session(&[(25, 2.0), (26, 1.0), (590, 90.0)]).events, 20);
    }

    #[test]
    fn a_geometry_that_knows_nothing_leaves_the_floor() {
        let rows: Vec<_> = (0..20).map(|i| (100 + i, 90.0)).collect();
        let (sights, errors) = presses(&rows);
        let found = choose(&sights, &errors, 20).unwrap();
        assert_eq!((found.events, found.left_out), (20, 0));
        assert_eq!(choose(&[], &[], 20), None);
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
        let found = choose(&sights, &errors, 15).unwrap();
        assert_eq!((found.events, found.candidates[0].0), (15, 15));
    }

    #[test]
    fn many_candidates_are_thinned() {
        let rows: Vec<_> = (0..300u32)
            .map(|i| (100 + 2 * i, if i < 3 { 100.0 } else { 1.0 }))
            .collect();
        let (sights, errors) = presses(&rows);
        let found = choose(&sights, &errors, 0).unwrap();
        assert_eq!(found.events, 105);
        assert!(found.candidates.len() <= 60);
        assert!(found.candidates.iter().any(|c| c.0 == 105));
        assert!(found.candidates.is_sorted_by(|a, b| a.0 < b.0));
    }
}
