//! DBSCAN as scikit-learn defines it, computed on pixel counts instead of events.
//!
//! Events are integer pixels, so a press is a grid of counts and every question about neighbours becomes a
//! question about discs on that grid: an event is *core* when the disc of radius eps about it (border
//! included) holds at least `min_samples` events, itself and duplicates counted. Core pixels within eps of
//! each other are one cluster. A *border* event is not core but within eps of a core pixel. Everything else is
//! noise. Core, border and noise are exactly scikit-learn's.
//!
//! Where two clusters reach the same border event, scikit-learn gives it to the one that its input order
//! happened to expand first. There is no input order here; the rule is: **the border event belongs to the
//! cluster of its nearest core pixel; of equally near ones the first by row, then column, decides.** Clusters
//! are numbered by their first core pixel in the same order.
//!
//! Distances are compared squared (`dx² + dy² <= eps * eps`), as scikit-learn's trees do.

use crate::grid::PixelGrid;
use crate::pixels::PixelSet;

/// The label of events that belong to no cluster.
pub const NOISE: u32 = u32::MAX;

const WIDTH: usize = PixelGrid::WIDTH;

/// One cluster.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cluster {
    /// Events in it, core and border.
    pub events: u64,
    /// Sum of their columns, px.
    pub sum_u: u64,
    /// Sum of their rows on the sensor, px.
    pub sum_v: u64,
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

    /// Both together.
    #[must_use]
    pub const fn merged(self, other: Self) -> Self {
        Self {
            events: self.events + other.events,
            sum_u: self.sum_u + other.sum_u,
            sum_v: self.sum_v + other.sum_v,
        }
    }
}

/// Core pixels of one row with gaps of at most eps: always one cluster.
#[derive(Debug, Clone, Copy)]
struct Run {
    /// Range in `core_columns`.
    from: usize,
    to: usize,
    first: u16,
    last: u16,
}

/// The algorithm with its buffers, to be used for press after press.
#[derive(Debug, Clone)]
pub struct Dbscan {
    min_samples: u32,
    /// Half width of the disc at each row distance.
    half: Vec<usize>,
    pixels: Vec<u32>,
    /// Start of each row in `pixels`, one more than there are rows.
    row_start: Vec<usize>,
    prefix: Vec<u32>,
    /// Pixels of a row, by column, that are not yet known to be core, and the events counted near them.
    open: Vec<(u32, u32)>,
    core: PixelSet,
    core_columns: Vec<u16>,
    runs: Vec<Run>,
    run_start: Vec<usize>,
    parent: Vec<u32>,
    run_label: Vec<u32>,
    labels: Vec<u32>,
    clusters: Vec<Cluster>,
}

impl Dbscan {
    /// DBSCAN with radius `eps_px` (0..=640 px) and core threshold `min_samples` (at least 1).
    #[must_use]
    pub fn new(eps_px: f64, min_samples: u32) -> Self {
        let eps_sq = eps_px * eps_px;
        let fits = |dx: usize, dy: usize| (dx * dx + dy * dy) as f64 <= eps_sq;
        let half = (0..WIDTH)
            .take_while(|&dy| fits(0, dy))
            .map(|dy| (0..WIDTH).take_while(|&dx| fits(dx, dy)).count() - 1)
            .collect();
        Self {
            min_samples,
            half,
            pixels: Vec::new(),
            row_start: Vec::new(),
            prefix: Vec::new(),
            open: Vec::new(),
            core: PixelSet::default(),
            core_columns: Vec::new(),
            runs: Vec::new(),
            run_start: Vec::new(),
            parent: Vec::new(),
            run_label: Vec::new(),
            labels: Vec::new(),
            clusters: Vec::new(),
        }
    }

    /// Clusters the events of `grid`; the result lasts until the next call.
    pub fn run(&mut self, grid: &PixelGrid) -> &[Cluster] {
        self.clusters.clear();
        self.labels.clear();
        self.core.reset(grid.height());
        grid.sorted_pixels(&mut self.pixels);
        if self.pixels.is_empty() || self.half.is_empty() {
            self.labels.resize(self.pixels.len(), NOISE);
            return &self.clusters;
        }
        self.index_rows(grid);
        self.find_core();
        self.find_runs(grid.height());
        self.join_runs();
        let count = self.number_clusters();
        self.label_pixels(grid.height());
        self.clusters.resize(count, Cluster::default());
        for (&pixel, &label) in self.pixels.iter().zip(&self.labels) {
            if let Some(cluster) = self.clusters.get_mut(label as usize) {
                let (u, v) = (
                    u64::from(pixel) % WIDTH as u64,
                    u64::from(pixel) / WIDTH as u64,
                );
                let n = u64::from(grid.count(pixel));
                cluster.events += n;
                cluster.sum_u += n * u;
                cluster.sum_v += n * (v + u64::from(grid.rows().0));
            }
        }
        &self.clusters
    }

    /// The clusters of the last run.
    #[must_use]
    pub fn clusters(&self) -> &[Cluster] {
        &self.clusters
    }

    /// (index of the pixel as in [`PixelGrid::sorted_pixels`], its cluster or [`NOISE`]) of the last run.
    pub fn labels(&self) -> impl Iterator<Item = (u32, u32)> {
        self.pixels.iter().copied().zip(self.labels.iter().copied())
    }

    /// Indices of the core pixels of the last run, ascending; every event of such a pixel is core.
    pub fn core_pixels(&self) -> impl Iterator<Item = u32> {
        self.core.iter().map(|index| index as u32)
    }

    /// The largest cluster of the last run, the first of equal ones, with its number.
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

    /// Row starts and, for rows with events, prefix sums of counts.
    fn index_rows(&mut self, grid: &PixelGrid) {
        let height = grid.height();
        self.row_start.clear();
        let mut at = 0;
        for row in 0..height {
            self.row_start.push(at);
            let end = ((row + 1) * WIDTH) as u32;
            at += self.pixels[at..].partition_point(|&p| p < end);
        }
        self.row_start.push(at);
        let reach = self.half[0];
        let stride = self.stride();
        self.prefix.resize(height * stride, 0);
        for row in 0..height {
            if self.row_start[row] == self.row_start[row + 1] {
                continue;
            }
            let sums = &mut self.prefix[row * stride..(row + 1) * stride];
            let (before, sums) = sums.split_at_mut(reach + 1);
            let (within, after) = sums.split_at_mut(WIDTH);
            before.fill(0);
            let mut sum = 0;
            for (s, c) in within.iter_mut().zip(grid.row(row)) {
                sum += c;
                *s = sum;
            }
            after.fill(sum);
        }
    }

    /// Length of a row of `prefix`: a sum up to each column, and as many beyond both ends as a disc reaches.
    fn stride(&self) -> usize {
        WIDTH + 2 * self.half[0] + 1
    }

    fn find_core(&mut self) {
        let (reach, stride) = (self.half[0], self.stride());
        let height = self.row_start.len() - 1;
        let mut open = std::mem::take(&mut self.open);
        for row in 0..height {
            let pixels = &self.pixels[self.row_start[row]..self.row_start[row + 1]];
            let first = row * WIDTH;
            open.clear();
            open.extend(pixels.iter().map(|&p| (p - first as u32, 0)));
            // Near rows first: in a dense press the first row already decides.
            for (dy, &half) in self.half.iter().enumerate() {
                let above = row.checked_sub(dy);
                let below = (dy > 0).then_some(row + dy).filter(|r| *r < height);
                for other in above.into_iter().chain(below) {
                    if self.row_start[other] == self.row_start[other + 1] {
                        continue;
                    }
                    let sums = &self.prefix[other * stride..(other + 1) * stride];
                    let (left, right) = (&sums[reach - half..], &sums[reach + half + 1..]);
                    for (x, sum) in &mut open {
                        *sum += right[*x as usize] - left[*x as usize];
                    }
                }
                open.retain(|&(x, sum)| {
                    let is_core = sum >= self.min_samples;
                    if is_core {
                        self.core.insert(first + x as usize);
                    }
                    !is_core
                });
                if open.is_empty() {
                    break;
                }
            }
        }
        self.open = open;
    }

    fn find_runs(&mut self, height: usize) {
        self.core_columns.clear();
        self.runs.clear();
        self.run_start.clear();
        let reach = self.half[0] as u16;
        for row in 0..height {
            self.run_start.push(self.runs.len());
            let fresh = self.runs.len();
            for x in self.core.columns(row) {
                let x = x as u16;
                let at = self.core_columns.len();
                self.core_columns.push(x);
                match self.runs[fresh..].last_mut() {
                    Some(run) if x - run.last <= reach => {
                        run.last = x;
                        run.to = at + 1;
                    }
                    _ => self.runs.push(Run {
                        from: at,
                        to: at + 1,
                        first: x,
                        last: x,
                    }),
                }
            }
        }
        self.run_start.push(self.runs.len());
    }

    fn join_runs(&mut self) {
        self.parent.clear();
        self.parent.extend(0..self.runs.len() as u32);
        let height = self.run_start.len() - 1;
        for row in 0..height {
            // Near rows first: what they join need not be looked at again.
            for dy in 1..self.half.len().min(height - row) {
                self.join_rows(row, row + dy, self.half[dy] as u16);
            }
        }
    }

    /// Joins the runs of two rows that have core pixels at most `half` columns apart.
    fn join_rows(&mut self, row: usize, below: usize, half: u16) {
        let others = self.run_start[below]..self.run_start[below + 1];
        let mut skip = others.start;
        for a in self.run_start[row]..self.run_start[row + 1] {
            let run = self.runs[a];
            while skip < others.end && self.runs[skip].last + half < run.first {
                skip += 1;
            }
            let mut ra = find(&mut self.parent, a);
            for b in skip..others.end {
                let other = self.runs[b];
                if other.first > run.last + half {
                    break;
                }
                // Most are joined already, and most of these know it themselves.
                if self.parent[b] as usize == ra {
                    continue;
                }
                let rb = find(&mut self.parent, b);
                self.parent[b] = rb as u32;
                if ra != rb && self.touch(run, other, half) {
                    // The smaller index is the root: it is the first run by row and column.
                    self.parent[ra.max(rb)] = ra.min(rb) as u32;
                    ra = ra.min(rb);
                }
            }
        }
    }

    /// True when some core pixel of `a` and some of `b` are at most `half` columns apart.
    fn touch(&self, a: Run, b: Run, half: u16) -> bool {
        let (xs, ys) = (
            &self.core_columns[a.from..a.to],
            &self.core_columns[b.from..b.to],
        );
        let (mut i, mut j) = (
            xs.partition_point(|x| x + half < b.first),
            ys.partition_point(|y| y + half < a.first),
        );
        while let (Some(x), Some(y)) = (xs.get(i), ys.get(j)) {
            if x.abs_diff(*y) <= half {
                return true;
            }
            if x < y {
                i += 1;
            } else {
                j += 1;
            }
        }
        false
    }

    /// Numbers the clusters by their first run; returns how many there are.
    fn number_clusters(&mut self) -> usize {
        self.run_label.clear();
        let mut count = 0;
        for i in 0..self.runs.len() {
            let root = find(&mut self.parent, i);
            let label = if root == i {
                count += 1;
                count - 1
            } else {
                self.run_label[root]
            };
            self.run_label.push(label);
        }
        count as usize
    }

    fn label_pixels(&mut self, height: usize) {
        // Core pixels come in the order of the runs.
        let (mut core, mut run) = (0, 0);
        for &pixel in &self.pixels {
            let label = if self.core.contains(pixel as usize) {
                if core == self.runs[run].to {
                    run += 1;
                }
                core += 1;
                self.run_label[run]
            } else {
                let (x, y) = (pixel as usize % WIDTH, pixel as usize / WIDTH);
                self.nearest_core(x, y, height)
                    .map_or(NOISE, |(x, y)| self.label_of_core(x, y))
            };
            self.labels.push(label);
        }
    }

    /// Column and row of the core pixel nearest to a pixel and within reach, the first of equally near ones by row,
    /// then column.
    fn nearest_core(&self, x: usize, y: usize, height: usize) -> Option<(usize, usize)> {
        // (distance squared, row, column)
        let mut best: Option<(usize, usize, usize)> = None;
        for (dy, &half) in self.half.iter().enumerate() {
            if best.is_some_and(|(distance, ..)| dy * dy > distance) {
                break;
            }
            let above = y.checked_sub(dy);
            let below = (dy > 0).then_some(y + dy).filter(|row| *row < height);
            for row in above.into_iter().chain(below) {
                if let Some(column) = self.core.nearest(row, x, half) {
                    let dx = x.abs_diff(column);
                    let found = (dx * dx + dy * dy, row, column);
                    best = Some(best.map_or(found, |b| b.min(found)));
                }
            }
        }
        best.map(|(_, row, column)| (column, row))
    }

    fn label_of_core(&self, x: usize, row: usize) -> u32 {
        let range = self.run_start[row]..self.run_start[row + 1];
        let i = self.runs[range.clone()].partition_point(|r| usize::from(r.last) < x);
        self.run_label[range.start + i]
    }
}

fn find(parent: &mut [u32], mut i: usize) -> usize {
    while parent[i] as usize != i {
        parent[i] = parent[parent[i] as usize];
        i = parent[i] as usize;
    }
    i
}
