//! Owns the events around selected presses, held in memory for the studies.

use skinrig_model::{CdEvent, Polarity, PressId};

/// One event, packed into 8 bytes: time after the start of its view (32 bit, µs), polarity, row, column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct PackedEvent(u64);

impl PackedEvent {
    const ROW_SHIFT: u32 = 10;
    const POLARITY_SHIFT: u32 = 19;
    const TIME_SHIFT: u32 = 32;

    /// Packs an event of a view that starts at `start_us`; `None` for events before that, 2^32 µs or more after it, or off
    /// the sensor.
    #[must_use]
    pub fn pack(event: &CdEvent, start_us: u64) -> Option<Self> {
        let after = event.t_us.checked_sub(start_us)?;
        if after > u64::from(u32::MAX)
            || event.x >= skinrig_model::SENSOR_WIDTH
            || event.y >= skinrig_model::SENSOR_HEIGHT
        {
            return None;
        }
        let on = u64::from(event.polarity == Polarity::On);
        Some(Self(
            after << Self::TIME_SHIFT
                | on << Self::POLARITY_SHIFT
                | u64::from(event.y) << Self::ROW_SHIFT
                | u64::from(event.x),
        ))
    }

    /// Time after the start of the view, µs.
    #[must_use]
    pub const fn t_us(self) -> u32 {
        (self.0 >> Self::TIME_SHIFT) as u32
    }

    /// Column, 0..640.
    #[must_use]
    pub const fn x(self) -> u16 {
        (self.0 & 0x3ff) as u16
    }

    /// Row on the sensor, 0..480.
    #[must_use]
    pub const fn y(self) -> u16 {
        (self.0 >> Self::ROW_SHIFT & 0x1ff) as u16
    }

    /// True for an ON event.
    #[must_use]
    pub const fn is_on(self) -> bool {
        self.0 >> Self::POLARITY_SHIFT & 1 == 1
    }
}

/// Events of one camera around one press, rows of the crop only. All times are µs of camera time after `start_us`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EventView {
    /// Start of the view, camera time, µs.
    pub start_us: u64,
    /// Length of the view, µs.
    pub length_us: u32,
    /// Press window, half-open.
    pub window_us: (u32, u32),
    /// Start of the idle time before the press window; equal to the window's start if there is none.
    pub idle_from_us: u32,
    /// Measured contact.
    pub contact_us: f64,
    /// Measured release.
    pub release_us: f64,
    /// Events by time; at equal times by polarity, row and column.
    pub events: Vec<PackedEvent>,
}

impl EventView {
    /// Events of the press window.
    #[must_use]
    pub fn press_events(&self) -> &[PackedEvent] {
        self.between(self.window_us.0, self.window_us.1)
    }

    /// Events in `from_us..to_us`.
    #[must_use]
    pub fn between(&self, from_us: u32, to_us: u32) -> &[PackedEvent] {
        let at = |t: u32| self.events.partition_point(|e| e.t_us() < t);
        let (from, to) = (at(from_us), at(to_us));
        &self.events[from..to.max(from)]
    }
}

/// Presses whose events are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Retention {
    /// Up to `study_presses` scored presses.
    Scored,
    /// Up to `study_presses` scored presses and as many calibration presses.
    All,
}

/// A press of the studies.
#[derive(Debug, Clone, PartialEq)]
pub struct RetainedPress {
    /// Row in the plan.
    pub row: usize,
    /// Press.
    pub press: PressId,
    /// View of each camera.
    pub views: [EventView; 2],
}

/// Presses of the studies, in plan order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RetainedPresses {
    /// Presses.
    pub presses: Vec<RetainedPress>,
    /// Selected presses that did not fit into memory.
    pub left_out: u32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn packing_keeps_everything(after in any::<u32>(), x in 0u16..640, y in 0u16..480, on in any::<bool>()) {
            let start = (1u64 << 53) + 7;
            let polarity = Polarity::from_bit(on);
            let event = CdEvent { t_us: start + u64::from(after), x, y, polarity };
            let packed = PackedEvent::pack(&event, start).unwrap();
            prop_assert_eq!((packed.t_us(), packed.x(), packed.y(), packed.is_on()), (after, x, y, on));
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let event = |t_us, x, y| CdEvent {
            t_us,
            x,
            y,
            polarity: Polarity::On,
        };
        assert_eq!(PackedEvent::pack(&event(9, 0, 0), 10), None);
        assert_eq!(PackedEvent::pack(&event(10 + (1 << 32), 0, 0), 10), None);
        assert_eq!(PackedEvent::pack(&event(10, 640, 0), 10), None);
        assert_eq!(PackedEvent::pack(&event(10, 0, 480), 10), None);
    }
}
