//! Detects rows of a press list that were exchanged here and there: most rows are right, and the others stand out.
//!
//! A press that failed is seen anywhere, an exchanged row at the position of another exchanged one. Positions are therefore dealt
//! among the rows that are not where they should be, and most of these must fit.

use super::readings::{Path, ScoredReading};
use super::rearranged::{MIN_ROWS, RearrangedRows, Rows, lists, reorder};

/// Turns: the cameras of the first order are no longer bent by the exchanged rows.
const TURNS: usize = 2;
/// Exchanges of all pairs at most.
const PASSES: usize = 40;
/// Minimum share of the rows that are off which the cameras see at the position of another one. Of rows that failed, 5 standard
/// deviations of 2.5 degrees in 90 per camera hold one in 50 of the others: a fifth of 10, by chance.
const MIN_SHARE: f64 = 0.5;

/// Looks for exchanged rows, likelier by more than `least`, nats; the list with the clearest ones.
pub(crate) fn exchanged_rows(
    path: &Path<'_>,
    as_is: &ScoredReading<'_>,
    least: f64,
) -> Option<RearrangedRows> {
    let lists = lists(path);
    let mut fits = as_is.fits;
    let mut best: Option<RearrangedRows> = None;
    for _ in 0..TURNS {
        let mut reading = as_is.reading.clone();
        best = None;
        for list in &lists {
            let rows = Rows::new(path, &fits, list, 0.0);
            let off = rows.off_their_place();
            if off.len() < MIN_ROWS {
                continue;
            }
            let read = dealt(&rows, list[0].len(), &off);
            reorder(&mut reading, path, list, &read);
            let elsewhere: Vec<usize> = off
                .iter()
                .copied()
                .filter(|i| rows.is_elsewhere(*i, read[*i]))
                .collect();
            // One of the rows that are off.
            let cost = libm::log(off.len() as f64);
            let gains = elsewhere
                .iter()
                .map(|i| rows.loss(*i, *i) - rows.loss(*i, read[*i]) - cost);
            let gain: f64 = gains.sum();
            let share = elsewhere.len() as f64 / off.len() as f64;
            let is_clear = elsewhere.len() >= MIN_ROWS && share >= MIN_SHARE && gain > least;
            let (Some(from), Some(to)) = (elsewhere.first(), elsewhere.last()) else {
                continue;
            };
            if is_clear && best.is_none_or(|other| gain > other.gain) {
                best = Some(RearrangedRows {
                    from: list[0].start + from,
                    to: list[0].start + to,
                    rows: elsewhere.len(),
                    gain,
                });
            }
        }
        if reading.at == as_is.reading.at {
            break;
        }
        fits = path.score(&reading).fits;
    }
    best
}

/// The positions of the rows `off` dealt among them, by exchanges of two as long as one is likelier.
fn dealt(rows: &Rows, n: usize, off: &[usize]) -> Vec<usize> {
    let mut read: Vec<usize> = (0..n).collect();
    for _ in 0..PASSES {
        let mut is_settled = true;
        for (at, i) in off.iter().enumerate() {
            for j in &off[at + 1..] {
                let now = rows.loss(*i, read[*i]) + rows.loss(*j, read[*j]);
                if rows.loss(*i, read[*j]) + rows.loss(*j, read[*i]) < now - 1e-9 {
                    read.swap(*i, *j);
                    is_settled = false;
                }
            }
        }
        if is_settled {
            break;
        }
    }
    read
}
