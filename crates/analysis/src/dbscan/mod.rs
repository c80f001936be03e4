//! DBSCAN as defined by scikit-learn, computed on pixel counts instead of events.
//!
//! Events are on integer pixels, so a press is a grid of counts and every question about neighbours becomes one about discs
//! on that grid: an event is *core* if the disc of radius eps around it (border included) holds at least `min_samples`
//! events, counting itself and duplicates. Core pixels within eps of each other are one cluster. A *border* event is not
//! core but within eps of a core pixel. Everything else is noise. Core, border and noise are exactly scikit-learn's.
//!
//! If two clusters reach the same border event, scikit-learn assigns it to the one that its input order happens to expand
//! first. There is no input order here; the rule is: **the border event belongs to the cluster of its nearest core pixel;
//! ties go to the first by row, then column.** Clusters are numbered by their first core pixel in the same order.
//!
//! Distances are compared squared (`dx² + dy² <= eps * eps`), as scikit-learn's trees do.

mod growing;
mod tiles;

use skinrig_simd::InstructionSet;

pub(crate) use self::growing::GrowingDbscan;
use self::tiles::{Part, SIDE, Tiles, WIDTH, ones};
use crate::grid::PixelGrid;

/// Label of events outside all clusters.
pub const NOISE: u32 = u32::MAX;

/// One cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cluster {
    /// Number of core and border events.
    pub events: u64,
    /// Sum of their columns, px.
    pub sum_u: u64,
    /// Sum of their rows on the sensor, px.
    pub sum_v: u64,
    /// Sum of the squares of their columns, px².
    pub sum_uu: u64,
    /// Sum of the squares of their rows, px².
    pub sum_vv: u64,
}

impl Cluster {
    /// Mean column and row, px; `None` without events.
    #[must_use]
    pub fn centroid(&self) -> Option<(f64, f64)> {
        (self.events > 0).then(|| {
            let n = self.events as f64;
            (self.sum_u as f64 / n, self.sum_v as f64 / n)
        })
    }

    /// Standard deviation of the columns, px; `None` without events.
    #[must_use]
    pub fn spread_u(&self) -> Option<f64> {
        self.deviation(self.sum_u, self.sum_uu)
    }

    /// Standard deviation of the rows, px; `None` without events.
    #[must_use]
    pub fn spread_v(&self) -> Option<f64> {
        self.deviation(self.sum_v, self.sum_vv)
    }

    fn deviation(&self, sum: u64, squares: u64) -> Option<f64> {
        let n = u128::from(self.events);
        // Integers: no cancellation.
        let squares = n * u128::from(squares) - u128::from(sum).pow(2);
        (n > 0).then(|| (squares as f64).sqrt() / n as f64)
    }

    /// Sum of both clusters.
    #[must_use]
    pub const fn merged(self, other: Self) -> Self {
        Self {
            events: self.events + other.events,
            sum_u: self.sum_u + other.sum_u,
            sum_v: self.sum_v + other.sum_v,
            sum_uu: self.sum_uu + other.sum_uu,
            sum_vv: self.sum_vv + other.sum_vv,
        }
    }
}

/// The algorithm with reusable buffers.
///
/// Pixels are processed in tiles of 8 by 8, each a 64-bit word. A disc is a set of masks on the tiles around it, so counting
/// the events near a pixel, joining core pixels and finding borders take a few words each.
#[derive(Debug, Clone)]
pub struct Dbscan {
    instructions: InstructionSet,
    min_samples: u32,
    tiles: Tiles,
    /// True if all pixels of a tile are within eps of each other.
    tile_is_near: bool,
    /// State per tile, including the frame.
    all: Vec<Tile>,
    /// Tiles with events.
    occupied: Vec<usize>,
    groups: Vec<Group>,
    /// Union-find parent per group, with an earlier first pixel; or itself.
    parents: Vec<u32>,
    /// Rows of the grid.
    height: usize,
    clusters: Vec<Cluster>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Tile {
    /// Pixels with events.
    occupied: u64,
    /// Pixels with more than one event.
    repeated: u64,
    /// Core pixels, or those known so far.
    core: u64,
    /// Events.
    events: u32,
    /// Range of its groups.
    groups: (u32, u32),
}

/// Sums over events of one tile, from its first pixel.
#[derive(Debug, Clone, Copy, Default)]
struct TileSums {
    events: u64,
    right: u64,
    right_squares: u64,
    down: u64,
    down_squares: u64,
}

impl TileSums {
    /// Adds this many events at a position.
    #[inline(always)]
    fn add(&mut self, at: usize, events: u32) {
        let events = u64::from(events);
        let (right, down) = ((at % SIDE) as u64, (at / SIDE) as u64);
        self.events += events;
        self.right += events * right;
        self.right_squares += events * right * right;
        self.down += events * down;
        self.down_squares += events * down * down;
    }

    /// Adds these events to a cluster; the tile's first pixel is at `column`, `row` of the sensor.
    #[inline(always)]
    fn add_to(&self, cluster: &mut Cluster, column: u64, row: u64) {
        let n = self.events;
        cluster.events += n;
        cluster.sum_u += n * column + self.right;
        cluster.sum_uu += (n * column + 2 * self.right) * column + self.right_squares;
        cluster.sum_v += n * row + self.down;
        cluster.sum_vv += (n * row + 2 * self.down) * row + self.down_squares;
    }
}

/// Core pixels of one tile that form one cluster without the help of others.
#[derive(Debug, Clone, Copy)]
struct Group {
    tile: usize,
    core: u64,
    /// Index of its first pixel.
    first: u32,
    label: u32,
}

impl Dbscan {
    /// DBSCAN with radius `eps_px` (0..=640 px) and core threshold `min_samples` (at least 1).
    #[must_use]
    pub fn new(eps_px: f64, min_samples: u32) -> Self {
        let tiles = Tiles::new(eps_px);
        let own = |at| tiles.masks(at).first() == Some(&u64::MAX);
        Self {
            instructions: InstructionSet::best(),
            min_samples,
            tile_is_near: (0..SIDE * SIDE).all(own),
            tiles,
            all: Vec::new(),
            occupied: Vec::new(),
            groups: Vec::new(),
            parents: Vec::new(),
            height: 0,
            clusters: Vec::new(),
        }
    }

    /// Uses other instructions than the best ones of this processor, with the same results.
    #[must_use]
    pub fn with_instructions(mut self, instructions: InstructionSet) -> Self {
        self.instructions = instructions;
        self
    }

    /// Uses this core threshold (at least 1) from the next run on.
    pub fn set_min_samples(&mut self, min_samples: u32) {
        self.min_samples = min_samples;
    }

    /// Clusters the events of `grid`; the result is valid until the next call.
    pub fn run(&mut self, grid: &PixelGrid) -> &[Cluster] {
        // Pixels are counted and found in words of bits: POPCNT and TZCNT.
        self.instructions.run(
            #[inline(always)]
            || {
                self.load(grid);
                self.cluster(grid, |_| None);
            },
        );
        &self.clusters
    }

    /// Clusters the loaded events. `sums`: those of all events of a tile, where they are known.
    #[inline(always)]
    fn cluster(&mut self, grid: &PixelGrid, sums: impl Fn(usize) -> Option<TileSums>) {
        self.find_core(grid);
        self.join();
        self.number();
        self.sum(grid, sums);
    }

    /// The clusters of the last run.
    #[must_use]
    pub fn clusters(&self) -> &[Cluster] {
        &self.clusters
    }

    /// (index of the pixel as in [`PixelGrid::sorted_pixels`], its cluster or [`NOISE`]) of the last run.
    pub fn labels(&self) -> impl Iterator<Item = (u32, u32)> {
        self.pixels(|tile| tile.occupied)
            .map(|(index, tile, at)| (index, self.label(tile, at).unwrap_or(NOISE)))
    }

    /// Indices of the core pixels of the last run, ascending; every event on such a pixel is core.
    pub fn core_pixels(&self) -> impl Iterator<Item = u32> {
        self.pixels(|tile| tile.core).map(|(index, ..)| index)
    }

    /// Largest cluster of the last run, the first of equal ones, with its number.
    #[must_use]
    pub fn largest(&self) -> Option<(u32, Cluster)> {
        let mut best: Option<(u32, Cluster)> = None;
        for (i, c) in self.clusters.iter().enumerate() {
            if best.is_none_or(|(_, b)| c.events > b.events) {
                best = Some((i as u32, *c));
            }
        }
        best
    }

    /// (index, tile, position in the tile) of some pixels, ascending.
    fn pixels(&self, of: fn(&Tile) -> u64) -> impl Iterator<Item = (u32, usize, usize)> {
        (0..self.height).flat_map(move |row| {
            let first = self.tiles.first(row);
            let start = row % SIDE * SIDE;
            (0..WIDTH / SIDE).flat_map(move |i| {
                let bits = of(&self.all[first + i]) >> start & 0xff;
                let index = row * WIDTH + i * SIDE;
                ones(bits).map(move |bit| ((index + bit) as u32, first + i, start + bit))
            })
        })
    }

    /// Index of the first pixel of a tile.
    fn corner(&self, tile: usize) -> usize {
        let (row, column) = self.tiles.corner(tile);
        row * WIDTH + column
    }

    /// Loads pixels and events of each tile.
    #[inline(always)]
    fn load(&mut self, grid: &PixelGrid) {
        self.height = grid.height();
        for tile in self.occupied.drain(..) {
            self.all[tile] = Tile::default();
        }
        let count = self.tiles.count(self.height);
        self.all.resize(count, Tile::default());
        for row in 0..self.height {
            let (first, start) = (self.tiles.first(row), row % SIDE * SIDE);
            for (i, word) in grid.occupied(row).iter().enumerate() {
                let mut left = *word;
                while left != 0 {
                    let k = left.trailing_zeros() as usize / SIDE;
                    let bits = left >> (k * SIDE) & 0xff;
                    left ^= bits << (k * SIDE);
                    let at = i * SIDE + k;
                    let tile = &mut self.all[first + at];
                    if tile.occupied == 0 {
                        self.occupied.push(first + at);
                    }
                    tile.occupied |= bits << start;
                    let pixel = row * WIDTH + at * SIDE;
                    let (events, repeated) = grid.eight(pixel);
                    tile.events += events;
                    tile.repeated |= repeated << start;
                }
            }
        }
    }

    #[inline(always)]
    fn find_core(&mut self, grid: &PixelGrid) {
        self.groups.clear();
        self.parents.clear();
        for &index in &self.occupied {
            let tile = self.all[index];
            let corner = self.corner(index);
            let mut core = tile.core;
            if self.tile_is_near && tile.events >= self.min_samples {
                core = tile.occupied;
            } else {
                // No `fold`: it would be a function of its own, compiled for the baseline.
                for at in ones(tile.occupied & !tile.core) {
                    core |= u64::from(self.is_core(grid, index, corner, at)) << at;
                }
            }
            if core == 0 {
                continue;
            }
            let from = self.groups.len() as u32;
            let mut left = core;
            while left != 0 {
                let first = left.trailing_zeros() as usize;
                let core = self.connected(first, left);
                left &= !core;
                self.parents.push(self.groups.len() as u32);
                self.groups.push(Group {
                    tile: index,
                    core,
                    first: (corner + offset(first)) as u32,
                    label: 0,
                });
            }
            self.all[index].core = core;
            self.all[index].groups = (from, self.groups.len() as u32);
        }
    }

    /// True if enough events are in the disc around a pixel of the tile whose first pixel has index `corner`.
    #[inline(always)]
    fn is_core(&self, grid: &PixelGrid, tile: usize, corner: usize, at: usize) -> bool {
        let parts = self.tiles.parts(at);
        let (mut events, mut repeated) = (0, 0);
        // Every pixel has at least one event, so no branch depends on single pixels.
        for Part { by, mask, .. } in parts {
            let near = &self.all[tile.wrapping_add(*by)];
            events += (near.occupied & mask).count_ones();
            repeated |= near.repeated & mask;
            if events >= self.min_samples {
                return true;
            }
        }
        if repeated == 0 {
            return false;
        }
        for Part { step, by, mask } in parts {
            let repeated = self.all[tile.wrapping_add(*by)].repeated & mask;
            let corner = corner.wrapping_add(self.tiles.steps()[*step].pixels);
            for at in ones(repeated) {
                events = events.saturating_add(grid.count((corner + offset(at)) as u32) - 1);
            }
            if events >= self.min_samples {
                return true;
            }
        }
        false
    }

    /// Core pixels of a tile that form one cluster with the one at `first`.
    #[inline(always)]
    fn connected(&self, first: usize, core: u64) -> u64 {
        if self.tile_is_near {
            return core;
        }
        let (mut all, mut fresh) = (0, 1 << first);
        while fresh != 0 {
            all |= fresh;
            let mut near = 0;
            for at in ones(fresh) {
                near |= self.tiles.masks(at).first().copied().unwrap_or(0);
            }
            fresh = near & core & !all;
        }
        all
    }

    /// Joins groups with pixels within eps of each other.
    #[inline(always)]
    fn join(&mut self) {
        let parents = &mut self.parents;
        for (a, Group { tile, core, .. }) in self.groups.iter().enumerate() {
            let mut root = find(parents, a);
            // Near tiles first: groups that they join need no further comparison.
            for (k, step) in self.tiles.forward() {
                let able = core & step.able;
                if able == 0 {
                    continue;
                }
                let (from, to) = self.all[tile.wrapping_add(step.by)].groups;
                for b in from as usize..to as usize {
                    let found = find(parents, b);
                    if found == root {
                        continue;
                    }
                    let others = self.groups[b].core;
                    if ones(able).any(|at| self.tiles.masks(at)[*k] & others != 0) {
                        let (early, late) = if self.groups[found].first < self.groups[root].first {
                            (found, root)
                        } else {
                            (root, found)
                        };
                        parents[late] = early as u32;
                        root = early;
                    }
                }
            }
        }
    }

    /// Numbers the clusters by their first core pixel.
    fn number(&mut self) {
        let firsts = self.groups.iter().map(|g| g.first).enumerate();
        let mut roots: Vec<(u32, usize)> = firsts
            .filter(|(i, _)| self.parents[*i] as usize == *i)
            .map(|(i, first)| (first, i))
            .collect();
        roots.sort_unstable();
        for (label, (_, root)) in (0..).zip(&roots) {
            self.groups[*root].label = label;
        }
        for i in 0..self.groups.len() {
            let root = find(&mut self.parents, i);
            self.groups[i].label = self.groups[root].label;
        }
        self.clusters.clear();
        self.clusters.resize(roots.len(), Cluster::default());
    }

    /// Computes the sums of the clusters.
    #[inline(always)]
    fn sum(&mut self, grid: &PixelGrid, known: impl Fn(usize) -> Option<TileSums>) {
        let mut clusters = std::mem::take(&mut self.clusters);
        let top = u64::from(grid.rows().0);
        for &index in &self.occupied {
            let tile = &self.all[index];
            let (row, column) = self.tiles.corner(index);
            let corner = row * WIDTH + column;
            let mut add = |label: u32, pixels: u64| {
                let whole = (pixels == tile.occupied).then(|| known(index)).flatten();
                let sums = whole.unwrap_or_else(|| {
                    let mut sums = TileSums::default();
                    for at in ones(pixels) {
                        sums.add(at, grid.count((corner + offset(at)) as u32));
                    }
                    sums
                });
                sums.add_to(
                    &mut clusters[label as usize],
                    column as u64,
                    row as u64 + top,
                );
            };
            for group in self.groups_of(index) {
                add(group.label, group.core);
            }
            let rest = tile.occupied & !tile.core;
            if rest != 0 && self.is_near_core(index) {
                for at in ones(rest) {
                    if let Some(label) = self.border(index, at) {
                        add(label, 1 << at);
                    }
                }
            }
        }
        self.clusters = clusters;
    }

    /// True if a disc around a pixel of the tile may contain core pixels.
    #[inline(always)]
    fn is_near_core(&self, tile: usize) -> bool {
        let core = |by| self.all[tile.wrapping_add(by)].core;
        self.tiles.steps().iter().any(|step| core(step.by) != 0)
    }

    /// Cluster of a pixel with events.
    fn label(&self, tile: usize, at: usize) -> Option<u32> {
        self.core_label(tile, at).or_else(|| self.border(tile, at))
    }

    /// Cluster of a core pixel.
    fn core_label(&self, tile: usize, at: usize) -> Option<u32> {
        let mut groups = self.groups_of(tile).iter();
        groups.find(|g| g.core >> at & 1 == 1).map(|g| g.label)
    }

    /// Cluster of the nearest core pixel within eps of a non-core pixel; ties go to the first by row, then column.
    #[inline]
    fn border(&self, tile: usize, at: usize) -> Option<u32> {
        let met = self
            .tiles
            .parts(at)
            .iter()
            .filter_map(|Part { step, by, mask }| {
                let other = tile.wrapping_add(*by);
                let within = self.all[other].core & mask;
                (within != 0).then_some((step, other, within))
            });
        let mut labels = met.clone().flat_map(|(_, other, within)| {
            let groups = self.groups_of(other).iter();
            groups
                .filter(move |g| g.core & within != 0)
                .map(|g| g.label)
        });
        let label = labels.next()?;
        if labels.all(|other| other == label) {
            return Some(label);
        }
        let pixels = met.flat_map(|(step, other, within)| {
            let (corner, step) = (self.corner(other), &self.tiles.steps()[*step]);
            ones(within).map(move |to| (step.squared(at, to), corner + offset(to), other, to))
        });
        // No two of them have the same index.
        let (.., other, to) = pixels.min()?;
        self.core_label(other, to)
    }

    fn groups_of(&self, tile: usize) -> &[Group] {
        let (from, to) = self.all[tile].groups;
        &self.groups[from as usize..to as usize]
    }
}

/// Offset from the index of a tile's first pixel to the pixel at a position.
#[inline]
const fn offset(at: usize) -> usize {
    at / SIDE * WIDTH + at % SIDE
}

/// First known group of a group's cluster.
#[inline]
fn find(parents: &mut [u32], mut i: usize) -> usize {
    while parents[i] as usize != i {
        parents[i] = parents[parents[i] as usize];
        i = parents[i] as usize;
    }
    i
}
