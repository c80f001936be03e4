//! The events of one pass, held in memory so that the next pass need not read and decode them again.

use skinrig_model::{CdEvent, Polarity, SENSOR_HEIGHT, SENSOR_WIDTH};

/// Most events held per camera: 256 MiB.
const MAX_EVENTS: usize = 1 << 25;
/// Events that are unpacked together.
const SLICE: usize = 1024;

const ROW_SHIFT: u32 = 10;
const POLARITY_SHIFT: u32 = 19;
const TIME_SHIFT: u32 = 20;
/// Times lie less than this after `start_us`: 203 days.
const TIME_END_US: u64 = 1 << (u64::BITS - TIME_SHIFT);

/// Events in the order in which they came, 8 bytes each: time (44 bit, µs), polarity, row, column.
#[derive(Debug, Default)]
pub struct Held {
    packed: Vec<u64>,
    /// What times are counted from: half of what they can tell lies before the first event.
    start_us: u64,
}

impl Held {
    /// Takes the next events, all of them or none: false when there is no room, or an event cannot be packed.
    pub fn add(&mut self, events: &[CdEvent]) -> bool {
        if self.packed.is_empty()
            && let Some(first) = events.first()
        {
            self.start_us = first.t_us.saturating_sub(TIME_END_US / 2);
        }
        let start_us = self.start_us;
        let packs = |e: &CdEvent| {
            (e.t_us.wrapping_sub(start_us) < TIME_END_US)
                & (e.x < SENSOR_WIDTH)
                & (e.y < SENSOR_HEIGHT)
        };
        let fits = events.len() <= MAX_EVENTS - self.packed.len();
        if !fits || !events.iter().fold(true, |all, e| all & packs(e)) {
            return false;
        }
        self.packed.extend(events.iter().map(|e| {
            (e.t_us - start_us) << TIME_SHIFT
                | u64::from(e.polarity == Polarity::On) << POLARITY_SHIFT
                | u64::from(e.y) << ROW_SHIFT
                | u64::from(e.x)
        }));
        true
    }

    /// Calls `each` with consecutive slices of the events, all of them, once.
    pub fn for_each_slice(&self, mut each: impl FnMut(&[CdEvent])) {
        let mut events = Vec::with_capacity(SLICE);
        for slice in self.packed.chunks(SLICE) {
            events.clear();
            events.extend(slice.iter().map(|packed| CdEvent {
                t_us: self.start_us + (packed >> TIME_SHIFT),
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
            let mut held = Held::default();
            let mut all = Vec::new();
            for slice in slices {
                let event =
                    |(t, x, y, on)| CdEvent { t_us: from_us + t, x, y, polarity: Polarity::from_bit(on) };
                let events: Vec<CdEvent> = slice.into_iter().map(event).collect();
                prop_assert!(held.add(&events));
                all.extend(events);
            }
            let mut back = Vec::new();
            held.for_each_slice(|events| back.extend_from_slice(events));
            prop_assert_eq!(back, all);
        }
    }

    #[test]
    fn what_does_not_fit_is_refused_whole() {
        let event = |t_us, x, y| CdEvent {
            t_us,
            x,
            y,
            polarity: Polarity::On,
        };
        let first = event(TIME_END_US, 639, 479);
        let earliest = TIME_END_US / 2;
        let mut held = Held::default();
        assert!(held.add(&[first]));
        for bad in [
            event(earliest + TIME_END_US, 0, 0),
            event(earliest - 1, 0, 0),
            event(TIME_END_US, 640, 0),
            event(TIME_END_US, 0, 480),
        ] {
            assert!(!held.add(&[first, bad]));
        }
        assert_eq!(held.packed.len(), 1);
        assert!(held.add(&[
            event(earliest, 0, 0),
            event(earliest + TIME_END_US - 1, 0, 0)
        ]));
    }
}
