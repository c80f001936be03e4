//! The preflight's checks of the camera streams, and its conclusion.

use skinrig_device::DeviceError;
use skinrig_model::pulse::LOOPBACK;
use skinrig_model::{CameraId, HostDuration, PreflightCheck, Record, RunFault};

use super::Executor;
use crate::camera_streams::ReadMode;
use crate::checks::Preflight;
use crate::error::Halt;
use crate::stream_probe::StreamProbe;

/// How often to send the test mark before the line counts as broken: one damaged train must not cost a night.
const ATTEMPTS: u32 = 4;

impl Executor<'_> {
    /// Checks, with the cameras streaming, that both clocks advance and a mark arrives through both.
    pub(super) fn check_streams(&mut self) -> Result<(), Halt> {
        let Some(preflight) = self.preflight.begin_probe() else {
            return Ok(());
        };
        let answer = self.probe_streams(&preflight);
        self.preflight.end_probe();
        answer
    }

    fn probe_streams(&mut self, preflight: &Preflight) -> Result<(), Halt> {
        if let Some(within) = preflight.clocks_within {
            self.probe_until(within, StreamProbe::all_advance)?;
            self.preflight
                .check_streams(|probe| CameraId::ALL.map(|c| probe.clock_check(c, within)));
        }
        let Some(loopback) = preflight.loopback else {
            return Ok(());
        };
        if !self.trigger.is_connected() {
            return Ok(());
        }
        let has_mark = |probe: &StreamProbe| probe.all_saw_mark(&loopback);
        let mut attempts = 0;
        while attempts < ATTEMPTS && !self.preflight.streams_fulfil(has_mark) {
            attempts += 1;
            self.send_loopback()?;
            let share = HostDuration(loopback.within.0 / i64::from(ATTEMPTS));
            self.probe_until(share, has_mark)?;
        }
        self.preflight.check_streams(|probe| {
            CameraId::ALL.map(|c| probe.loopback_check(c, &loopback, attempts))
        });
        Ok(())
    }

    /// Sends the test mark as soon as the line is free; the box may be sending its own train.
    fn send_loopback(&mut self) -> Result<(), Halt> {
        let until = self.now() + self.settings.mark_within;
        loop {
            match self.trigger.send_now(LOOPBACK) {
                Ok(()) => return Ok(()),
                Err(DeviceError::Pending { .. }) => self.tick(None)?,
                Err(DeviceError::State { .. }) if self.now() < until => self.tick(Some(until))?,
                Err(e) => return Err(RunFault::from(e).into()),
            }
        }
    }

    /// Polls the cameras until `done`, or until `within` has passed.
    fn probe_until(
        &mut self,
        within: HostDuration,
        done: impl Fn(&StreamProbe) -> bool,
    ) -> Result<(), Halt> {
        let until = self.now() + within;
        while !self.preflight.streams_fulfil(&done) && self.now() < until {
            self.tick(Some(until))?;
            // A chunk may take long to fill.
            self.collect(ReadMode::Flush)?;
        }
        Ok(())
    }

    /// Emits the checks. If one failed, or a device failed meanwhile, nothing is armed.
    pub(super) fn conclude_preflight(&mut self, result: Result<(), Halt>) -> Result<(), Halt> {
        let Some(mut checks) = self.preflight.take_checks() else {
            return result;
        };
        if let Err(Halt::Fault(e)) = &result {
            checks.push(PreflightCheck::new(
                "devices",
                "every device answers, fits the plan and keeps its settings",
                e.to_string(),
                false,
                "`skinrig devices` shows what is connected",
            ));
        }
        let failed: Vec<PreflightCheck> = checks.iter().filter(|c| c.failed()).cloned().collect();
        self.journal.emit(Record::Preflight(checks))?;
        result?;
        if failed.is_empty() {
            return Ok(());
        }
        Err(RunFault::Preflight { failed }.into())
    }
}
