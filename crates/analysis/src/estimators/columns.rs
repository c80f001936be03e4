//! Events per column, and their median.

use skinrig_model::SENSOR_WIDTH;

use super::{ColumnEstimate, column_px};
use crate::press_events::PackedEvent;

const COLUMNS: usize = SENSOR_WIDTH as usize;

/// Number of events in each column of bins.
#[derive(Debug, Clone)]
pub(crate) struct ColumnCounts {
    shift: u32,
    counts: Vec<u32>,
    events: u32,
}

impl ColumnCounts {
    /// For bins of side `side_px`, px.
    #[must_use]
    pub(crate) fn new(side_px: u16) -> Self {
        let shift = side_px.max(1).trailing_zeros();
        Self {
            shift,
            counts: vec![0; COLUMNS >> shift],
            events: 0,
        }
    }

    /// Resets the counts and fills them with `events`.
    pub(crate) fn fill(&mut self, events: &[PackedEvent]) {
        self.counts.fill(0);
        for event in events {
            if let Some(count) = self.counts.get_mut(usize::from(event.x() >> self.shift)) {
                *count += 1;
            }
        }
        self.events = events.len() as u32;
    }

    /// Counts, left to right.
    #[must_use]
    pub(crate) fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// Number of all events.
    #[must_use]
    pub(crate) const fn events(&self) -> u32 {
        self.events
    }
}

/// Count-weighted median of the columns. The events of a column are spread evenly over its width, so the median has
/// sub-pixel resolution; if exactly half of the events are on either side of a gap, it is the middle of the gap.
#[derive(Debug, Clone)]
pub struct Median {
    side_px: u16,
    columns: ColumnCounts,
}

impl Median {
    /// For bins of side `side_px`, px.
    #[must_use]
    pub fn new(side_px: u16) -> Self {
        Self {
            side_px,
            columns: ColumnCounts::new(side_px),
        }
    }

    /// See `super::PressEstimator::estimate`.
    pub fn estimate(&mut self, events: &[PackedEvent]) -> ColumnEstimate {
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
                return ColumnEstimate::at(column_px(bin, self.side_px), self.columns.events());
            }
            below = upto;
        }
        ColumnEstimate::default()
    }
}
