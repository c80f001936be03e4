//! The camera data of a press: they reach its end, and the event rate stays below its limit. A press with faulty data is repeated.

use skinrig_model::{CameraId, HostTime, PressFault};

use super::Executor;
use crate::camera_streams::ReadMode;
use crate::error::Halt;
use crate::open_press::OpenPress;

impl Executor<'_> {
    /// Waits, up to a limit, until both cameras have delivered their data of the press, so that losses are known before the
    /// verdict.
    pub(super) fn await_streams(&mut self) -> Result<(), Halt> {
        if !self.cameras.checks_time() {
            return Ok(());
        }
        let end = self.end_of_press();
        let within = self.settings.data_within;
        self.collect(ReadMode::Flush)?;
        // A camera that never completes a flush is a fault.
        while !self.cameras.is_flushed_to(end)
            || self.cameras.is_behind(end) && self.now() < end + within
        {
            self.tick(None)?;
            self.collect(ReadMode::Flush)?;
        }
        let Some(press) = self.trackers.press_mut() else {
            return Ok(());
        };
        for camera in CameraId::ALL {
            let reached = self.cameras.reached(camera);
            if reached.is_none_or(|t| t < end) {
                press.add_data_fault(PressFault::DataLate {
                    camera,
                    end,
                    waited: within,
                    reached,
                });
            }
        }
        Ok(())
    }

    /// Time at which the tip was clear again; the current time if it never was.
    fn end_of_press(&self) -> HostTime {
        let cleared = self.trackers.press().and_then(OpenPress::cleared_at);
        cleared.unwrap_or_else(|| self.now())
    }

    /// Compares the event rates of the current press with the limit of the plan, if it has one.
    pub(super) fn check_event_rate(&mut self) {
        let Some(level) = self.plan.suspend.event_rate.map(|t| t.trip) else {
            return;
        };
        let now = self.now();
        if let Some(press) = self.trackers.press_mut() {
            press.check_event_rate(now, level);
        }
    }
}
