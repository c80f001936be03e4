//! The end of a run, however it came: off the skin, hold, disarm, stop, and tell.

use std::panic::{AssertUnwindSafe, catch_unwind};

use skinrig_model::{CameraId, InterruptionKind, Record, RunEnd};

use crate::core::Core;
use crate::error::{ControllerError, Halt, NotAtRest};
use crate::press_fault::PressFault;
use crate::run::RunReport;
use crate::states::{Event, State};

/// How often a device that does not answer is told to rise, to disarm, to stop.
const TRIES: u32 = 3;

/// How a run ends whose motors the operator switched off.
const HALTED: &str =
    "operator: halt; the tip was left where it was, look before the robot is powered again";

impl Core<'_> {
    /// Runs a part of the experiment; a panic in it becomes a fault.
    pub(crate) fn shielded(
        &mut self,
        part: impl FnOnce(&mut Self) -> Result<(), Halt>,
    ) -> Result<(), Halt> {
        match catch_unwind(AssertUnwindSafe(|| part(self))) {
            Ok(result) => result,
            Err(payload) => Err(ControllerError::Internal(panic_text(&*payload)).into()),
        }
    }

    /// Like [`shielded`](Self::shielded), for the end: what fails is remembered, and the end goes on.
    fn attempt(
        &mut self,
        what: &'static str,
        part: impl FnOnce(&mut Self) -> Result<(), ControllerError>,
    ) -> bool {
        match self.shielded(|core| Ok(part(core)?)) {
            Ok(()) => true,
            Err(Halt::Fault(e)) => {
                self.journal.problem(what, e);
                false
            }
            // `part` cannot ask for these.
            Err(Halt::Stopped | Halt::Aborted | Halt::Halted | Halt::PausedNow) => false,
        }
    }

    /// Brings the rig to rest and closes the records. Does nothing the second time.
    pub(crate) fn conclude(&mut self, result: Result<(), Halt>) {
        if self.machine.state() == State::Finished {
            return;
        }
        let at = catch_unwind(AssertUnwindSafe(|| self.now())).ok();
        self.ending = true;
        self.journal.ending();
        let mut causes = Vec::new();
        let (mut end, interruption) = match result {
            Ok(()) => (RunEnd::Completed, None),
            // The row was written when the operator asked.
            Err(Halt::Stopped) => (RunEnd::Stopped("operator: stop".to_owned()), None),
            Err(Halt::Aborted) => {
                self.machine.fire(Event::Abort);
                (
                    RunEnd::Stopped("operator: abort".to_owned()),
                    Some(InterruptionKind::Abort),
                )
            }
            // Heard below, where the motors go off.
            Err(Halt::Halted) => (RunEnd::Stopped("operator: halt".to_owned()), None),
            Err(Halt::PausedNow) => {
                let lost = "a pause was caught by no motion";
                self.machine.fire(Event::Fault);
                let error = ControllerError::Internal(lost.to_owned());
                let end = RunEnd::Faulted(error.to_string());
                causes.push(error);
                (end, Some(InterruptionKind::Fault))
            }
            Err(Halt::Fault(e)) => {
                self.machine.fire(Event::Fault);
                let end = RunEnd::Faulted(e.to_string());
                causes.push(e);
                (end, Some(InterruptionKind::Fault))
            }
        };

        let (retracted, disarmed) = self.make_safe();
        let first_reason = match &end {
            RunEnd::Completed => String::new(),
            RunEnd::Stopped(r) | RunEnd::Faulted(r) => r.clone(),
        };
        if self.halted_at.is_some() {
            end = match end {
                RunEnd::Faulted(r) => RunEnd::Faulted(format!("{r}; {HALTED}")),
                _ => RunEnd::Stopped(HALTED.to_owned()),
            };
        }
        let warning = match (retracted || self.halted_at.is_some(), disarmed) {
            (true, true) => None,
            (false, true) => Some(NotAtRest::NotClear),
            (_, false) => Some(NotAtRest::NotDisarmed),
        };
        if let Some(warning) = warning {
            causes.push(warning.into());
            end = RunEnd::Faulted(match end {
                RunEnd::Completed => warning.to_string(),
                RunEnd::Stopped(r) | RunEnd::Faulted(r) => format!("{r}; {warning}"),
            });
        }

        let reason = match &end {
            RunEnd::Completed => String::new(),
            RunEnd::Stopped(r) | RunEnd::Faulted(r) => r.clone(),
        };
        let t = at.unwrap_or_else(|| self.indenter.position().map(|p| p.t).unwrap_or_default());
        let ended = catch_unwind(AssertUnwindSafe(|| self.now())).unwrap_or(t);
        self.attempt("outcome", |core| {
            core.emit_poses()?;
            if core.open.is_some() {
                core.close_press(Some(PressFault::RunEnded(reason.clone())))?;
            }
            core.journal.miss_the_rest(&reason)
        });
        self.attempt("the operator's notes", Self::write_notes);
        let problems = self.journal.problems.clone();
        for problem in problems {
            let _ = self.journal.emit(Record::Note {
                t: ended,
                text: format!("while ending: {problem}"),
            });
        }
        // What ended the run, then what the end itself met with.
        let mut rows = Vec::new();
        rows.extend(interruption.map(|kind| (kind, t, first_reason)));
        rows.extend(
            self.halted_at
                .map(|t| (InterruptionKind::Halt, t, HALTED.to_owned())),
        );
        if warning.is_some() {
            rows.retain(|(kind, ..)| *kind != InterruptionKind::Fault);
            rows.push((InterruptionKind::Fault, t, reason));
        }
        for (kind, t, reason) in rows {
            let _ = self.journal.emit(Record::Interruption { kind, t, reason });
        }
        let _ = self.journal.emit(Record::Ended {
            t: ended,
            end: end.clone(),
        });
        self.machine.fire(Event::Disarmed);
        // Whatever is asked for from here on finds everything at rest already.
        self.control.hear_up_to(self.control.asked());
        let [planned, valid, invalid, missed] = self.journal.counts();
        self.report = Some(RunReport {
            end,
            causes,
            press_faults: std::mem::take(&mut self.press_faults),
            valid_presses: self.journal.valid(),
            ended_at: ended,
            planned,
            valid,
            invalid,
            missed,
            retracted,
            disarmed,
            problems: std::mem::take(&mut self.journal.problems),
        });
    }

    /// Off the skin if the robot still answers; hold; disarm; cameras flushed and stopped; notes. Gives whether
    /// the tip was seen at clearance height and whether the robot confirmed that it is disarmed.
    fn make_safe(&mut self) -> (bool, bool) {
        let tripped = self.indenter.trip().is_some();
        let mut retracted = !tripped || self.indenter.is_clear();
        if self.indenter.is_armed() {
            retracted =
                (0..TRIES).any(|_| !self.hear_halt() && self.attempt("retract", Self::lift));
            if !self.hear_halt() {
                self.attempt("hold", |core| core.indenter.hold());
            }
        }
        if !self.hear_halt() {
            self.machine.fire(Event::Cleared);
        }
        let disarmed = (0..TRIES).any(|_| self.attempt("disarm", |core| core.indenter.disarm()));
        // What the robot and the cameras delivered until now belongs to the session.
        self.attempt("last samples", Self::observe);
        for camera in CameraId::ALL {
            let _ = (0..TRIES).any(|_| self.attempt("stop", |core| core.stop_camera(camera)));
        }
        self.attempt("notes", Self::emit_box_notes);
        (retracted, disarmed)
    }

    /// Straight up to clearance height, unless the tip is there.
    fn lift(&mut self) -> Result<(), ControllerError> {
        if self.machine.state() != State::Retracting {
            // Whatever was under way, sideways motion included, ends here.
            self.attempt("hold", |core| core.indenter.hold());
        }
        self.observe()?;
        if self.indenter.is_clear() {
            return Ok(());
        }
        let (Some(target), Some(from)) = (self.indenter.point_above(), self.indenter.position())
        else {
            return Err(ControllerError::PoseStream {
                expected: "a known position".to_owned(),
                found: "none".to_owned(),
            });
        };
        let (speed, allowed) = self.own_motion(target.distance_mm(from.measured));
        let t = self.command(target, speed)?;
        while !self.indenter.is_clear() {
            let now = self.now();
            if now >= t + allowed {
                return Err(self.not_arrived("straight up", target, allowed).into());
            }
            self.clock.wait_until(now + self.settings.tick);
            self.observe()?;
            if self.hear_halt() {
                return Err(self.not_arrived("straight up", target, now - t).into());
            }
        }
        Ok(())
    }
}

impl Drop for Core<'_> {
    fn drop(&mut self) {
        let dropped = ControllerError::Internal("the run was dropped before its end".to_owned());
        self.conclude(Err(Halt::Fault(dropped)));
    }
}

/// What a panic said.
fn panic_text(payload: &(dyn std::any::Any + Send)) -> String {
    let text = payload
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned());
    text.map_or_else(|| "panic".to_owned(), |t| format!("panic: {t}"))
}
