//! State shared between the thread that owns the port and the polling program.

use std::sync::{Mutex, MutexGuard, PoisonError};

use skinrig_device::DeviceError;
use skinrig_model::{BoxReport, DeviceRole};

/// Capacity for reports until [`skinrig_device::TriggerBox::poll`]: an hour of exchanges and sync trains.
const MAX_REPORTS: usize = 65_536;
/// Capacity for faults; later ones are dropped.
const MAX_FAULTS: usize = 64;

/// Data for the next poll.
#[derive(Default)]
pub(crate) struct Shared {
    pub reports: Vec<BoxReport>,
    /// Reports dropped since the last poll reported them.
    lost_reports: u64,
    /// Faults that were not yet reported; each is reported once.
    faults: Vec<DeviceError>,
    /// Reason why the line is down; `None` if it is up.
    pub down: Option<String>,
    pub contradictions: u64,
    /// Number of resets of the box.
    pub resets: u64,
}

pub(crate) fn lock(shared: &Mutex<Shared>) -> MutexGuard<'_, Shared> {
    // Every update is complete under the lock, so a poisoned lock has consistent data.
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    /// Queues a report for the next poll, or counts it as dropped.
    pub(crate) fn report(&mut self, report: BoxReport) {
        if self.reports.len() < MAX_REPORTS {
            self.reports.push(report);
        } else {
            self.lost_reports += 1;
        }
    }

    /// Queues a fault for the next poll.
    pub(crate) fn add_fault(&mut self, fault: DeviceError) {
        if self.faults.len() < MAX_FAULTS && !self.faults.contains(&fault) {
            self.faults.push(fault);
        }
    }

    /// Takes the next fault of the box `serial`; each is returned once.
    pub(crate) fn next_fault(&mut self, serial: &str) -> Option<DeviceError> {
        let lost = std::mem::take(&mut self.lost_reports);
        if lost > 0 {
            return Some(DeviceError::State {
                role: DeviceRole::TriggerBox,
                serial: serial.to_owned(),
                expected: "polled regularly".to_owned(),
                found: format!(
                    "not polled until {MAX_REPORTS} reports were queued; {lost} later ones are lost"
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
    fn dropped_reports_are_counted_and_reported_once() {
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
