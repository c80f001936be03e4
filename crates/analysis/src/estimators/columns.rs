//! Events per column, and their median.

use skinrig_model::SENSOR_WIDTH;

use super::{Sighting, column_px};
use crate::kept::KeptEvent;

const COLUMNS: usize = SENSOR_WIDTH as usize;

/// How many events fell on each column of bins.
#[derive(Debug, Clone)]
pub struct ColumnCounts {
    shift: u32,
    counts: Vec<u32>,
    events: u32,
}

impl ColumnCounts {
    /// Columns of bins of this side, px.
    #[must_use]
    pub fn new(side_px: u16) -> Self {
        let shift = side_px.max(1).trailing_zeros();
        Self {
            shift,
            counts: vec![0; COLUMNS >> shift],
            events: 0,
        }
    }

    /// Starts again with these events.
    pub fn fill(&mut self, events: &[KeptEvent]) {
        self.counts.fill(0);
        for event in events {
            if let Some(count) = self.counts.get_mut(usize::from(event.x() >> self.shift)) {
                *count += 1;
            }
        }
        self.events = events.len() as u32;
    }

    /// The counts, left to right.
    #[must_use]
    pub fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// All events.
    #[must_use]
    pub const fn events(&self) -> u32 {
        self.events
    }
}

/// The count-weighted median of the columns. The events of a column are spread evenly over its width, so that the median
/// lies between pixels; when exactly half of the events lie on either side of a gap, it is the gap's middle.
#[derive(Debug, Clone)]
pub struct Median {
    side_px: u16,
    columns: ColumnCounts,
}

impl Median {
    /// On bins of this side, px.
    #[must_use]
    pub fn new(side_px: u16) -> Self {
        Self {
            side_px,
            columns: ColumnCounts::new(side_px),
        }
    }

    /// See `super::PressEstimator::sight`.
    pub fn sight(&mut self, events: &[KeptEvent]) -> Sighting {
        self.columns.fill(events);
        let total = u64::from(self.columns.events());
        let mut below = 0u64;
        let mut counts = self
            .columns
            .counts()
            .iter()
            .map(|c| u64::from(*c))
            .enumerate();
        while let Some((column, count)) = counts.next() {
            let upto = below + count;
            if count > 0 && 2 * upto >= total {
                let bin = if 2 * upto == total {
                    let next = counts.find(|(_, c)| *c > 0).map_or(column, |(c, _)| c);
                    (column + next) as f64 / 2.0
                } else {
                    let share = (total - 2 * below) as f64 / (2 * count) as f64;
                    column as f64 - 0.5 + share
                };
                return Sighting::at(column_px(bin, self.side_px), self.columns.events());
            }
            below = upto;
        }
        Sighting::default()
    }
}
