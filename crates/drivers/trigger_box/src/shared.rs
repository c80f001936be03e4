//! What the thread that owns the port leaves for whoever polls.

use std::sync::{Mutex, MutexGuard, PoisonError};

use skinrig_device::DeviceError;
use skinrig_model::{BoxReport, DeviceRole};

/// Reports that are kept for [`skinrig_device::TriggerBox::poll`]: an hour of exchanges and sync trains.
const MAX_REPORTS: usize = 65_536;
/// Faults that are kept for it: whoever does not ask learns of the first ones.
const MAX_FAULTS: usize = 64;

/// What the thread tells without being asked.
#[derive(Default)]
pub(crate) struct Shared {
    pub reports: Vec<BoxReport>,
    /// Reports that found no room since this was last told.
    lost_reports: u64,
    /// Each is told once.
    faults: Vec<DeviceError>,
    /// Why the line is down, if it is.
    pub down: Option<String>,
    pub contradictions: u64,
    /// Resets of the box that were noticed.
    pub resets: u64,
}

pub(crate) fn lock(shared: &Mutex<Shared>) -> MutexGuard<'_, Shared> {
    // What is in there stays whole whatever panicked.
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    /// Keeps a report for the next poll, or counts it as lost.
    pub(crate) fn report(&mut self, report: BoxReport) {
        if self.reports.len() < MAX_REPORTS {
            self.reports.push(report);
        } else {
            self.lost_reports += 1;
        }
    }

    /// Keeps a fault for the next poll.
    pub(crate) fn remember(&mut self, fault: DeviceError) {
        if self.faults.len() < MAX_FAULTS && !self.faults.contains(&fault) {
            self.faults.push(fault);
        }
    }

    /// The next thing that went wrong at the box `serial`, told once.
    pub(crate) fn next_fault(&mut self, serial: &str) -> Option<DeviceError> {
        let lost = std::mem::take(&mut self.lost_reports);
        if lost > 0 {
            return Some(DeviceError::State {
                role: DeviceRole::TriggerBox,
                serial: serial.to_owned(),
                expected: "asked for its reports".to_owned(),
                found: format!(
                    "left alone until {MAX_REPORTS} of them were waiting; {lost} later ones are lost"
                ),
            });
        }
        (!self.faults.is_empty()).then(|| self.faults.remove(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::HostTime;

    #[test]
    fn reports_that_found_no_room_are_counted_and_told_once() {
        let mut shared = Shared::default();
        let noticed = HostTime(0);
        for _ in 0..MAX_REPORTS + 3 {
            shared.report(BoxReport::Reset { noticed });
        }
        assert_eq!(shared.reports.len(), MAX_REPORTS);
        let fault = shared.next_fault("S1").map(|f| f.to_string());
        assert!(
            fault
                .as_ref()
                .is_some_and(|f| f.contains("3 later ones are lost")),
            "{fault:?}"
        );
        assert_eq!(shared.next_fault("S1"), None);
    }
}
