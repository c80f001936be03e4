//! Faults on purpose that meet the records of a run: the process is gone, the disk is full. Those of devices: [`crate::rig::planted`].
//!
//! Gone means at once and without a word, as by `kill -9` or a power cut: no thread goes on, nothing is closed.

use std::sync::Arc;

use skinrig_controller::SinkFault;
use skinrig_model::Record;
use skinrig_protocol::{FaultKind, FaultPhase, FaultTime, PlantedFault};
use skinrig_recorder::{RecorderError, WriteFailure};

/// Counts the records of a run and makes its faults.
#[derive(Debug, Clone, Default)]
pub struct FaultInjector {
    faults: Vec<PlantedFault>,
    records: u32,
    journal: u32,
    presses: u32,
    full: bool,
}

impl FaultInjector {
    /// Makes those of these faults that meet records.
    #[must_use]
    pub fn new(faults: &[PlantedFault]) -> Self {
        Self {
            faults: faults
                .iter()
                .copied()
                .filter(|fault| fault.kind.is_of_records())
                .collect(),
            ..Self::default()
        }
    }

    /// The next record is about to be taken.
    ///
    /// # Errors
    /// What a full disk answers, from its time on.
    pub fn before(&mut self, record: &Record) -> Result<(), SinkFault> {
        self.records += 1;
        let streams = matches!(
            record,
            Record::Command { .. }
                | Record::Poses(_)
                | Record::Chunk(_)
                | Record::MarkSent(_)
                | Record::BoxReports { .. }
        );
        let intent = matches!(record, Record::Intent { .. });
        self.journal += u32::from(!streams);
        self.presses += u32::from(intent);
        for fault in &self.faults {
            let due = match fault.when {
                FaultTime::Nth(FaultPhase::Record, n) => n == self.records,
                FaultTime::Nth(FaultPhase::Journal, n) => !streams && n == self.journal,
                FaultTime::Nth(FaultPhase::Press, n) => intent && n == self.presses,
                _ => false,
            };
            match fault.kind {
                FaultKind::Killed if due => gone(),
                FaultKind::DiskFull if due => self.full = true,
                _ => {}
            }
        }
        if self.full {
            return Err(SinkFault::Rejected(format!("writing a record: {FULL}")));
        }
        Ok(())
    }

    /// The session is about to be sealed.
    ///
    /// # Errors
    /// On a full disk.
    pub fn before_the_seal(&self) -> Result<(), RecorderError> {
        let killed =
            |fault: &PlantedFault| fault.kind == FaultKind::Killed && fault.when == FaultTime::Seal;
        if self.faults.iter().any(killed) {
            gone();
        }
        if self.full {
            return Err(RecorderError::WriteFailed(WriteFailure::System(Arc::new(
                RecorderError::Io {
                    path: "session".into(),
                    doing: "writing a record",
                    source: std::io::Error::other(FULL),
                },
            ))));
        }
        Ok(())
    }
}

/// SQLite's message for a full disk.
const FULL: &str = "database or disk is full (a fault on purpose)";

/// Ends the process without unwinding.
fn gone() -> ! {
    std::process::abort()
}
