//! Owns [`GrowingDbscan`]: clusters of a grid that only gains events from run to run, without starting over.
//!
//! An event that is core stays core when events are added, and the sums of a tile whose pixels are all core are those of its
//! events. So a run examines only pixels that were not core, and adds up only tiles that are partly in a cluster.

use super::{Dbscan, SIDE, Tile, TileSums};
use crate::grid::PixelGrid;

/// A grid and its clusters: the same as from [`Dbscan::run`] on a grid with the same events.
#[derive(Debug, Clone)]
pub(crate) struct GrowingDbscan {
    grid: PixelGrid,
    dbscan: Dbscan,
    /// Sums of all events of each tile.
    sums: Vec<TileSums>,
}

impl GrowingDbscan {
    /// No events on the rows `rows.0..=rows.1`; radius and core threshold as for [`Dbscan::new`].
    pub(crate) fn new(rows: (u16, u16), eps_px: f64, min_samples: u32) -> Self {
        let grid = PixelGrid::new(rows);
        let mut dbscan = Dbscan::new(eps_px, min_samples);
        dbscan.height = grid.height();
        let tiles = dbscan.tiles.count(dbscan.height);
        dbscan.all.resize(tiles, Tile::default());
        Self {
            grid,
            dbscan,
            sums: vec![TileSums::default(); tiles],
        }
    }

    /// Number of events.
    pub(crate) const fn events(&self) -> u32 {
        self.grid.events()
    }

    /// The core threshold.
    pub(crate) const fn min_samples(&self) -> u32 {
        self.dbscan.min_samples
    }

    /// Uses another core threshold from the next run on. Core pixels may then have to be found again, so a change costs as much as
    /// starting over.
    pub(crate) fn set_min_samples(&mut self, min_samples: u32) {
        if min_samples == self.dbscan.min_samples {
            return;
        }
        self.dbscan.min_samples = min_samples;
        for &tile in &self.dbscan.occupied {
            let tile = &mut self.dbscan.all[tile];
            (tile.core, tile.groups) = (0, (0, 0));
        }
    }

    /// Adds an event at column `u`, row `v`; outside the rows, or beyond 2^32 - 1 events, none.
    #[inline]
    pub(crate) fn add(&mut self, u: u16, v: u16) {
        if !self.grid.add(u, v) {
            return;
        }
        let (column, row) = (usize::from(u), usize::from(v - self.grid.rows().0));
        let index = self.dbscan.tiles.first(row) + column / SIDE;
        let at = row % SIDE * SIDE + column % SIDE;
        let tile = &mut self.dbscan.all[index];
        if tile.occupied == 0 {
            self.dbscan.occupied.push(index);
        }
        let pixel = 1_u64 << at;
        tile.repeated |= tile.occupied & pixel;
        tile.occupied |= pixel;
        tile.events += 1;
        self.sums[index].add(at, 1);
    }

    /// Clusters all events.
    pub(crate) fn run(&mut self) -> &Dbscan {
        let Self { grid, dbscan, sums } = self;
        dbscan.instructions.run(
            #[inline(always)]
            || dbscan.cluster(grid, |tile| Some(sums[tile])),
        );
        dbscan
    }

    /// Removes all events.
    pub(crate) fn clear(&mut self) {
        self.grid.clear();
        for tile in self.dbscan.occupied.drain(..) {
            self.dbscan.all[tile] = Tile::default();
            self.sums[tile] = TileSums::default();
        }
    }
}
