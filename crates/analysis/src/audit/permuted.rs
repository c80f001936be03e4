//! Detects a press list in any other order: each row reads the position of another one, and each position is read once.
//!
//! A shuffled list widens the residuals of the cameras fitted to it, so that no single row looks wrong. The order is therefore
//! found by turns: the likeliest order by the cameras, and the cameras of that order. It is judged as a whole, because an order
//! chosen among many always fits better.

use super::readings::{Path, ScoredReading};
use super::rearranged::{FAR, MIN_ROWS, RearrangedRows, Rows, lists, reorder};

/// Turns at most; the order usually stays after three.
const TURNS: usize = 8;
/// Exchanges of all pairs at most in each turn.
const PASSES: usize = 40;
/// Residual below which no other order is looked for, degrees: 1.3 mm at 50 mm from a camera, less than rows are apart.
const LEAST_SPREAD_DEG: f64 = 1.5;
/// Nats per moved row: one of two rows moves (0.7), and each position is read once, which leaves a row fewer by a factor of e to choose
/// from (the permanent of a band matrix: Van der Waerden's bound).
const MOVED: f64 = 0.7 - 1.0;
/// Minimum share of the rows that the cameras clearly see elsewhere.
const MIN_SHARE: f64 = 0.05;

/// Looks for a list in any other order that is likelier by more than `least`, nats; the one with the clearest rows.
pub(crate) fn permuted_rows(
    path: &Path<'_>,
    as_is: &ScoredReading<'_>,
    least: f64,
) -> Option<RearrangedRows> {
    let mut seen = as_is.fits.iter().flatten();
    if seen.all(|fit| fit.spread_deg < LEAST_SPREAD_DEG) {
        return None;
    }
    let lists = lists(path);
    let mut read: Vec<Vec<usize>> = lists
        .iter()
        .map(|list| (0..list[0].len()).collect())
        .collect();
    let mut reading = as_is.reading.clone();
    let mut fits = as_is.fits;
    for turn in 0..TURNS {
        // The residuals of the first turn are too wide for any row to pay for its move.
        let cost = if turn == 0 { 0.0 } else { 1.0 };
        let orders = lists.iter().zip(&read);
        let next: Vec<Vec<usize>> = orders
            .map(|(list, from)| likeliest(&Rows::new(path, &fits, list, 0.0), from, cost))
            .collect();
        if turn > 1 && next == read {
            break;
        }
        read = next;
        for (list, read) in lists.iter().zip(&read) {
            reorder(&mut reading, path, list, read);
        }
        fits = path.score(&reading).fits;
    }
    let cameras = as_is.fits.iter().zip(fits);
    let narrower = cameras.filter_map(|(before, after)| {
        let (before, after) = (before.as_ref()?, after?);
        Some(libm::log(before.spread_deg / after.spread_deg))
    });
    // Of both cameras.
    let per_row: f64 = narrower.sum();
    let found = lists.iter().zip(&read).filter_map(|(list, read)| {
        let n = read.len();
        let rows = Rows::new(path, &fits, list, 0.0);
        let moved = || (0..n).filter(|i| read[*i] != *i);
        let (from, to) = (moved().min()?, moved().max()?);
        let elsewhere = moved().filter(|i| rows.is_elsewhere(*i, read[*i])).count();
        let costs: f64 = moved().map(|i| move_cost(i, read[i])).sum();
        // Repetitions count once: they repeat the errors of the skin, which another order may fit.
        let gain = n as f64 * per_row - costs;
        let is_clear = elsewhere >= MIN_ROWS && elsewhere as f64 >= MIN_SHARE * n as f64;
        (gain > least && is_clear).then_some(RearrangedRows {
            from: list[0].start + from,
            to: list[0].start + to,
            rows: elsewhere,
            gain,
        })
    });
    found.max_by(|a, b| a.gain.total_cmp(&b.gain))
}

/// Cost of row `i` that reads row `j`, nats: one of all rows that are as near.
fn move_cost(i: usize, j: usize) -> f64 {
    match i.abs_diff(j) {
        0 => 0.0,
        rows => MOVED + libm::log((1 + 2 * rows) as f64),
    }
}

/// The order after exchanges of two rows each, as long as one is likelier; `cost` scales [`move_cost`].
fn likeliest(rows: &Rows, from: &[usize], cost: f64) -> Vec<usize> {
    let n = from.len();
    let width = 2 * FAR + 1;
    // By row, and the distance of the row that it reads.
    let mut losses = vec![f64::INFINITY; n * width];
    for i in 0..n {
        for j in i.saturating_sub(FAR)..n.min(i + FAR + 1) {
            losses[i * width + j + FAR - i] = rows.loss(i, j) + cost * move_cost(i, j);
        }
    }
    let loss = |i: usize, j: usize| match i.abs_diff(j) {
        0..=FAR => losses[i * width + j + FAR - i],
        _ => f64::INFINITY,
    };
    let mut read = from.to_vec();
    for _ in 0..PASSES {
        let mut is_settled = true;
        for i in 0..n {
            for j in i + 1..n.min(i + 2 * FAR + 1) {
                let now = loss(i, read[i]) + loss(j, read[j]);
                if loss(i, read[j]) + loss(j, read[i]) < now - 1e-9 {
                    read.swap(i, j);
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
