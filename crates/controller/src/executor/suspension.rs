//! Suspension: a run waits at clearance height during a disturbance, and continues automatically afterwards.

use skinrig_device::DeviceError;
use skinrig_model::{
    CameraId, HostTime, InterruptionKind, InterruptionReason as Reason, Record, RunFault,
};
use skinrig_protocol::PressHandling;

use super::Executor;
use crate::camera_streams::ReadMode;
use crate::error::Halt;
use crate::states::{Event, State};
use crate::suspend::{SuspensionEnd, WindowMeasurements};

impl Executor<'_> {
    /// Evaluates the conditions of the plan once per window; suspends, resumes or ends the run.
    pub(super) fn suspend(&mut self) -> Result<(), Halt> {
        let running = matches!(
            self.machine.state(),
            State::Running | State::Pausing | State::PausingNow | State::Paused
        );
        if self.suspender.is_idle() || !running || self.journal.is_ending() {
            return Ok(());
        }
        let now = self.now();
        let Some(window_end) = self.suspender.due_window(now) else {
            return Ok(());
        };
        // A chunk may take long to fill, and its data belong to this window. If it is not yet complete, the next turn tries again.
        if !self.cameras.is_flushed_to(window_end) {
            self.collect(ReadMode::Flush)?;
        }
        if !self.cameras.is_flushed_to(window_end) {
            return Ok(());
        }
        let seconds = self.suspender.next_window(now);
        let measured = WindowMeasurements {
            temperatures_c: self.temperatures(now)?,
            free_b: self.free_space(now)?,
        };
        self.suspender.evaluate(now, seconds, measured);
        if self.machine.state() == State::Running
            && let Some(suspension) = self.suspender.take_pending()
        {
            let (event, kind) = match self.suspender.press_under_way() {
                PressHandling::Finish => (Event::Pause, InterruptionKind::Pause),
                PressHandling::BreakOff => (Event::PauseNow, InterruptionKind::PauseNow),
            };
            self.interrupt(event, kind, now, Reason::Suspended(suspension))?;
            self.suspender.hold(now, suspension);
        }
        let may_continue = self.machine.state() != State::PausingNow;
        match self.suspender.end(now, may_continue) {
            None => Ok(()),
            Some(SuspensionEnd::Calm(suspension)) => {
                let reason = Reason::Calm(suspension);
                self.interrupt(Event::Resume, InterruptionKind::Resume, now, reason)
            }
            Some(SuspensionEnd::TooLong { suspension, limit }) => {
                Err(RunFault::Suspended { suspension, limit }.into())
            }
        }
    }

    /// Reads the temperatures of the monitored cameras. No answer is a fault, as in any other call.
    fn temperatures(&mut self, t: HostTime) -> Result<[Option<f64>; 2], RunFault> {
        let mut found = [None; 2];
        for camera in CameraId::ALL {
            if !self.suspender.monitors_temperature(camera) {
                continue;
            }
            let temperature = match self.cameras.temperature_c(camera) {
                Err(DeviceError::Pending { .. }) => continue, // read in the next window
                other => other?,
            };
            if temperature.is_none() {
                self.suspender.stop_monitoring_temperature(camera);
                let text = format!(
                    "suspend.temperature: {camera} cannot measure its temperature: not monitored"
                );
                self.journal.note(t, text)?;
            }
            found[camera.index()] = temperature;
        }
        Ok(found)
    }

    /// Free space at the session file in bytes, if monitored.
    fn free_space(&mut self, t: HostTime) -> Result<Option<f64>, RunFault> {
        if !self.suspender.monitors_disk() {
            return Ok(None);
        }
        let free_b = self.journal.free_bytes().map(|b| b as f64);
        if free_b.is_none() {
            self.suspender.stop_monitoring_disk();
            let text = "suspend.disk_free: the free space is unknown: not monitored";
            self.journal.note(t, text.to_owned())?;
        }
        Ok(free_b)
    }

    fn interrupt(
        &mut self,
        event: Event,
        kind: InterruptionKind,
        t: HostTime,
        reason: Reason,
    ) -> Result<(), Halt> {
        self.machine.fire(event);
        Ok(self
            .journal
            .emit(Record::Interruption { kind, t, reason })?)
    }
}
