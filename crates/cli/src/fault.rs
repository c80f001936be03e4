//! Injected faults that affect the records of a run: killed process, full disk. For device faults see [`crate::rig::planted`].
//!
//! A kill takes effect at once, like `kill -9` or a power cut: no thread continues, nothing is closed.

use std::sync::Arc;

use skinrig_controller::SinkFault;
use skinrig_model::{Record, RigFault};
use skinrig_protocol::{FaultPhase, FaultTime, PlantedFault};
use skinrig_recorder::{RecorderError, WriteFailure};
use skinrig_sim::FaultWatch;

/// Counts the records of a run, injects its faults, and knows which faults of the run never came due.
#[derive(Debug, Clone, Default)]
pub struct FaultInjector {
    faults: Vec<PlantedFault>,
    /// Faults of devices, in the order of the watch.
    of_devices: Vec<PlantedFault>,
    watch: Option<FaultWatch>,
    records: u32,
    journal: u32,
    presses: u32,
    full: bool,
}

impl FaultInjector {
    /// An injector for those of these faults that affect records. The `watch` is that of the rig which injects the others.
    #[must_use]
    pub fn new(faults: &[PlantedFault], watch: Option<FaultWatch>) -> Self {
        let (of_records, of_devices) = faults.iter().partition(|fault| fault.kind.is_of_records());
        Self {
            faults: of_records,
            of_devices,
            watch,
            ..Self::default()
        }
    }

    /// The faults that did not occur in a run that is over.
    #[must_use]
    pub fn never_struck(&self) -> Vec<PlantedFault> {
        let struck = self.watch.as_ref().map(FaultWatch::have_struck);
        let missed = self.of_devices.iter().zip(struck.into_iter().flatten());
        let missed = missed.filter_map(|(fault, struck)| (!struck).then_some(fault));
        // A run that is over was not killed, and one whose disk was full did not complete.
        missed.chain(&self.faults).copied().collect()
    }

    /// Called before each record is taken.
    ///
    /// # Errors
    /// The error of a full disk, once that fault is due.
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
                RigFault::Killed if due => die(),
                RigFault::DiskFull if due => self.full = true,
                _ => {}
            }
        }
        if self.full {
            return Err(SinkFault::Rejected(format!("writing a record: {FULL}")));
        }
        Ok(())
    }

    /// Called before the session is sealed.
    ///
    /// # Errors
    /// On a full disk.
    pub fn before_the_seal(&self) -> Result<(), RecorderError> {
        let killed =
            |fault: &PlantedFault| fault.kind == RigFault::Killed && fault.when == FaultTime::Seal;
        if self.faults.iter().any(killed) {
            die();
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
const FULL: &str = "database or disk is full (injected fault)";

/// Ends the process without unwinding.
fn die() -> ! {
    std::process::abort()
}
