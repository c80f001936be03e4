//! The course of a touch: events of the press per region, and when its motion ends, begins again and ends for good.

use crate::model::TouchModel;
use crate::regions::REGIONS;
use crate::slots::SlotCounts;

/// Slots over which motion is judged: 20 ms.
const WINDOW: usize = 40;
/// The tip rests when a window holds less than this part of the events of the press's busiest window,
const QUIET: u32 = 8;
/// and moves again when it holds more than this part, and twice the rest.
const BUSY: u32 = 5;

/// Phase of a touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Phase {
    /// The tip goes in.
    Pressing,
    /// The tip rests.
    Holding,
    /// The tip rises.
    Lifting,
    /// The tip has left.
    Over,
}

#[derive(Debug, Clone)]
pub(crate) struct Touch {
    begun: i64,
    longest: i64,
    phase: Phase,
    pressed: [Vec<u32>; 2],
    /// Expected idle events in a window.
    idle: u32,
    window: [u32; WINDOW],
    at: usize,
    sum: u32,
    busiest: u32,
    resting: u32,
}

impl Touch {
    pub(crate) fn new(model: &TouchModel) -> Self {
        let idle: f64 = model.idle.iter().flatten().sum();
        Self {
            begun: 0,
            // A touch somewhat longer than any learnt press is possible. One taken up at a release would otherwise last until the next
            // press, whose release is taken for a touch again, and so on.
            longest: model.longest_press + model.longest_press / 2,
            phase: Phase::Over,
            pressed: [vec![0; REGIONS], vec![0; REGIONS]],
            idle: (idle * WINDOW as f64) as u32,
            window: [0; WINDOW],
            at: 0,
            sum: 0,
            busiest: 0,
            resting: 0,
        }
    }

    /// Begins a touch.
    pub(crate) fn begin(&mut self, slot: i64) {
        self.begun = slot;
        self.phase = Phase::Pressing;
        for pressed in &mut self.pressed {
            pressed.fill(0);
        }
        self.window.fill(self.idle / WINDOW as u32);
        self.sum = self.window.iter().sum();
        (self.busiest, self.resting) = (0, 0);
    }

    /// Counts the events of a slot.
    pub(crate) fn count(&mut self, counts: [&SlotCounts; 2]) {
        let mut events = 0;
        for (pressed, counts) in self.pressed.iter_mut().zip(counts) {
            for (region, count) in counts.iter() {
                pressed[region] = pressed[region].saturating_add(u32::from(count));
            }
            events += counts.events();
        }
        self.sum = self.sum - self.window[self.at] + events;
        self.window[self.at] = events;
        self.at = (self.at + 1) % WINDOW;
    }

    /// Slot in which it began.
    pub(crate) const fn begun(&self) -> i64 {
        self.begun
    }

    /// Events of the press in each camera's regions.
    pub(crate) fn pressed(&self) -> [&[u32]; 2] {
        [&self.pressed[0], &self.pressed[1]]
    }

    /// Where the touch stood after the slot before.
    pub(crate) const fn stage(&self) -> Phase {
        self.phase
    }

    /// Where the touch stands after this slot.
    pub(crate) fn phase(&mut self, slot: i64) -> Phase {
        let moving = self.sum.saturating_sub(self.idle);
        let quiet = moving * QUIET < self.busiest;
        match self.phase {
            Phase::Pressing => {
                self.busiest = self.busiest.max(moving);
                if quiet {
                    self.phase = Phase::Holding;
                    self.resting = moving;
                }
            }
            Phase::Holding => {
                self.resting = self.resting.min(moving);
                if moving * BUSY > self.busiest && moving > 2 * self.resting {
                    self.phase = Phase::Lifting;
                }
            }
            Phase::Lifting if quiet => self.phase = Phase::Over,
            Phase::Lifting | Phase::Over => {}
        }
        if slot - self.begun > self.longest {
            self.phase = Phase::Over;
        }
        self.phase
    }
}
