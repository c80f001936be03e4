//! Touches felt while the run records: feeds the sense, records its answers, and lets a press react to them.

use skinrig_model::{CameraId, HostTime, Reaction, Record, RunFault, TouchEstimate};
use skinrig_protocol::React;
use skinrig_protocol::plan::{PressStep, Step};

use super::Executor;
use crate::open_press::OpenPress;
use crate::touch_sense::{SenseAnswer, SensedTouch};

/// Why a press braked on its way down.
#[derive(Clone, Copy)]
pub(super) struct Braked {
    touch: SensedTouch,
    /// Depth that it was felt to have reached, the set point's lead over it included, mm.
    reached_mm: Option<f64>,
}

impl Executor<'_> {
    /// Starts to learn. The plan of a leg that starts in the middle has no such step.
    pub(super) fn begin_learning(&mut self) -> Result<(), RunFault> {
        if !self.feeling.sense.is_on() {
            let text = "touches are not felt: only a run from the first press on can learn to";
            return self.journal.note(self.now(), text.to_owned());
        }
        self.feeling.learning = true;
        self.feeling.sense.learn();
        self.take_answers()
    }

    /// Adds a note at the start of a leg that cannot feel touches although the plan asks for it.
    pub(super) fn note_without_sense(&mut self) -> Result<(), RunFault> {
        let mut steps = self.plan.steps.iter();
        if self.plan.online.is_none() || steps.any(|step| matches!(step, Step::Learn)) {
            return Ok(());
        }
        let text = "touches are not felt in this leg: it does not repeat the presses that it would learn from";
        self.journal.note(self.now(), text.to_owned())
    }

    /// Feeds the newest bytes and records what is felt.
    pub(super) fn feel(&mut self) -> Result<(), RunFault> {
        if !self.feeling.sense.is_on() {
            return Ok(());
        }
        if self.feeling.learning {
            for camera in CameraId::ALL {
                let fed = &mut self.feeling.fed[camera.index()];
                if let Some(open) = self.cameras.open_chunk(camera, fed.next()) {
                    fed.open(camera, &open, self.feeling.sense.as_mut());
                }
            }
        }
        self.take_answers()
    }

    fn take_answers(&mut self) -> Result<(), RunFault> {
        let t = self.now();
        while let Some(answer) = self.feeling.sense.poll(t) {
            match answer {
                SenseAnswer::Ready {
                    places,
                    has_regions,
                    has_depths,
                    has_depths_elsewhere,
                } => {
                    let mut text =
                        format!("touches are felt from now on, learnt at {places} places");
                    if !has_regions {
                        text += "; positions have no regions: the calibrating presses are too few";
                    }
                    if !has_depths {
                        text += "; touches have no depths: the depths of the calibrating presses were not measured, or they are too few";
                    } else if !has_depths_elsewhere {
                        text += "; touches away from these places have no depths: the places are too few";
                    }
                    self.journal.note(t, text)?;
                    self.record_touch(t, SensedTouch::started(t))?;
                }
                SenseAnswer::Off(fault) => {
                    self.feeling.touch = None;
                    self.journal
                        .note(t, format!("touches are not felt: {fault}"))?;
                }
                SenseAnswer::Felt(touch) => {
                    self.feeling.felt(touch);
                    self.record_touch(t, touch)?;
                }
            }
        }
        Ok(())
    }

    fn record_touch(&mut self, t: HostTime, touch: SensedTouch) -> Result<(), RunFault> {
        let attempt = self.trackers.press().map(OpenPress::attempt);
        let SensedTouch {
            until,
            until_sd_ns,
            kind,
            at_mm,
            region,
            depth,
            llr,
        } = touch;
        self.journal.emit(Record::Touch(TouchEstimate {
            t,
            until,
            until_sd_ns,
            kind,
            attempt,
            at_mm,
            region,
            depth,
            llr,
        }))
    }

    /// The touch for which the press ends its hold, if it does so and feels one that began after `since`: at once if it `braked` for it.
    pub(super) fn lifts(
        &self,
        step: &PressStep,
        since: HostTime,
        braked: Option<Braked>,
    ) -> Option<SensedTouch> {
        let react = step.react.filter(|react| react.then == Reaction::Lift)?;
        let Some(braked) = braked else {
            return self.feeling.fulfilled(react, since);
        };
        let newest = self.feeling.since(since);
        Some(newest.unwrap_or(braked.touch))
    }

    /// The touch to which the press reacts on the way down, if there is one. At a stated depth a press lifts from there, too; otherwise it
    /// lifts only from its own.
    pub(super) fn reacts_going_down(
        &self,
        step: &PressStep,
        since: HostTime,
    ) -> Option<SensedTouch> {
        let early = |react: &React| react.then == Reaction::Stop || react.depth_mm.is_some();
        let react = step.react.filter(early)?;
        let overrun_mm = self.feeling.overruns.expected_mm(step.indent_speed_mm_s);
        let before_mm = self.ahead_mm() + overrun_mm;
        let depth_mm = react.depth_mm.map(|mm| mm - before_mm);
        self.feeling.fulfilled(React { depth_mm, ..react }, since)
    }

    /// How far the set point is ahead of the tip on its way down, mm: it takes the tip so much deeper.
    fn ahead_mm(&self) -> f64 {
        let found = self.indenter.position();
        let ahead_mm = found.map_or(0.0, |p| p.measured.z_mm - p.commanded.z_mm);
        ahead_mm.max(0.0)
    }

    /// Brakes the tip on its way down because of `touch`. It holds where it comes to rest: neither deeper than planned, nor going back.
    pub(super) fn brake(&mut self, touch: SensedTouch) -> Result<Braked, RunFault> {
        let reached_mm = touch.depth.map(|depth| depth.mm + self.ahead_mm());
        self.indenter.hold()?;
        let t = self.now();
        if let Some(phases) = self.trackers.phases_mut() {
            phases.brake_from(t);
        }
        // A press that lifts reacts once more, when it rises.
        let kind = Reaction::Stop.kind();
        self.record_touch(t, SensedTouch { kind, ..touch })?;
        Ok(Braked { touch, reached_mm })
    }

    /// A press that braked has come to rest at this depth: the next ones learn from it.
    pub(super) fn rests_at(&mut self, step: &PressStep, braked: Braked, depth_mm: f64) {
        if let Some(reached_mm) = braked.reached_mm {
            let overruns = &mut self.feeling.overruns;
            overruns.learn(step.indent_speed_mm_s, reached_mm, depth_mm);
        }
    }

    /// The tip will be lifted because of `touch`.
    pub(super) fn lift_for(&mut self, touch: SensedTouch) {
        self.feeling.lifting = Some(touch);
    }

    /// Records that the robot accepted at `t` to rise, if a touch was the reason.
    pub(super) fn lifted(&mut self, t: HostTime) -> Result<(), RunFault> {
        let Some(touch) = self.feeling.lifting.take() else {
            return Ok(());
        };
        let kind = Reaction::Lift.kind();
        self.record_touch(t, SensedTouch { kind, ..touch })
    }
}
