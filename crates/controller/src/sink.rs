//! Where records go.

use skinrig_model::Record;

/// A consumer of records failed; the run must end safely.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SinkFault {
    /// The record was not taken.
    #[error("recorder: {0}")]
    Refused(String),
    /// The record was taken and is late on its way to the disk: it may be there already, or come there yet.
    #[error("recorder: {0}")]
    Late(String),
}

/// Takes every record of a run, in order.
pub trait RecordSink {
    /// Takes one record. Returns when it has been accepted; for [`Record::Intent`] and
    /// [`Record::Outcome`] that means durable.
    ///
    /// # Errors
    /// [`SinkFault`] when the record cannot be kept; the controller then retracts, disarms and ends the run.
    fn accept(&mut self, record: Record) -> Result<(), SinkFault>;

    /// Whether what was taken is still where it was put. Asked every [`check_sink_every`] from the first record to the end of the plan.
    ///
    /// [`check_sink_every`]: crate::ControllerSettings::check_sink_every
    ///
    /// # Errors
    /// [`SinkFault`] when it is not; the controller then retracts, disarms and ends the run, and the records of the end are taken.
    fn check(&mut self) -> Result<(), SinkFault> {
        Ok(())
    }

    /// Bytes that there is still room for; `None` when it does not know.
    fn free_bytes(&mut self) -> Option<u64> {
        None
    }
}
