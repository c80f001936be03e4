//! The detector: events of both cameras in, touches felt out.

use serde::Serialize;
use skinrig_analysis::result::ClockFit;
use skinrig_model::{CameraId, CdEvent};

use crate::background::Background;
use crate::bank::{Bank, Best};
use crate::clock::{ClockLine, SLOT_US};
use crate::log_table::{fixed, nats};
use crate::model::TouchModel;
use crate::slots::{SlotCounts, Slots, Uncounted};
use crate::touch::{Phase, Touch};

/// Kind of a decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Felt {
    /// A touch began.
    Onset,
    /// The onset was false: its evidence vanished before it was certain, or the motion was a release.
    Withdrawn,
    /// The touch ended.
    Release,
}

/// A decision.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Detection {
    /// Its kind.
    pub felt: Felt,
    /// Host time up to which its events arrived, µs: the earliest time at which it can be known.
    pub host_us: i64,
    /// Host time from which the evidence counts, µs.
    pub since_us: i64,
    /// Log likelihood ratio against the background, nats.
    pub llr: f64,
    /// Most likely of the places learnt, mm.
    pub near_mm: [f64; 2],
}

/// A clock that gives no common time.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "{camera}: expected a clock fit with a positive rate, found offset {offset_us} µs, drift {drift_ppm} ppm"
)]
pub struct UnusableClock {
    /// Camera.
    pub camera: CameraId,
    /// Offset of its fit, µs.
    pub offset_us: f64,
    /// Drift of its fit, ppm.
    pub drift_ppm: f64,
}

/// Detects touches in the events of both cameras.
///
/// Its decisions depend on the events and their order in each camera's stream alone: any slicing and interleaving gives
/// bit-identical ones. Memory is constant.
#[derive(Debug, Clone)]
pub struct Detector {
    slots: Slots,
    core: Core,
}

pub(crate) fn lines(clocks: &[ClockFit; 2]) -> Result<[ClockLine; 2], UnusableClock> {
    let line = |camera: CameraId| {
        let fit = &clocks[camera.index()];
        ClockLine::new(fit).ok_or(UnusableClock {
            camera,
            offset_us: fit.offset_us,
            drift_ppm: fit.drift_ppm,
        })
    };
    Ok([line(CameraId::One)?, line(CameraId::Two)?])
}

impl Detector {
    /// A detector on an idle skin, for events from host time `from_us` on; it detects at `threshold` nats.
    ///
    /// # Errors
    /// [`UnusableClock`] if the cameras have no common time.
    pub fn new(
        model: &TouchModel,
        clocks: &[ClockFit; 2],
        threshold: f64,
        from_us: i64,
    ) -> Result<Self, UnusableClock> {
        Ok(Self {
            slots: Slots::new(lines(clocks)?, from_us.div_euclid(SLOT_US)),
            core: Core::new(model, threshold),
        })
    }

    /// Takes the next events of a camera and passes every new decision to `each`; returns how many events it took. It takes
    /// fewer than all only if this camera leads the other by 128 ms: bring the rest after the other camera's.
    pub fn push(
        &mut self,
        camera: CameraId,
        events: &[CdEvent],
        mut each: impl FnMut(Detection),
    ) -> usize {
        let mut taken = 0;
        loop {
            let more = self.slots.take(camera, &events[taken..]);
            taken += more;
            let core = &mut self.core;
            self.slots
                .close(|slot, counts| core.slot(slot, counts, &mut each));
            if taken == events.len() || more == 0 {
                return taken;
            }
        }
    }

    /// Notes that all events of a camera before `t_us` have been pushed, as far as it does not lead the other by 128 ms then: so
    /// a camera without events delays no decision.
    pub fn promise(&mut self, camera: CameraId, t_us: u64, mut each: impl FnMut(Detection)) {
        self.slots.promise(camera, t_us);
        let core = &mut self.core;
        self.slots
            .close(|slot, counts| core.slot(slot, counts, &mut each));
    }

    /// Ends the streams: evaluates the slots that are still open.
    pub fn finish(&mut self, mut each: impl FnMut(Detection)) {
        let core = &mut self.core;
        self.slots
            .finish(|slot, counts| core.slot(slot, counts, &mut each));
    }

    /// Host time until which all events are evaluated, µs.
    #[must_use]
    pub const fn now_us(&self) -> i64 {
        self.slots.next() * SLOT_US
    }

    /// Camera times at the start of the slot that holds a host time, µs.
    pub(crate) fn camera_us(&self, host_us: i64) -> [u64; 2] {
        self.slots.start_us(host_us.div_euclid(SLOT_US))
    }

    /// Events of each camera that did not count.
    #[must_use]
    pub fn uncounted(&self) -> [Uncounted; 2] {
        self.slots.uncounted()
    }
}

/// The detector behind the slots.
#[derive(Debug, Clone)]
pub(crate) struct Core {
    pub(crate) background: Background,
    pub(crate) bank: Bank,
    pub(crate) touch: Touch,
    places: Vec<[f64; 2]>,
    threshold: i64,
    /// Slots after which an uncertain touch is none.
    longest_press: i64,
    touching: bool,
    /// Evidence of the touch that is not certain yet.
    onset: Option<Best>,
}

/// A touch is certain at this multiple of the threshold,
const CERTAIN: i64 = 3;
/// and withdrawn if its evidence falls to one in this many before.
const WITHDRAWN: i64 = 4;

impl Core {
    pub(crate) fn new(model: &TouchModel, threshold: f64) -> Self {
        Self {
            background: Background::new(model),
            bank: Bank::new(model),
            touch: Touch::new(model),
            places: model.patterns.iter().map(|p| p.at).collect(),
            threshold: fixed(threshold).max(1),
            longest_press: model.longest_press,
            touching: false,
            onset: None,
        }
    }

    /// Ends a slot.
    pub(crate) fn slot(
        &mut self,
        slot: i64,
        counts: [&SlotCounts; 2],
        each: &mut impl FnMut(Detection),
    ) {
        if self.touching {
            return self.touched(slot, counts, each);
        }
        let pending = self.onset.is_some();
        let best = self.bank.add(slot, counts, &self.background, pending);
        match self.onset {
            None => {
                self.background.idle_slot(counts);
                if best.sum >= self.threshold {
                    self.onset = Some(best);
                    self.touch.begin(slot);
                    self.touch.count(counts);
                    each(self.detection(Felt::Onset, slot, best));
                }
            }
            Some(_) => {
                self.touch.count(counts);
                if best.sum >= CERTAIN * self.threshold {
                    self.touching = true;
                    self.onset = Some(best);
                } else if best.sum < self.threshold / WITHDRAWN
                    || slot - self.touch.begun() > self.longest_press
                {
                    // Few events add up to nothing certain for as long as a press lasts: another one may come.
                    self.onset = None;
                    self.bank.restart();
                    each(self.detection(Felt::Withdrawn, slot, best));
                }
            }
        }
    }

    fn touched(&mut self, slot: i64, counts: [&SlotCounts; 2], each: &mut impl FnMut(Detection)) {
        self.touch.count(counts);
        let before = self.touch.stage();
        let phase = self.touch.phase(slot);
        let rests = (before, phase) == (Phase::Pressing, Phase::Holding);
        // A release that is taken for a touch would last until the next press, and hide it, and so on.
        let was_release = rests && self.release_odds(slot) >= self.threshold;
        if was_release || phase == Phase::Over {
            let felt = if was_release {
                Felt::Withdrawn
            } else {
                Felt::Release
            };
            let known = self.onset.take();
            let best = known.unwrap_or(Best {
                sum: 0,
                place: 0,
                since: slot,
            });
            each(self.detection(felt, slot, best));
            self.release(slot);
        }
    }

    /// Odds that the motion so far was a release, 2^-20 nats.
    fn release_odds(&mut self, slot: i64) -> i64 {
        let (background, pressed) = (&self.background, self.touch.pressed());
        let slots = slot - self.touch.begun() + 1;
        let excess = |k: usize, r: usize| background.excess(k, r, pressed[k][r], slots);
        self.bank.release_odds(excess)
    }

    /// Returns to an idle skin, on which the press counted so far fades.
    pub(crate) fn release(&mut self, slot: i64) {
        self.touching = false;
        self.onset = None;
        self.background
            .release(self.touch.pressed(), slot - self.touch.begun());
        self.bank.restart();
    }

    fn detection(&self, felt: Felt, slot: i64, best: Best) -> Detection {
        Detection {
            felt,
            host_us: (slot + 1) * SLOT_US,
            since_us: best.since * SLOT_US,
            llr: nats(best.sum),
            near_mm: self.places.get(best.place).copied().unwrap_or_default(),
        }
    }
}
