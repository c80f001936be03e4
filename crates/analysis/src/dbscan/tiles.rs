//! Owns tiles of 8 by 8 pixels, each a 64-bit word, and discs as masks of tiles: a disc covers a few tiles only.

use crate::grid::PixelGrid;

pub(super) const WIDTH: usize = PixelGrid::WIDTH;
/// Pixels along a side of a tile.
pub(super) const SIDE: usize = 8;
/// Tiles in a row of tiles.
const ACROSS: usize = WIDTH / SIDE;
const _: () = assert!(WIDTH.is_multiple_of(SIDE) && SIDE * SIDE == u64::BITS as usize);

/// Step from a tile to another one that discs around its pixels may reach.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// Added to the tile index, wrapping.
    pub by: usize,
    /// Added to the pixel index, wrapping.
    pub pixels: usize,
    /// Pixels of the tile whose discs reach the other tile.
    pub able: u64,
    /// Tiles down and to the right.
    rows: isize,
    columns: isize,
}

impl Step {
    /// True for one step of each pair that leads there and back.
    fn is_forward(&self) -> bool {
        (self.rows, self.columns) > (0, 0)
    }

    /// Squared distance between a pixel of the tile and one of the other tile.
    pub(crate) fn squared(&self, from: usize, to: usize) -> usize {
        let apart = |tiles: isize, from: usize, to: usize| {
            (tiles * SIDE as isize + to as isize).abs_diff(from as isize)
        };
        let dy = apart(self.rows, from / SIDE, to / SIDE);
        let dx = apart(self.columns, from % SIDE, to % SIDE);
        dx * dx + dy * dy
    }
}

/// Part of a disc in one of the tiles that it reaches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    /// Index of the step to the tile.
    pub step: usize,
    /// [`Step::by`].
    pub by: usize,
    /// Covered pixels, at least one.
    pub mask: u64,
}

/// Tiles of a grid in a frame of empty tiles as wide as the discs reach, and the steps between them.
#[derive(Debug, Clone)]
pub(super) struct Tiles {
    /// Width of the frame.
    margin: usize,
    /// Tiles from one row of tiles to the next.
    stride: usize,
    /// Near tiles first, starting with the tile itself. Empty if a disc does not even cover its own pixel.
    steps: Vec<Step>,
    /// One step of each pair that leads to another tile and back, with its index.
    forward: Vec<(usize, Step)>,
    /// For each pixel of a tile, the mask of its disc on the tile at each step.
    masks: Vec<u64>,
    /// For each pixel of a tile, the parts of its disc, near tiles first.
    parts: Vec<Part>,
    /// Start of the parts of each pixel, and the end of the last.
    starts: [usize; SIDE * SIDE + 1],
}

impl Tiles {
    /// For discs of radius `eps_px`, border included, limited to the width of the sensor.
    pub(super) fn new(eps_px: f64) -> Self {
        let eps_sq = eps_px * eps_px;
        let fits = |dx: usize, dy: usize| (dx * dx + dy * dy) as f64 <= eps_sq;
        // Half width at each row distance.
        let half: Vec<usize> = (0..WIDTH)
            .take_while(|&dy| fits(0, dy))
            .map(|dy| (0..WIDTH).take_while(|&dx| fits(dx, dy)).count() - 1)
            .collect();
        let margin = half.first().map_or(0, |reach| reach.div_ceil(SIDE));
        let stride = ACROSS + 2 * margin;
        let most = margin as isize;
        let all = (-most..=most).flat_map(|rows| (-most..=most).map(move |c| (rows, c)));
        let mut steps: Vec<(Step, [u64; SIDE * SIDE])> = all
            .map(|(rows, columns)| {
                let masks = masks(&half, rows, columns);
                let down = rows * (SIDE * WIDTH) as isize;
                let meets = |at: &usize| masks[*at] != 0;
                let step = Step {
                    by: (rows * stride as isize + columns) as usize,
                    pixels: (down + columns * SIDE as isize) as usize,
                    able: (0..SIDE * SIDE)
                        .filter(meets)
                        .fold(0, |all, at| all | 1 << at),
                    rows,
                    columns,
                };
                (step, masks)
            })
            .filter(|(step, _)| step.able != 0)
            .collect();
        steps.sort_by_key(|(s, _)| s.rows * s.rows + s.columns * s.columns);
        let mut parts = Vec::new();
        let mut starts = [0; SIDE * SIDE + 1];
        for at in 0..SIDE * SIDE {
            let all = steps
                .iter()
                .zip(0..)
                .map(|((Step { by, .. }, masks), step)| Part {
                    step,
                    by: *by,
                    mask: masks[at],
                });
            parts.extend(all.filter(|part| part.mask != 0));
            starts[at + 1] = parts.len();
        }
        let numbered = steps.iter().map(|(step, _)| *step).enumerate();
        Self {
            margin,
            stride,
            forward: numbered.filter(|(_, step)| step.is_forward()).collect(),
            masks: (0..SIDE * SIDE)
                .flat_map(|at| steps.iter().map(move |(_, masks)| masks[at]))
                .collect(),
            parts,
            starts,
            steps: steps.into_iter().map(|(step, _)| step).collect(),
        }
    }

    /// Steps to all tiles that a disc around some pixel of a tile reaches.
    pub(super) fn steps(&self) -> &[Step] {
        &self.steps
    }

    /// One step of each pair that leads to another tile and back, with its index; near tiles first.
    pub(super) fn forward(&self) -> &[(usize, Step)] {
        &self.forward
    }

    /// Masks of the disc around a pixel of a tile, at each step.
    #[inline]
    pub(super) fn masks(&self, at: usize) -> &[u64] {
        let n = self.steps.len();
        &self.masks[at * n..(at + 1) * n]
    }

    /// Parts of the disc around a pixel of a tile: half of the steps, on average, if a disc is as large as a tile.
    #[inline]
    pub(super) fn parts(&self, at: usize) -> &[Part] {
        &self.parts[self.starts[at]..self.starts[at + 1]]
    }

    /// Number of tiles for this many rows of pixels, including the frame.
    pub(super) const fn count(&self, height: usize) -> usize {
        (height.div_ceil(SIDE) + 2 * self.margin) * self.stride
    }

    /// Index of the tile of a row's first pixel.
    #[inline]
    pub(super) const fn first(&self, row: usize) -> usize {
        (row / SIDE + self.margin) * self.stride + self.margin
    }

    /// (row, column) of the first pixel of a tile outside the frame.
    pub(super) const fn corner(&self, tile: usize) -> (usize, usize) {
        let (row, column) = (tile / self.stride, tile % self.stride);
        ((row - self.margin) * SIDE, (column - self.margin) * SIDE)
    }
}

/// For each pixel of a tile, the mask of its disc on the tile this many tiles away.
fn masks(half: &[usize], rows: isize, columns: isize) -> [u64; SIDE * SIDE] {
    let side = SIDE as isize;
    let mut masks = [0; SIDE * SIDE];
    for (at, mask) in masks.iter_mut().enumerate() {
        let (row, column) = ((at / SIDE) as isize, (at % SIDE) as isize);
        for other in 0..side {
            let Some(half) = half.get((rows * side + other - row).unsigned_abs()) else {
                continue;
            };
            // Columns of the other tile within the disc.
            let middle = column - columns * side;
            let first = (middle - *half as isize).max(0);
            let last = (middle + *half as isize).min(side - 1);
            if first <= last {
                let columns = (1_u64 << (last - first + 1)) - 1;
                *mask |= columns << first << (other * side);
            }
        }
    }
    masks
}

/// Positions of the ones in a word, ascending.
#[inline(always)]
pub(super) fn ones(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = word.trailing_zeros() as usize;
        let found = (word != 0).then_some(bit);
        word &= word.wrapping_sub(1);
        found
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_are_discs_and_all_of_them() {
        for eps in [0.0, 0.9, 1.0, 1.5, 7.0, 8.0, 9.0, 10.0, 16.5, 40.0] {
            let tiles = Tiles::new(eps);
            assert_eq!((tiles.steps[0].rows, tiles.steps[0].columns), (0, 0));
            for at in 0..SIDE * SIDE {
                let mut covered = 0;
                for (step, mask) in tiles.steps.iter().zip(tiles.masks(at)) {
                    for to in 0..SIDE * SIDE {
                        let within = step.squared(at, to) as f64 <= eps * eps;
                        assert_eq!(mask >> to & 1 == 1, within, "eps {eps}: {at}, {to}");
                    }
                    covered += mask.count_ones();
                }
                let parts = tiles.parts(at).iter();
                let in_parts: u32 = parts.map(|part| part.mask.count_ones()).sum();
                assert_eq!(in_parts, covered, "eps {eps}: {at}");
                let range = -41..=41_i32;
                let all = range
                    .clone()
                    .flat_map(|x| range.clone().map(move |y| x * x + y * y));
                let disc = all
                    .filter(|squared| f64::from(*squared) <= eps * eps)
                    .count();
                assert_eq!(covered as usize, disc, "eps {eps}: {at}");
            }
        }
        assert!(Tiles::new(f64::NAN).steps.is_empty());
    }

    #[test]
    fn tiles_know_their_places_and_steps_do_not_leave_them() {
        let tiles = Tiles::new(10.0);
        for (row, column) in [(0, 0), (7, 639), (8, 8), (175, 320)] {
            let tile = tiles.first(row) + column / SIDE;
            assert_eq!(
                tiles.corner(tile),
                (row / SIDE * SIDE, column / SIDE * SIDE)
            );
            for step in &tiles.steps {
                assert!(tile.wrapping_add(step.by) < tiles.count(176));
            }
        }
    }
}
