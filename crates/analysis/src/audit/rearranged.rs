//! Detects a press list with some rows in another order: lines exchanged, or blocks reversed or moved.
//!
//! Each row either reads its own position or, in a block of rows, that of a row at a fixed distance (a moved block) or mirrored
//! about a row (a reversed block). The likeliest sequence of blocks is a shortest path over the rows.

use std::ops::Range;

use super::readings::{Path, Reading, ScoredReading};
use super::resection::{Resection, wrapped_deg};
use super::statistics::median;

/// Evidence of a press against its own position that counts for nothing, nats (2.4 standard deviations): a skin's own errors are
/// alike in neighbours, so that a neighbouring row fits a whole line better.
const FREE: f64 = 3.0;
/// Maximum evidence of one press in one camera, nats.
const MAX_PRESS: f64 = 8.0;
/// Repetitions of one list repeat the skin's errors: together they count as this many at most.
const MAX_REPETITIONS: f64 = 2.0;
/// Cost of the begin or end of a block, nats: a thousand blocks begin at each row.
const CHANGE: f64 = 12.0;
/// Minimum gain, nats.
pub(super) const MIN_GAIN: f64 = 25.0;
/// Minimum number of rows that the cameras see elsewhere,
pub(super) const MIN_ROWS: usize = 6;
/// this many standard deviations from their own position,
const ELSEWHERE_SIGMAS: f64 = 4.0;
/// and at most this many from the other one.
const THERE_SIGMAS: f64 = 2.5;
/// Largest distance of a row from the one that it reads.
pub(super) const FAR: usize = 300;
/// Number of such distances.
const NEAR: usize = 2 * FAR + 1;

/// Rows of the list that belong elsewhere in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RearrangedRows {
    /// Index of the first such press in the path, from 0.
    pub from: usize,
    /// Index of the last one.
    pub to: usize,
    /// Rows that the cameras clearly see at the position of another row.
    pub rows: usize,
    /// Log likelihood gain, nats.
    pub gain: f64,
}

/// Looks for rows in another order; the list with the clearest ones.
///
/// Wrong rows widen the residuals of the cameras fitted to them. The likeliest order by those is a proposal, without a margin;
/// whether rows are elsewhere is judged with cameras fitted to the proposal.
pub(crate) fn rearranged_rows(
    path: &Path<'_>,
    as_is: &ScoredReading<'_>,
) -> Option<RearrangedRows> {
    let lists = lists(path);
    let mut proposed = as_is.reading.clone();
    for list in &lists {
        let (read, _) = Rows::new(path, &as_is.fits, list, 0.0).likeliest();
        reorder(&mut proposed, path, list, &read);
    }
    if proposed.at == as_is.reading.at {
        return None;
    }
    let proposed = path.score(&proposed);
    let found = lists.iter().filter_map(|list| {
        let found = Rows::new(path, &proposed.fits, list, FREE).rearranged()?;
        Some(RearrangedRows {
            from: list[0].start + found.from,
            to: list[0].start + found.to,
            ..found
        })
    });
    found.max_by(|a, b| a.gain.total_cmp(&b.gain))
}

/// Gives each row of a list the position of the row that it reads.
pub(super) fn reorder(
    reading: &mut Reading,
    path: &Path<'_>,
    list: &[Range<usize>],
    read: &[usize],
) {
    for presses in list {
        let at = read
            .iter()
            .map(|row| Some(path.presses_seen[presses.start + row].at()));
        reading.at.splice(presses.clone(), at);
    }
}

/// The presses of each list: of all repetitions that share it.
pub(super) fn lists(path: &Path<'_>) -> Vec<Vec<Range<usize>>> {
    let planned = |r: &Range<usize>| {
        let presses = path.presses_seen[r.clone()].iter();
        presses.map(|t| t.planned).collect::<Vec<_>>()
    };
    let mut all: Vec<Vec<Range<usize>>> = Vec::new();
    for repetition in path.repetitions() {
        match all
            .iter_mut()
            .find(|list| planned(&list[0]) == planned(&repetition))
        {
            Some(list) => list.push(repetition),
            None => all.push(vec![repetition]),
        }
    }
    all
}

/// The viewing angle of a position, and of the column at which it was seen, degrees.
#[derive(Debug, Clone, Copy)]
struct Angles {
    at: f64,
    seen: Option<f64>,
}

/// One camera in one repetition of the list.
struct View {
    angles: Vec<Angles>,
    spread_deg: f64,
}

impl View {
    /// Standard deviations from the position of row `j` at which the camera sees row `i`.
    fn sigmas(&self, i: usize, j: usize) -> Option<f64> {
        let off = self.angles[i].seen? - self.angles[j].at;
        Some(wrapped_deg(off).abs() / self.spread_deg)
    }
}

/// The rows of one list, as both cameras see them in all repetitions that share it.
pub(super) struct Rows {
    n: usize,
    repetitions: usize,
    cameras: [Vec<View>; 2],
    /// Evidence of a press against its own position that counts for nothing, nats.
    free: f64,
}

impl Rows {
    pub(super) fn new(
        path: &Path<'_>,
        fits: &[Option<Resection>; 2],
        repetitions: &[Range<usize>],
        free: f64,
    ) -> Self {
        let view = |k: usize, range: &Range<usize>| {
            let fit = fits[k]?;
            let presses = path.presses_seen[range.clone()].iter();
            let angles = presses.map(|press| Angles {
                at: fit.camera.angle_of_point_deg(press.at()),
                seen: press.sights[k]
                    .column
                    .map(|u| fit.camera.angle_of_column_deg(u)),
            });
            Some(View {
                angles: angles.collect(),
                spread_deg: fit.spread_deg,
            })
        };
        Self {
            n: repetitions.first().map_or(0, ExactSizeIterator::len),
            repetitions: repetitions.len(),
            cameras: [0, 1].map(|k| repetitions.iter().filter_map(|r| view(k, r)).collect()),
            free,
        }
    }

    /// Cost of row `i` at the position of row `j`, nats.
    pub(super) fn loss(&self, i: usize, j: usize) -> f64 {
        let free = if i == j { self.free } else { 0.0 };
        let one = |sigmas: f64| ((0.5 * sigmas * sigmas).min(MAX_PRESS) - free).max(0.0);
        let views = self.cameras.iter().flatten();
        let all: f64 = views.filter_map(|view| view.sigmas(i, j)).map(one).sum();
        let n = self.repetitions as f64;
        all * n.min(MAX_REPETITIONS) / n
    }

    /// Standard deviations of the worse camera between row `i` and the position of row `j`, usually.
    fn off(&self, i: usize, j: usize) -> f64 {
        let usual = self
            .cameras
            .iter()
            .filter_map(|views| median(views.iter().filter_map(|v| v.sigmas(i, j)).collect()));
        usual.fold(0.0, f64::max)
    }

    /// True if the cameras do not see row `i` at its own position.
    fn is_off(&self, i: usize) -> bool {
        self.off(i, i) > ELSEWHERE_SIGMAS
    }

    /// The rows that the cameras do not see at their own positions.
    pub(super) fn off_their_place(&self) -> Vec<usize> {
        (0..self.n).filter(|i| self.is_off(*i)).collect()
    }

    /// True if the cameras see row `i` at row `j` and not at its own position.
    pub(super) fn is_elsewhere(&self, i: usize, j: usize) -> bool {
        self.is_off(i) && self.off(i, j) < THERE_SIGMAS
    }

    /// The likeliest blocks, if some rows clearly belong elsewhere.
    fn rearranged(&self) -> Option<RearrangedRows> {
        let own: f64 = (0..self.n).map(|i| self.loss(i, i)).sum();
        let (read, cost) = self.likeliest();
        let gain = own - cost;
        let moved = || (0..self.n).filter(|i| read[*i] != *i);
        let rows = moved().filter(|i| self.is_elsewhere(*i, read[*i])).count();
        let (from, to) = (moved().min()?, moved().max()?);
        (gain > MIN_GAIN && rows >= MIN_ROWS).then_some(RearrangedRows {
            from,
            to,
            rows,
            gain,
        })
    }

    /// The row that each row reads on the cheapest path, and its cost.
    fn likeliest(&self) -> (Vec<usize>, f64) {
        let mut costs = vec![CHANGE; 2 * NEAR];
        costs[Block::OWN.0] = 0.0;
        // For each row: the blocks that go on, and the one from which all others begin.
        let mut steps: Vec<(Vec<bool>, Block)> = Vec::with_capacity(self.n);
        for i in 0..self.n {
            let (before, least) = cheapest(&costs);
            let begin = least + CHANGE;
            let from = |block: Block| match block.at_previous_row() {
                _ if i == 0 => costs[block.0],
                Some(previous) => costs[previous.0],
                None => f64::INFINITY,
            };
            let row = |block: Block| block.row(i).filter(|row| *row < self.n);
            let losses = (0..NEAR).map(|k| Some(self.loss(i, row(Block(k))?)));
            let losses: Vec<Option<f64>> = losses.collect();
            let mut here = vec![f64::INFINITY; 2 * NEAR];
            let mut goes_on = vec![false; 2 * NEAR];
            for block in Block::all() {
                let Some(loss) = losses[block.0 % NEAR] else {
                    continue;
                };
                let so_far = from(block);
                goes_on[block.0] = so_far <= begin;
                here[block.0] = so_far.min(begin) + loss;
            }
            costs = here;
            steps.push((goes_on, before));
        }
        let (mut block, cost) = cheapest(&costs);
        let mut read = vec![0; self.n];
        for i in (0..self.n).rev() {
            read[i] = block.row(i).unwrap_or(i);
            let (goes_on, before) = &steps[i];
            block = match block.at_previous_row() {
                Some(previous) if goes_on[block.0] => previous,
                _ => *before,
            };
        }
        (read, cost)
    }
}

/// A block at some row: moved blocks by their distance, then reversed ones by that of the row that this row reads.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Block(usize);

impl Block {
    /// Each row reads its own position.
    const OWN: Self = Self(FAR);

    fn all() -> impl Iterator<Item = Self> {
        (0..2 * NEAR).map(Self)
    }

    /// The row that row `i` reads; `None` before the first one.
    fn row(self, i: usize) -> Option<usize> {
        (i + self.0 % NEAR).checked_sub(FAR)
    }

    /// The same block at the row before: a reversed one reads a row two further off there.
    fn at_previous_row(self) -> Option<Self> {
        match self.0 {
            moved @ 0..NEAR => Some(Self(moved)),
            reversed => Some(Self(reversed + 2)).filter(|block| block.0 < 2 * NEAR),
        }
    }
}

/// The cheapest block and its cost.
fn cheapest(costs: &[f64]) -> (Block, f64) {
    let all = costs.iter().copied().enumerate();
    let least = all.min_by(|a, b| a.1.total_cmp(&b.1));
    least.map_or((Block::OWN, f64::INFINITY), |(i, cost)| (Block(i), cost))
}
