//! Owns the events cached by one pass, so that the next pass need not read and decode them again.

use skinrig_model::{CdEvent, Polarity};

/// Maximum number of events per camera: 256 MiB.
const MAX_EVENTS: usize = 1 << 25;
/// Events unpacked together.
const SLICE: usize = 1024;

const ROW_SHIFT: u32 = 10;
const POLARITY_SHIFT: u32 = 19;
const TIME_SHIFT: u32 = 20;
/// Times must be less than this after `start_us`: 203 days.
const TIME_END_US: u64 = 1 << (u64::BITS - TIME_SHIFT);

/// Events in order of arrival, 8 bytes each: time (44 bit, µs), polarity, row, column.
#[derive(Debug, Default)]
pub(crate) struct EventCache {
    packed: Vec<u64>,
    /// Origin of the times; half of their range is before the first event.
    start_us: u64,
    newest_us: u64,
    /// Some events came after newer ones.
    in_disorder: bool,
}

impl EventCache {
    /// Adds the next events, which are on the sensor and in time order, all of them or none: false if there is no space, or
    /// a time is out of range.
    pub(crate) fn add(&mut self, events: &[CdEvent]) -> bool {
        let (Some(first), Some(last)) = (events.first(), events.last()) else {
            return true;
        };
        if self.packed.is_empty() {
            self.start_us = first.t_us.saturating_sub(TIME_END_US / 2);
        }
        let start_us = self.start_us;
        let tells = |e: &CdEvent| e.t_us.wrapping_sub(start_us) < TIME_END_US;
        let fits = events.len() <= MAX_EVENTS - self.packed.len();
        if !fits || !tells(first) || !tells(last) {
            return false;
        }
        self.in_disorder |= first.t_us < self.newest_us;
        self.newest_us = self.newest_us.max(last.t_us);
        self.packed.extend(events.iter().map(|e| {
            (e.t_us - start_us) << TIME_SHIFT
                | u64::from(e.polarity == Polarity::On) << POLARITY_SHIFT
                | u64::from(e.y) << ROW_SHIFT
                | u64::from(e.x)
        }));
        true
    }

    /// True if no event is older than its predecessor.
    pub(crate) const fn in_order(&self) -> bool {
        !self.in_disorder
    }

    /// Calls `each` with consecutive slices of all events, once.
    pub(crate) fn for_each_slice(&self, mut each: impl FnMut(&[CdEvent])) {
        let mut events = Vec::with_capacity(SLICE);
        let start_us = self.start_us;
        for slice in self.packed.chunks(SLICE) {
            events.clear();
            events.extend(slice.iter().map(|packed| CdEvent {
                t_us: start_us + (packed >> TIME_SHIFT),
                x: (packed & 0x3ff) as u16,
                y: (packed >> ROW_SHIFT & 0x1ff) as u16,
                polarity: Polarity::from_bit(packed >> POLARITY_SHIFT & 1 == 1),
            }));
            each(&events);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn events_come_back_as_they_were(
            // The sum is at most u64::MAX.
            from_us in prop_oneof![Just(0), Just(u64::MAX - TIME_END_US / 2), any::<u64>().prop_map(|t| t / 2)],
            slices in vec(vec((0..TIME_END_US / 2, 0u16..640, 0u16..480, any::<bool>()), 0..1500), 0..4),
        ) {
            let mut cache = EventCache::default();
            let mut all = Vec::new();
            for slice in slices {
                let event =
                    |(t, x, y, on)| CdEvent { t_us: from_us + t, x, y, polarity: Polarity::from_bit(on) };
                let mut events: Vec<CdEvent> = slice.into_iter().map(event).collect();
                events.sort_by_key(|e| e.t_us);
                prop_assert!(cache.add(&events));
                all.extend(events);
            }
            let mut back = Vec::new();
            cache.for_each_slice(|events| back.extend_from_slice(events));
            prop_assert_eq!(cache.in_order(), all.is_sorted_by_key(|e: &CdEvent| e.t_us));
            prop_assert_eq!(back, all);
        }
    }

    #[test]
    fn a_slice_that_does_not_fit_is_refused_completely() {
        let event = |t_us, x, y| CdEvent {
            t_us,
            x,
            y,
            polarity: Polarity::On,
        };
        let first = event(TIME_END_US, 639, 479);
        let earliest = TIME_END_US / 2;
        let mut cache = EventCache::default();
        assert!(cache.add(&[first]));
        assert!(!cache.add(&[first, event(earliest + TIME_END_US, 0, 0)]));
        assert!(!cache.add(&[event(earliest - 1, 0, 0), first]));
        assert_eq!(cache.packed.len(), 1);
        assert!(cache.add(&[
            event(earliest, 0, 0),
            event(earliest + TIME_END_US - 1, 0, 0)
        ]));
    }
}
