//! The expected events of every region without a touch: the idle rate, which adapts slowly, and the fading of the last release.

use crate::log_table::{OCTAVE, whole_steps};
use crate::model::{TAIL_BIN, TouchModel};
use crate::regions::{REGIONS, opposite};
use crate::slots::SlotCounts;

/// Fractional bits of a rate in events per slot.
const BITS: u32 = 40;
/// Idle slots between two corrections of the rates: 0.5 s.
const BLOCK: u32 = 1024;
/// A correction moves a rate by 2^-6 of what is missing, or less: it takes half a minute,
const SHIFT: u32 = 6;
/// and at least this many expected events, so that a rate is never taken from a few.
const LEAST_EVENTS: u64 = 64;
/// Slots between two evaluations of the fading release: 8 ms.
const FADE_SLOTS: u32 = 16;
/// Events after which the fading of a region is as much its own as the mean of all.
const FADING_PRIOR: f64 = 4.0;
/// Lowest rate of a region, events per slot times 2^40: one event in six days.
const LEAST: i64 = 1 << 10;

/// A region after a release.
#[derive(Debug, Clone, Copy)]
struct Fading {
    region: u16,
    /// Events of the press in its block of pixels.
    pressed: u32,
    /// Mean fading since the release, events.
    expected: f64,
}

/// One camera.
#[derive(Debug, Clone)]
struct CameraRates {
    /// Idle rate, events per slot times 2^40.
    idle: Vec<i64>,
    /// Events since the last correction.
    counted: Vec<u32>,
    /// Regions that fade.
    fading: Vec<Fading>,
    /// Events since the release.
    seen: Vec<u32>,
    /// Expected events per slot, as steps of a ratio.
    steps: Vec<i32>,
}

/// Both cameras.
#[derive(Debug, Clone)]
pub(crate) struct Background {
    cameras: [CameraRates; 2],
    /// Idle slots since the last correction.
    idle_slots: u32,
    /// Slots since the release; `None` if nothing fades.
    released: Option<u32>,
    tail: Vec<[f64; 2]>,
}

fn fixed(per_slot: f64) -> i64 {
    ((per_slot * (1u64 << BITS) as f64) as i64).max(LEAST)
}

fn steps_of(fixed: i64) -> i32 {
    whole_steps(fixed.max(LEAST) as u64) - BITS as i32 * OCTAVE
}

impl CameraRates {
    fn new(idle: &[f64]) -> Self {
        let idle: Vec<i64> = idle.iter().map(|rate| fixed(*rate)).collect();
        Self {
            steps: idle.iter().map(|rate| steps_of(*rate)).collect(),
            counted: vec![0; REGIONS],
            fading: Vec::with_capacity(REGIONS),
            seen: vec![0; REGIONS],
            idle,
        }
    }

    /// Events of a region above those that are idle in so many slots.
    fn excess(&self, region: usize, events: u32, slots: i64) -> i128 {
        let idle = (i128::from(self.idle[region]) * i128::from(slots)) >> BITS;
        i128::from(events) - idle
    }

    fn correct(&mut self) {
        for ((rate, counted), steps) in self
            .idle
            .iter_mut()
            .zip(&mut self.counted)
            .zip(&mut self.steps)
        {
            let seen = (i64::from(*counted) << BITS) / i64::from(BLOCK);
            // Blocks until the least number of events is expected.
            let blocks = (LEAST_EVENTS << BITS) / (*rate as u64 * u64::from(BLOCK)).max(1);
            let shift = SHIFT
                .max(blocks.checked_ilog2().map_or(0, |l| l + 1))
                .min(40);
            *rate = (*rate + ((seen - *rate) >> shift)).max(LEAST);
            *steps = steps_of(*rate);
            *counted = 0;
        }
    }

    /// Expects the fading of the next slots, of which `share` is the mean for a press of one event: the mean, times what the
    /// events since the release say about this press (a gamma distribution before them, and after).
    fn fade(&mut self, [off, on]: [f64; 2], slots: u32) {
        for fading in &mut self.fading {
            let region = usize::from(fading.region);
            let share = if region & 1 == 1 { on } else { off };
            let mean = share * f64::from(fading.pressed);
            let idle = self.idle[region] as f64 / (1u64 << BITS) as f64 * f64::from(slots);
            let seen = (f64::from(self.seen[region]) - idle).max(0.0);
            let own = (FADING_PRIOR + seen) / (FADING_PRIOR + fading.expected);
            let more = (mean * own * (1u64 << BITS) as f64) as i64;
            self.steps[region] = steps_of(self.idle[region].saturating_add(more));
            fading.expected += mean * f64::from(FADE_SLOTS);
        }
    }
}

impl Background {
    pub(crate) fn new(model: &TouchModel) -> Self {
        Self {
            cameras: [0, 1].map(|k| CameraRates::new(model.idle_of_regions(k))),
            idle_slots: 0,
            released: None,
            tail: model.tail.clone(),
        }
    }

    /// Expected events per slot of a region, as steps of a ratio.
    pub(crate) fn steps(&self, camera: usize, region: usize) -> i32 {
        self.cameras[camera].steps[region]
    }

    /// Events of a region above those that are idle in so many slots; 0 for fewer.
    pub(crate) fn excess(&self, camera: usize, region: usize, events: u32, slots: i64) -> u32 {
        let excess = self.cameras[camera].excess(region, events, slots);
        excess.clamp(0, i128::from(u32::MAX)) as u32
    }

    /// Starts to fade after a press of `slots` slots with these events per region.
    pub(crate) fn release(&mut self, pressed: [&[u32]; 2], slots: i64) {
        for (camera, pressed) in self.cameras.iter_mut().zip(pressed) {
            for (region, steps) in camera.steps.iter_mut().enumerate() {
                *steps = steps_of(camera.idle[region]);
            }
            camera.fading.clear();
            camera.seen.fill(0);
            for region in 0..REGIONS {
                let of_touch = |region: usize| camera.excess(region, pressed[region], slots);
                let both = of_touch(region) + of_touch(opposite(region));
                if let Ok(both @ 1..) = u32::try_from(both) {
                    camera.fading.push(Fading {
                        region: region as u16,
                        pressed: both,
                        expected: 0.0,
                    });
                }
            }
        }
        self.released = Some(0);
        self.fade(0);
    }

    fn fade(&mut self, slots: u32) {
        let bin = (slots / TAIL_BIN) as usize;
        let share = self.tail.get(bin).copied().unwrap_or_default();
        for camera in &mut self.cameras {
            camera.fade(share, slots);
        }
    }

    /// Ends a slot without a touch.
    pub(crate) fn idle_slot(&mut self, counts: [&SlotCounts; 2]) {
        if let Some(slots) = &mut self.released {
            for (camera, counts) in self.cameras.iter_mut().zip(counts) {
                for (region, count) in counts.iter() {
                    camera.seen[region] += u32::from(count);
                }
            }
            *slots += 1;
            let slots = *slots;
            if slots >= TAIL_BIN * self.tail.len() as u32 {
                self.released = None;
            }
            if slots.is_multiple_of(FADE_SLOTS) {
                self.fade(slots);
            }
            return;
        }
        for (camera, counts) in self.cameras.iter_mut().zip(counts) {
            for (region, count) in counts.iter() {
                camera.counted[region] += u32::from(count);
            }
        }
        self.idle_slots += 1;
        if self.idle_slots == BLOCK {
            self.idle_slots = 0;
            self.cameras.iter_mut().for_each(CameraRates::correct);
        }
    }
}
