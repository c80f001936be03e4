//! One press: down to the surface, to depth, hold, and back up; every moment measured.

use skinrig_model::{AttemptId, CameraId, HostTime, PressOutcome, PressTiming, PressVerdict};
use skinrig_protocol::Surface;
use skinrig_protocol::plan::PressStep;

use crate::core::{Collect, Core, OpenPress};
use crate::error::{ControllerError, Halt};
use crate::moments::PressTracker;

impl Core<'_> {
    /// Executes one press. A press that goes wrong without harm ends invalid and the run goes on.
    pub(crate) fn press(&mut self, step: &PressStep) -> Result<(), Halt> {
        if let Some(after) = step.start_after_begin {
            self.wait_at_clearance(self.begin + after)?;
        }
        let attempt = AttemptId {
            press: step.press,
            number: 1,
        };
        let t = self.now();
        self.journal.intent(attempt, t)?;
        self.open = Some(OpenPress {
            attempt,
            tracker: None,
            touch: None,
            marks: step.marks.clone(),
            lost: [0; 2],
            bytes: [0; 2],
        });
        // A durable intent may have taken a while: know the present pose before moving.
        self.observe()?;
        let trouble = self.press_motion(step)?;
        self.close_press(trouble)?;
        Ok(())
    }

    /// The motion. `Some` says why the press is invalid although the tip is back at clearance height.
    fn press_motion(&mut self, step: &PressStep) -> Result<Option<String>, Halt> {
        let began = self.now();
        if let Surface::Touch(search) = step.surface {
            self.breakable = true;
            let tared = self.tare(step, search);
            if let Some(trouble) = self.unless_paused(tared.map(Result::err))? {
                return Ok(Some(trouble)); // the tip never left clearance height
            }
        }
        let start = self.indenter.position();
        let first_stop_mm = match step.surface {
            Surface::Known => 0.0,
            Surface::Touch(search) => search.band_mm,
        };
        let down = self.command(step.at.at_height(first_stop_mm), step.approach_speed_mm_s)?;
        // The deadline of a press that tares counts from the tare on.
        let deadline = match step.surface {
            Surface::Known => down + step.deadline,
            Surface::Touch(_) => began + step.deadline,
        };
        let mut tracker = PressTracker::new(step.at, step.depth_mm, &self.plan.limits, down, start);
        if !step.surface.is_known() {
            tracker.search_surface();
        }
        self.with_open(|open| open.tracker = Some(tracker));
        self.breakable = true;
        let went = self.go_down(step, down, deadline);
        let trouble = self.unless_paused(went)?;
        self.settling = None; // a search that was broken off leaves it

        let target = step.at.at_height(self.plan.limits.clearance_mm);
        let up = self.command(target, step.retract_speed_mm_s)?;
        self.with_tracker(|t| t.rise_from(up));
        let height = self.plan.limits.clearance_mm + step.depth_mm;
        let (_, grace) = self.own_motion(height);
        let slow = height / step.retract_speed_mm_s;
        let allowed = grace + skinrig_model::HostDuration::from_secs_f64(2.0 * slow);
        if !self.until(|t| t.clear().is_some(), deadline.max(up + allowed))? {
            let what = format!("{}, retraction", step.press);
            return Err(self.not_arrived(&what, target, allowed).into());
        }
        while !self.line_is_free() {
            self.tick(Some(self.line_free_at()))?;
        }
        let clear = self.tracker().and_then(PressTracker::clear);
        Ok(trouble.or_else(|| {
            let clear = clear.filter(|clear| *clear > deadline)?;
            Some(format!(
                "expected to be back at clearance height within {}, found {}",
                step.deadline,
                clear - down
            ))
        }))
    }

    /// What became of a part of the press that `pause_now` may break off.
    fn unless_paused(
        &mut self,
        part: Result<Option<String>, Halt>,
    ) -> Result<Option<String>, Halt> {
        self.breakable = false;
        match part {
            Err(Halt::PausedNow) => Ok(Some("paused by the operator".to_owned())),
            other => other,
        }
    }

    /// Down, settle, hold. `Some` says what did not happen in time.
    fn go_down(
        &mut self,
        step: &PressStep,
        down: HostTime,
        deadline: HostTime,
    ) -> Result<Option<String>, Halt> {
        let late = |core: &Self, what: &str, z_mm: f64| {
            let target = step.at.at_height(z_mm);
            Some(core.not_arrived(what, target, step.deadline).to_string())
        };
        let surface_mm = match step.surface {
            Surface::Known if self.until(PressTracker::at_surface, deadline)? => 0.0,
            Surface::Known => return Ok(late(self, "approach", 0.0)),
            Surface::Touch(search) => match self.find_surface(step, search, down, deadline)? {
                Ok(found) => {
                    self.with_tracker(|t| t.touched(&found));
                    found.measured.z_mm
                }
                Err(trouble) => return Ok(Some(trouble)),
            },
        };
        let bottom_mm = surface_mm - step.depth_mm;
        let depth = step.at.at_height(bottom_mm);
        let t = self.command(depth, step.indent_speed_mm_s)?;
        self.with_tracker(|tracker| tracker.indent_from(t));
        if !self.until(|t| t.at_depth().is_some(), deadline)? {
            return Ok(late(self, "indentation", bottom_mm));
        }
        let settled = self.tracker().and_then(PressTracker::at_depth);
        let until = settled.unwrap_or(t) + step.hold;
        while self.now() < until {
            self.tick(Some(until))?;
        }
        Ok(None)
    }

    fn tracker(&self) -> Option<&PressTracker> {
        self.open.as_ref().and_then(|o| o.tracker.as_ref())
    }

    pub(crate) fn with_open(&mut self, change: impl FnOnce(&mut OpenPress)) {
        if let Some(open) = &mut self.open {
            change(open);
        }
    }

    fn with_tracker(&mut self, change: impl FnOnce(&mut PressTracker)) {
        self.with_open(|open| {
            if let Some(tracker) = &mut open.tracker {
                change(tracker);
            }
        });
    }

    /// Ticks until the tracker says so; false when `deadline` came first.
    fn until(
        &mut self,
        done: impl Fn(&PressTracker) -> bool,
        deadline: HostTime,
    ) -> Result<bool, Halt> {
        loop {
            if self.tracker().is_some_and(&done) {
                return Ok(true);
            }
            if self.now() >= deadline {
                return Ok(false);
            }
            self.tick(Some(deadline))?;
        }
    }

    /// Hands over all bytes and poses up to now, then the outcome.
    pub(crate) fn close_press(&mut self, trouble: Option<String>) -> Result<(), ControllerError> {
        let flushed = self.observe().and(self.collect(Collect::Flush));
        if self.ending {
            if let Err(e) = flushed {
                self.journal.problem(e.to_string());
            }
        } else {
            flushed?;
        }
        self.emit_poses()?;
        let Some(open) = &self.open else {
            return Ok(());
        };
        let outcome = judge(open, trouble);
        self.journal.outcome(outcome)?;
        self.open = None;
        Ok(())
    }
}

/// The outcome of a press: valid only when all was measured, stayed in place and nothing was lost.
fn judge(open: &OpenPress, trouble: Option<String>) -> PressOutcome {
    let mut reasons: Vec<String> = trouble.into_iter().collect();
    let mut timing: Option<PressTiming> = None;
    if let Some(tracker) = &open.tracker {
        match tracker.timing() {
            Ok(t) => timing = Some(t),
            Err(reason) if reasons.is_empty() => reasons.push(reason),
            Err(_) => {}
        }
        if tracker.at_depth().is_some() {
            reasons.extend(tracker.check_hold().err());
        }
    }
    for camera in CameraId::ALL {
        let (lost, bytes) = (open.lost[camera.index()], open.bytes[camera.index()]);
        if lost > 0 {
            reasons.push(format!("{camera} lost {lost} bytes"));
        } else if bytes == 0 {
            reasons.push(format!("{camera} sent no bytes"));
        }
    }
    let tracker = open.tracker.as_ref();
    let mean = tracker.and_then(PressTracker::mean);
    PressOutcome {
        attempt: open.attempt,
        verdict: if reasons.is_empty() {
            PressVerdict::Valid
        } else {
            PressVerdict::Invalid(reasons.join("; "))
        },
        timing,
        measured_at: mean.map(skinrig_model::Point3::plane),
        measured_depth_mm: mean.zip(tracker).map(|(m, t)| t.surface_mm() - m.z_mm),
        touched_mm: tracker.and_then(PressTracker::touched_mm),
        peak_force_n: tracker.and_then(PressTracker::peak_force_n),
        scheduled: false,
    }
}
