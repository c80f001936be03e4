//! Owns event counts per pixel of the crop, the input of clustering.

use skinrig_model::{CdEvent, SENSOR_HEIGHT, SENSOR_WIDTH};

use crate::counters::Counters;
use crate::pixels::PixelSet;

/// Event counts per pixel: all columns, the rows of a crop.
///
/// The sum of all counts is below 2^32; [`PixelGrid::add_many`] rejects an overflow.
#[derive(Debug, Clone)]
pub struct PixelGrid {
    rows: (u16, u16),
    counts: Counters,
    occupied: PixelSet,
    events: u32,
}

impl PixelGrid {
    /// Number of columns of every grid.
    pub const WIDTH: usize = SENSOR_WIDTH as usize;

    /// An empty grid over the rows `rows.0..=rows.1`; an empty crop if they are in the wrong order.
    #[must_use]
    pub fn new(rows: (u16, u16)) -> Self {
        let rows = (rows.0, rows.1.min(SENSOR_HEIGHT - 1));
        let height = (usize::from(rows.1) + 1).saturating_sub(usize::from(rows.0));
        Self {
            rows,
            counts: Counters::new(height * Self::WIDTH),
            occupied: PixelSet::new(height),
            events: 0,
        }
    }

    /// First and last row, inclusive.
    #[must_use]
    pub const fn rows(&self) -> (u16, u16) {
        self.rows
    }

    /// Number of rows.
    #[must_use]
    pub fn height(&self) -> usize {
        self.counts.len() / Self::WIDTH
    }

    /// Number of events on the grid.
    #[must_use]
    pub const fn events(&self) -> u32 {
        self.events
    }

    /// Counts one event at column `u`, row `v`. Returns false and counts nothing outside the crop, or if the grid already
    /// holds `u32::MAX` events.
    pub fn add(&mut self, u: u16, v: u16) -> bool {
        self.add_many(u, v, 1)
    }

    /// Counts `n` events at column `u`, row `v`. Returns false and counts nothing outside the crop, or if the grid would
    /// exceed `u32::MAX` events.
    #[inline]
    pub fn add_many(&mut self, u: u16, v: u16, n: u32) -> bool {
        if u >= SENSOR_WIDTH || v < self.rows.0 || v > self.rows.1 {
            return false;
        }
        let Some(events) = self.events.checked_add(n) else {
            return false;
        };
        let index = usize::from(v - self.rows.0) * Self::WIDTH + usize::from(u);
        if !self.counts.add_many(index, n) {
            return false;
        }
        if n > 0 {
            self.occupied.insert(index);
        }
        self.events = events;
        true
    }

    /// Counts these events, stopping at the first that is outside the crop or does not fit; false if any remain.
    pub(crate) fn add_all(&mut self, events: &[CdEvent]) -> bool {
        let first = usize::from(self.rows.0) * Self::WIDTH;
        let free = u32::MAX - self.events;
        let fitting = events.len().min(free as usize);
        for (counted, event) in events[..fitting].iter().enumerate() {
            let index = usize::from(event.y) * Self::WIDTH + usize::from(event.x);
            let index = index.wrapping_sub(first);
            if event.x >= SENSOR_WIDTH || !self.counts.add(index) {
                self.events += counted as u32;
                return false;
            }
            self.occupied.insert(index);
        }
        self.events += fitting as u32;
        fitting == events.len()
    }

    /// Empties the grid, in time proportional to its content.
    pub fn clear(&mut self) {
        for pixels in self.occupied.blocks() {
            self.counts.clear(pixels);
        }
        self.occupied.reset(self.height());
        self.events = 0;
    }

    /// Appends the indices (`row * WIDTH + column`, rows counted from the crop's first) of pixels with events to `out`, row
    /// by row.
    pub fn sorted_pixels(&self, out: &mut Vec<u32>) {
        out.clear();
        self.occupied.append_to(out);
    }

    /// Count of the pixel with this index.
    #[must_use]
    pub fn count(&self, index: u32) -> u32 {
        // At most the number of all events.
        self.counts.get(index as usize) as u32
    }

    /// Events on eight pixels from an index on, and which of them have more than one.
    #[inline]
    pub(crate) fn eight(&self, first: usize) -> (u32, u64) {
        let (sum, repeated) = self.counts.eight(first);
        (sum as u32, repeated)
    }

    /// Events per column.
    #[must_use]
    pub fn columns(&self) -> [u32; Self::WIDTH] {
        self.counts.columns().map(|events| events as u32)
    }

    /// Pixels with events in one row, counted from the crop's first: the first 64 in the first word.
    pub(crate) fn occupied(&self, row: usize) -> &[u64] {
        self.occupied.row(row)
    }
}
