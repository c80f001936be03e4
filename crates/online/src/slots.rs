//! Joins the events of both cameras: counts per region and slot of common time, each slot handed over once, in order.
//!
//! A slot is complete when both cameras have sent something later. A camera may lead by [`LEAD`] slots; then its events are
//! refused until the other follows, so that memory is bounded. Which events a slot holds depends on the two streams alone,
//! not on how they are cut into slices or interleaved.

use skinrig_model::{CameraId, CdEvent};

use crate::clock::ClockLine;
use crate::regions::{REGIONS, region};

/// Slots by which a camera may lead the other: 128 ms.
pub(crate) const LEAD: usize = 256;

/// Events of one camera in one slot.
#[derive(Debug, Clone)]
pub(crate) struct SlotCounts {
    counts: Box<[u16; REGIONS]>,
    filled: Vec<u16>,
    events: u32,
}

impl SlotCounts {
    pub(crate) fn new() -> Self {
        Self {
            counts: Box::new([0; REGIONS]),
            filled: Vec::with_capacity(REGIONS),
            events: 0,
        }
    }

    pub(crate) fn add(&mut self, region: usize) {
        let count = &mut self.counts[region];
        if *count == 0 {
            self.filled.push(region as u16);
        }
        *count = count.saturating_add(1);
        self.events += 1;
    }

    fn clear(&mut self) {
        for region in self.filled.drain(..) {
            self.counts[usize::from(region)] = 0;
        }
        self.events = 0;
    }

    /// Regions with events, in order of their first one, and how many.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, u16)> + '_ {
        let filled = self.filled.iter().map(|r| usize::from(*r));
        filled.map(|r| (r, self.counts[r]))
    }

    /// Events of both polarities in all regions.
    pub(crate) const fn events(&self) -> u32 {
        self.events
    }
}

/// Events that did not count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Uncounted {
    /// Before the first slot.
    pub early: u64,
    /// In a slot earlier than that of an event already seen of the same camera.
    pub late: u64,
    /// Outside the sensor.
    pub off_sensor: u64,
}

/// Slots of one camera.
#[derive(Debug, Clone)]
struct CameraSlots {
    line: ClockLine,
    ring: Vec<SlotCounts>,
    /// Slot of the newest event or promise.
    open: i64,
    /// Camera times of that slot, half-open, µs.
    open_us: (u64, u64),
    uncounted: Uncounted,
}

impl CameraSlots {
    fn new(line: ClockLine, first: i64) -> Self {
        Self {
            line,
            ring: vec![SlotCounts::new(); LEAD],
            open: first,
            open_us: (line.start_us(first), line.start_us(first + 1)),
            uncounted: Uncounted::default(),
        }
    }

    fn counts(&mut self, slot: i64) -> &mut SlotCounts {
        &mut self.ring[slot.rem_euclid(LEAD as i64) as usize]
    }

    /// Moves on to the slot of `t_us`; false if that is `limit` or later.
    fn reach(&mut self, t_us: u64, limit: i64) -> bool {
        let slot = self.line.slot(t_us);
        if slot >= limit {
            return false;
        }
        self.open = slot;
        self.open_us = (self.line.start_us(slot), self.line.start_us(slot + 1));
        true
    }

    fn add(&mut self, event: &CdEvent) {
        match region(event) {
            Some(region) => {
                let open = self.open;
                self.counts(open).add(region);
            }
            None => self.uncounted.off_sensor += 1,
        }
    }
}

/// Both cameras.
#[derive(Debug, Clone)]
pub(crate) struct Slots {
    cameras: [CameraSlots; 2],
    first: i64,
    /// The next slot to hand over.
    next: i64,
}

impl Slots {
    /// Slots from `first` on.
    pub(crate) fn new(lines: [ClockLine; 2], first: i64) -> Self {
        Self {
            cameras: lines.map(|line| CameraSlots::new(line, first)),
            first,
            next: first,
        }
    }

    /// Counts events of a camera until it leads by [`LEAD`]; returns how many it took.
    pub(crate) fn take(&mut self, camera: CameraId, events: &[CdEvent]) -> usize {
        let (first, limit) = (self.first, self.next + LEAD as i64);
        let own = &mut self.cameras[camera.index()];
        for (taken, event) in events.iter().enumerate() {
            let t_us = event.t_us;
            if t_us >= own.open_us.1 {
                if !own.reach(t_us, limit) {
                    return taken;
                }
            } else if t_us < own.open_us.0 {
                let early = own.line.slot(t_us) < first;
                let uncounted = &mut own.uncounted;
                *(if early {
                    &mut uncounted.early
                } else {
                    &mut uncounted.late
                }) += 1;
                continue;
            }
            own.add(event);
        }
        events.len()
    }

    /// The camera has sent all events before `t_us`. What would lead too far is kept for later promises.
    pub(crate) fn promise(&mut self, camera: CameraId, t_us: u64) {
        let limit = self.next + LEAD as i64;
        let own = &mut self.cameras[camera.index()];
        if t_us >= own.open_us.1 && !own.reach(t_us, limit) {
            own.reach(own.line.start_us(limit - 1), limit);
        }
    }

    /// Passes every complete slot to `each`.
    pub(crate) fn close(&mut self, each: impl FnMut(i64, [&SlotCounts; 2])) {
        let [one, two] = &self.cameras;
        self.close_until(one.open.min(two.open), each);
    }

    /// Passes every slot that has begun to `each`.
    pub(crate) fn finish(&mut self, each: impl FnMut(i64, [&SlotCounts; 2])) {
        let [one, two] = &self.cameras;
        self.close_until(one.open.max(two.open) + 1, each);
    }

    fn close_until(&mut self, end: i64, mut each: impl FnMut(i64, [&SlotCounts; 2])) {
        while self.next < end {
            let at = self.next.rem_euclid(LEAD as i64) as usize;
            let [one, two] = &mut self.cameras;
            each(self.next, [&one.ring[at], &two.ring[at]]);
            one.ring[at].clear();
            two.ring[at].clear();
            self.next += 1;
        }
    }

    /// The next slot to hand over.
    pub(crate) const fn next(&self) -> i64 {
        self.next
    }

    /// Start of a slot in each camera's time, µs.
    pub(crate) fn start_us(&self, slot: i64) -> [u64; 2] {
        [0, 1].map(|k| self.cameras[k].line.start_us(slot))
    }

    /// Events of each camera that did not count.
    pub(crate) fn uncounted(&self) -> [Uncounted; 2] {
        [0, 1].map(|k| self.cameras[k].uncounted)
    }
}
