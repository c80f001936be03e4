//! Execution of one press: down to the surface, to depth, hold and back up, with all phase times measured.

use skinrig_model::{HostTime, PressFault, RunFault};
use skinrig_protocol::Surface;
use skinrig_protocol::plan::PressStep;

use super::Executor;
use super::feel::Braked;
use super::search::Probe;
use crate::camera_streams::ReadMode;
use crate::error::Halt;
use crate::journal::was_rejected;
use crate::open_press::OpenPress;
use crate::press_tracker::PressTracker;
use crate::verdict::judge;

impl Executor<'_> {
    /// Executes one press. A harmless failure makes the press invalid and the run continues, after an immediate
    /// retake where that may succeed.
    pub(super) fn press(&mut self, step: &PressStep) -> Result<(), Halt> {
        if let Some(after) = step.start_after_begin {
            self.wait_at_clearance(self.series.due(after))?;
        }
        let mut retake = self.attempt_press(step)?;
        let first_ended = self.now();
        let mut retakes = 0;
        while retake && self.series.may_retake(retakes) {
            self.safe_point()?;
            retakes += 1;
            self.series.count_retake();
            retake = self.attempt_press(step)?;
        }
        // Retakes do not shorten the time until the next press.
        self.series.delay(self.now() - first_ended);
        Ok(self.series.end_press()?)
    }

    /// Makes one attempt at a press. Returns whether to repeat it.
    fn attempt_press(&mut self, step: &PressStep) -> Result<bool, Halt> {
        let attempt = self.journal.next_attempt(step.press);
        let t = self.now();
        self.journal.intent(attempt, t)?;
        self.trackers.begin_press(OpenPress::new(attempt, step, t));
        // A durable intent may take a while: update the pose before moving.
        self.observe()?;
        let fault = self.press_motion(step)?;
        self.await_streams()?;
        Ok(self.close_press(fault)?)
    }

    /// The motion of a press. Returns the fault if it is invalid although the tip is back at clearance height.
    fn press_motion(&mut self, step: &PressStep) -> Result<Option<PressFault>, Halt> {
        let began = self.now();
        if let Surface::Touch(search) = step.surface {
            self.machine.set_interruptible(true);
            let tared = self.tare(Probe::of(step), search);
            let tared = tared.map(|t| t.err().map(PressFault::Touch));
            if let Some(fault) = self.unless_paused(tared)? {
                return Ok(Some(fault)); // still at clearance height
            }
        }
        let start = self.indenter.position();
        let first_stop_mm = match step.surface {
            Surface::Known => 0.0,
            Surface::Touch(search) => search.band_mm,
        };
        let first_stop = step.at.at_height(first_stop_mm);
        let down = match self.command_when_steady(first_stop, step.approach_speed_mm_s)? {
            Ok(t) => t,
            Err(off_target) => return Err(off_target.not_arrived(&step.press.to_string()).into()),
        };
        // With a tare, the deadline counts from the tare.
        let deadline = match step.surface {
            Surface::Known => down + step.deadline,
            Surface::Touch(_) => began + step.deadline,
        };
        let mut tracker = PressTracker::new(step.at, step.depth_mm, &self.plan.limits, down, start);
        if !step.surface.is_known() {
            tracker.search_surface();
        }
        if let Some(press) = self.trackers.press_mut() {
            press.track(tracker);
        }
        self.machine.set_interruptible(true);
        let went = self.go_down(step, down, deadline);
        let fault = self.unless_paused(went)?;
        self.trackers.stop_settling(); // left over from an interrupted search

        // Straight up from wherever the hold ended.
        let at_clearance = step.at.at_height(self.plan.limits.clearance_mm);
        let target = self.indenter.point_above().unwrap_or(at_clearance);
        let up = self.command(target, step.retract_speed_mm_s)?;
        self.lifted(up)?;
        if let Some(phases) = self.trackers.phases_mut() {
            phases.rise_to(target, up);
        }
        let height = self.plan.limits.clearance_mm + step.depth_mm;
        let (_, grace) = self.own_motion(height);
        let slow = height / step.retract_speed_mm_s;
        let allowed = grace + skinrig_model::HostDuration::from_secs_f64(2.0 * slow);
        if !self.until(|t| t.clear().is_some(), deadline.max(up + allowed))? {
            let what = format!("{}, retraction", step.press);
            return Err(self.not_arrived(&what, target, allowed).into());
        }
        while !self.trigger.is_free(self.now()) {
            self.tick(Some(self.trigger.free_at()))?;
        }
        let clear = self.trackers.phases().and_then(PressTracker::clear);
        Ok(fault.or_else(|| {
            let clear = clear.filter(|clear| *clear > deadline)?;
            Some(PressFault::ClearLate {
                allowed: step.deadline,
                found: clear - down,
            })
        }))
    }

    /// Result of a part of the press, with `pause_now` turned into a fault.
    fn unless_paused(
        &mut self,
        part: Result<Option<PressFault>, Halt>,
    ) -> Result<Option<PressFault>, Halt> {
        self.machine.set_interruptible(false);
        match part {
            Err(Halt::PausedNow) => {
                let suspension = self.suspender.current();
                Ok(Some(
                    suspension.map_or(PressFault::Paused, PressFault::Suspended),
                ))
            }
            other => other,
        }
    }

    /// Goes down, settles and holds. Returns the fault if something did not happen in time.
    fn go_down(
        &mut self,
        step: &PressStep,
        down: HostTime,
        deadline: HostTime,
    ) -> Result<Option<PressFault>, Halt> {
        let late = |executor: &Self, what: &str, z_mm: f64| {
            let target = step.at.at_height(z_mm);
            Some(PressFault::MotionLate(executor.not_arrived(
                what,
                target,
                step.deadline,
            )))
        };
        let surface_mm = match step.surface {
            Surface::Known if self.until(PressTracker::at_surface, deadline)? => 0.0,
            Surface::Known => return Ok(late(self, "approach", 0.0)),
            Surface::Touch(search) => {
                match self.find_surface(Probe::of(step), search, down, deadline)? {
                    Ok(found) => {
                        if let Some(phases) = self.trackers.phases_mut() {
                            phases.touched(&found);
                        }
                        found.measured.z_mm
                    }
                    Err(fault) => return Ok(Some(PressFault::Touch(fault))),
                }
            }
        };
        let bottom_mm = surface_mm - step.depth_mm;
        let depth = step.at.at_height(bottom_mm);
        let t = match self.command_when_steady(depth, step.indent_speed_mm_s)? {
            Ok(t) => t,
            Err(off_target) => return Ok(Some(off_target.fault())),
        };
        if let Some(phases) = self.trackers.phases_mut() {
            phases.indent_from(t);
        }
        let braked = match self.descend(step, t, bottom_mm, deadline)? {
            Ok(braked) => braked,
            Err(fault) => return Ok(Some(fault)),
        };
        let settled = self.trackers.phases().and_then(PressTracker::at_depth);
        let until = settled.unwrap_or(t) + step.hold;
        while self.now() < until {
            self.tick(Some(until))?;
            if let Some(touch) = self.lifts(step, t, braked) {
                self.lift_for(touch);
                break;
            }
        }
        Ok(None)
    }

    /// Waits until the tip has settled at its depth, or where it came to rest because the press was felt. `from` is the time of the
    /// command. Returns why it braked, if it did, or the fault if it did not settle in time.
    fn descend(
        &mut self,
        step: &PressStep,
        from: HostTime,
        bottom_mm: f64,
        deadline: HostTime,
    ) -> Result<Result<Option<Braked>, PressFault>, Halt> {
        let mut braked = None;
        loop {
            let phases = self.trackers.phases();
            if let Some(rests) = phases.filter(|t| t.at_depth().is_some()) {
                let depth_mm = rests.depth_mm();
                if let Some(braked) = braked {
                    self.rests_at(step, braked, depth_mm);
                }
                return Ok(Ok(braked));
            }
            if self.now() >= deadline {
                let target = step.at.at_height(bottom_mm);
                let late = self.not_arrived("indentation", target, step.deadline);
                return Ok(Err(PressFault::MotionLate(late)));
            }
            match self.reacts_going_down(step, from) {
                Some(touch) if braked.is_none() && phases.is_some_and(PressTracker::goes_down) => {
                    braked = Some(self.brake(touch)?);
                }
                _ => self.tick(Some(deadline))?,
            }
        }
    }

    /// Ticks until the condition on the tracker holds; false if `deadline` passed first.
    fn until(
        &mut self,
        done: impl Fn(&PressTracker) -> bool,
        deadline: HostTime,
    ) -> Result<bool, Halt> {
        loop {
            if self.trackers.phases().is_some_and(&done) {
                return Ok(true);
            }
            if self.now() >= deadline {
                return Ok(false);
            }
            self.tick(Some(deadline))?;
        }
    }

    /// Emits all bytes and poses so far, then the outcome. Returns whether to repeat the press.
    pub(super) fn close_press(&mut self, fault: Option<PressFault>) -> Result<bool, RunFault> {
        let flushed = self.observe().and(self.collect(ReadMode::Flush));
        if self.journal.is_ending() {
            if let Err(e) = flushed {
                self.journal.problem("", e);
            }
        } else {
            flushed?;
        }
        self.journal.emit_poses()?;
        self.check_event_rate();
        let Some(press) = self.trackers.press() else {
            return Ok(false);
        };
        let judged = judge(press, fault);
        let retake = judged.should_retake();
        self.series.end_attempt(press.attempt(), judged.faults);
        let recorded = self.journal.outcome(judged.outcome);
        if !was_rejected(&recorded) {
            self.trackers.end_press();
        }
        recorded?;
        Ok(retake)
    }
}
