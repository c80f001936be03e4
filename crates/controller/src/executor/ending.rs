//! The end of a run: retracts, holds, disarms, stops the devices and writes the last records.

use std::panic::{AssertUnwindSafe, catch_unwind};

use skinrig_model::{
    CameraId, HostTime, InterruptionKind, InterruptionReason, MissedReason, NotAtRest, PressFault,
    Record, RunEnd, RunFault, StopReason,
};

use super::Executor;
use crate::error::Halt;
use crate::run::RunReport;
use crate::states::{Event, State};

/// How often to command retract, disarm and stop to a device that does not answer.
const MAX_TRIES: u32 = 3;

impl Executor<'_> {
    /// Runs a part of the experiment; a panic becomes a fault.
    pub(super) fn catch_panic(
        &mut self,
        part: impl FnOnce(&mut Self) -> Result<(), Halt>,
    ) -> Result<(), Halt> {
        match catch_unwind(AssertUnwindSafe(|| part(self))) {
            Ok(result) => result,
            Err(payload) => Err(RunFault::Internal(panic_text(&*payload)).into()),
        }
    }

    /// Like [`catch_panic`](Self::catch_panic), for the end of the run: a failure becomes a problem, and the end continues.
    fn attempt(
        &mut self,
        what: &'static str,
        part: impl FnOnce(&mut Self) -> Result<(), RunFault>,
    ) -> bool {
        match self.catch_panic(|executor| Ok(part(executor)?)) {
            Ok(()) => true,
            Err(Halt::Fault(e)) => {
                self.journal.problem(what, e);
                false
            }
            // `part` cannot return these.
            Err(Halt::Stopped | Halt::Aborted | Halt::Halted | Halt::PausedNow) => false,
        }
    }

    /// Brings the rig to rest and closes the records.
    pub(super) fn conclude(&mut self, result: Result<(), Halt>) -> RunReport {
        let at = catch_unwind(AssertUnwindSafe(|| self.now())).ok();
        self.journal.begin_ending();
        let (mut end, interruption) = self.end_of(result);

        let (retracted, disarmed) = self.make_safe();
        let first_end = end.clone();
        if self.machine.halted_at().is_some() {
            end = match end {
                RunEnd::Faulted(_) => end.and_fault(RunFault::Stopped(StopReason::Halt)),
                _ => RunEnd::Stopped(StopReason::Halt),
            };
        }
        let warning = match (retracted || self.machine.halted_at().is_some(), disarmed) {
            (true, true) => None,
            (false, true) => Some(NotAtRest::NotClear),
            (_, false) => Some(NotAtRest::NotDisarmed),
        };
        if let Some(warning) = warning {
            end = end.and_fault(warning);
        }

        let t = at.unwrap_or_else(|| self.indenter.position().map(|p| p.t).unwrap_or_default());
        let ended = catch_unwind(AssertUnwindSafe(|| self.now())).unwrap_or(t);
        self.close_records(&end, ended);
        // First the cause of the run's end, then the problems during the end.
        let mut rows = Vec::new();
        rows.extend(interruption.map(|kind| (kind, t, first_end)));
        rows.extend(
            self.machine
                .halted_at()
                .map(|t| (InterruptionKind::Halt, t, RunEnd::Stopped(StopReason::Halt))),
        );
        if warning.is_some() {
            rows.retain(|(kind, ..)| *kind != InterruptionKind::Fault);
            rows.push((InterruptionKind::Fault, t, end.clone()));
        }
        for (kind, t, end) in rows {
            let reason = InterruptionReason::End(end);
            let _ = self.journal.emit(Record::Interruption { kind, t, reason });
        }
        let _ = self.journal.emit(Record::Ended {
            t: ended,
            end: end.clone(),
        });
        self.machine.fire(Event::Disarmed);
        // Later requests find everything already at rest.
        self.machine.acknowledge(self.machine.requests_made());
        let [planned, valid, invalid, missed] = self.journal.counts();
        RunReport {
            end,
            press_faults: self.series.take_faults(),
            valid_presses: self.journal.valid(),
            ended_at: ended,
            planned,
            valid,
            invalid,
            missed,
            retracted,
            disarmed,
            problems: self.journal.take_problems(),
        }
    }

    /// End of a run with this result, and the interruption to be recorded for it.
    fn end_of(&mut self, result: Result<(), Halt>) -> (RunEnd, Option<InterruptionKind>) {
        match result {
            Ok(()) => (RunEnd::Completed, None),
            // The interruption was recorded when the operator requested it.
            Err(Halt::Stopped) => (RunEnd::Stopped(self.stop_reason()), None),
            Err(Halt::Aborted) => {
                self.machine.fire(Event::Abort);
                (
                    RunEnd::Stopped(StopReason::Abort),
                    Some(InterruptionKind::Abort),
                )
            }
            // `conclude` records it with the time at which the motors were switched off.
            Err(Halt::Halted) => (RunEnd::Stopped(StopReason::Halt), None),
            Err(Halt::PausedNow) => {
                self.machine.fire(Event::Fault);
                let lost = RunFault::Internal("no motion handled a pause".to_owned());
                (RunEnd::fault(lost), Some(InterruptionKind::Fault))
            }
            Err(Halt::Fault(e)) => {
                self.machine.fire(Event::Fault);
                (RunEnd::fault(e), Some(InterruptionKind::Fault))
            }
        }
    }

    /// Gives the open press and all missed ones their outcomes, and writes the last notes.
    fn close_records(&mut self, end: &RunEnd, ended: HostTime) {
        self.attempt("outcome", |executor| {
            executor.journal.emit_poses()?;
            if executor.trackers.press().is_some() {
                executor.close_press(Some(PressFault::RunEnded(end.clone())))?;
            }
            executor
                .journal
                .miss_the_rest(&MissedReason::RunEnded(end.clone()))
        });
        self.attempt("the operator's notes", Self::write_notes);
        let problems = self.journal.problems().to_vec();
        for problem in problems {
            let _ = self.journal.note(ended, format!("while ending: {problem}"));
        }
    }

    /// Retracts if the robot still answers, holds, disarms, flushes and stops the cameras, and emits notes. Returns whether
    /// the tip reached clearance height and whether the robot confirmed that it is disarmed.
    fn make_safe(&mut self) -> (bool, bool) {
        let tripped = self.indenter.trip().is_some();
        let mut retracted = !tripped || self.indenter.is_clear();
        if self.indenter.is_armed() {
            retracted = (0..MAX_TRIES).any(|_| {
                !self.machine.check_halt(self.clock.as_ref())
                    && self.attempt("retract", Self::rise_clear)
            });
            if !self.machine.check_halt(self.clock.as_ref()) {
                self.attempt("hold", |executor| executor.indenter.hold());
            }
        }
        if !self.machine.check_halt(self.clock.as_ref()) {
            self.machine.fire(Event::Cleared);
        }
        let disarmed =
            (0..MAX_TRIES).any(|_| self.attempt("disarm", |executor| executor.indenter.disarm()));
        // Everything that robot and cameras have delivered belongs to the session.
        self.attempt("last samples", Self::observe);
        for camera in CameraId::ALL {
            let _ = (0..MAX_TRIES)
                .any(|_| self.attempt("stop", |executor| executor.stop_camera(camera)));
        }
        self.attempt("notes", Self::emit_box_notes);
        (retracted, disarmed)
    }

    /// Rises straight to clearance height, unless the tip is already there.
    fn rise_clear(&mut self) -> Result<(), RunFault> {
        if self.machine.state() != State::Retracting {
            // Ends any current motion, including lateral ones.
            self.attempt("hold", |executor| executor.indenter.hold());
        }
        self.observe()?;
        if self.indenter.is_clear() {
            return Ok(());
        }
        let (Some(target), Some(from)) = (self.indenter.point_above(), self.indenter.position())
        else {
            return Err(RunFault::PoseStream {
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
            if self.machine.check_halt(self.clock.as_ref()) {
                return Err(self.not_arrived("straight up", target, now - t).into());
            }
        }
        Ok(())
    }
}

impl Drop for Executor<'_> {
    fn drop(&mut self) {
        if self.machine.state() == State::Finished {
            return;
        }
        let dropped = RunFault::Internal("the run was dropped before its end".to_owned());
        let _ = self.conclude(Err(Halt::Fault(dropped)));
    }
}

/// Message of a panic.
fn panic_text(payload: &(dyn std::any::Any + Send)) -> String {
    let text = payload
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned());
    text.map_or_else(|| "panic".to_owned(), |t| format!("panic: {t}"))
}
