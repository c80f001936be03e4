//! The newest events of a camera, in blocks whose times are known, so that a window opens without a look at each of them.

use std::collections::VecDeque;
use std::ops::Range;

use skinrig_model::CdEvent;

/// Events of a block.
const BLOCK: usize = 1 << 10;
/// Blocks: 2 MiB.
const BLOCKS: usize = 1 << 7;

/// Events as they came.
#[derive(Debug, Clone)]
struct Block {
    events: Vec<CdEvent>,
    /// Camera times of the earliest and the latest one, µs.
    span_us: (u64, u64),
}

impl Block {
    fn new() -> Self {
        Self {
            events: Vec::with_capacity(BLOCK),
            span_us: (u64::MAX, 0),
        }
    }

    fn push(&mut self, event: CdEvent) {
        let (first, last) = self.span_us;
        self.span_us = (first.min(event.t_us), last.max(event.t_us));
        self.events.push(event);
    }

    fn clear(&mut self) {
        self.events.clear();
        self.span_us = (u64::MAX, 0);
    }

    fn count(&self, times: &Range<u64>) -> usize {
        let (first, last) = self.span_us;
        if times.contains(&first) && times.contains(&last) {
            self.events.len()
        } else if last < times.start || first >= times.end {
            0
        } else {
            let within = self.events.iter().filter(|e| times.contains(&e.t_us));
            within.count()
        }
    }
}

/// The newest events; none is allocated after the first ones.
#[derive(Debug, Clone)]
pub(crate) struct History {
    blocks: VecDeque<Block>,
    forgotten_us: Option<u64>,
}

impl History {
    pub(crate) fn new() -> Self {
        let mut blocks = VecDeque::with_capacity(BLOCKS);
        blocks.push_back(Block::new());
        Self {
            blocks,
            forgotten_us: None,
        }
    }

    pub(crate) fn push(&mut self, event: CdEvent) {
        if let Some(newest) = self.blocks.back_mut()
            && newest.events.len() < BLOCK
        {
            return newest.push(event);
        }
        let mut block = if self.blocks.len() < BLOCKS {
            Block::new()
        } else {
            self.forget().unwrap_or_else(Block::new)
        };
        block.push(event);
        self.blocks.push_back(block);
    }

    /// Forgets the oldest block and returns it, empty.
    fn forget(&mut self) -> Option<Block> {
        let mut block = self.blocks.pop_front()?;
        self.forgotten_us = self.forgotten_us.max(Some(block.span_us.1));
        block.clear();
        Some(block)
    }

    /// Latest time of the events that are not kept, µs.
    pub(crate) const fn forgotten_us(&self) -> Option<u64> {
        self.forgotten_us
    }

    /// Number of events in a range of times, µs.
    pub(crate) fn count(&self, times: &Range<u64>) -> usize {
        self.blocks.iter().map(|block| block.count(times)).sum()
    }

    /// Events from a time on, µs, as they came.
    pub(crate) fn from(&self, from_us: u64) -> impl Iterator<Item = &CdEvent> {
        let late = self.blocks.iter().filter(move |b| b.span_us.1 >= from_us);
        late.flat_map(|block| &block.events)
            .filter(move |e| e.t_us >= from_us)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use skinrig_model::Polarity;

    use super::*;

    proptest! {
        #[test]
        fn counts_and_events_are_those_of_the_newest_events(jumps in prop::collection::vec(-40_i64..60, 1..400), ends in (0_u64..90_000, 0_u64..90_000)) {
            let (mut history, mut all, mut t_us) = (History::new(), Vec::new(), 50_000_u64);
            for i in 0..(BLOCKS + 3) * BLOCK / 400 * 400 {
                t_us = t_us.saturating_add_signed(jumps[i % jumps.len()] / 8);
                let event = CdEvent { t_us, x: (i % 640) as u16, y: 9, polarity: Polarity::On };
                history.push(event);
                all.push(event);
            }
            let kept = history.blocks.iter().map(|b| b.events.len()).sum::<usize>();
            prop_assert!(kept > (BLOCKS - 1) * BLOCK && kept <= BLOCKS * BLOCK);
            let (forgotten, newest) = all.split_at(all.len() - kept);
            prop_assert_eq!(history.forgotten_us(), forgotten.iter().map(|e| e.t_us).max());
            let times = ends.0.min(ends.1)..ends.0.max(ends.1);
            prop_assert_eq!(history.count(&times), newest.iter().filter(|e| times.contains(&e.t_us)).count());
            let late: Vec<&CdEvent> = newest.iter().filter(|e| e.t_us >= times.start).collect();
            prop_assert_eq!(history.from(times.start).collect::<Vec<_>>(), late);
        }
    }
}
