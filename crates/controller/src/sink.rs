//! The consumer of records.

use skinrig_model::{CameraId, Record, SinkFault};

/// Consumes every record of a run, in order.
pub trait RecordSink {
    /// Accepts one record. For [`Record::Intent`] and [`Record::Outcome`], the record is durable on
    /// return.
    ///
    /// # Errors
    /// [`SinkFault`] if the record cannot be kept; the controller then retracts, disarms and ends the run.
    fn accept(&mut self, record: Record) -> Result<(), SinkFault>;

    /// Checks that the records are still where they were written. Called every [`check_sink_every`] from the first record to the end of the plan.
    ///
    /// [`check_sink_every`]: crate::ControllerSettings::check_sink_every
    ///
    /// # Errors
    /// [`SinkFault`] if they are not; the controller then retracts, disarms and ends the run, and the sink still accepts the final records.
    fn check(&mut self) -> Result<(), SinkFault> {
        Ok(())
    }

    /// Most bytes per camera that [`newest`](Self::newest) takes at the next tick; `None` while no program asks for the newest events.
    fn wants_newest(&mut self) -> Option<usize> {
        None
    }

    /// Takes a copy of the newest bytes of a camera that are in no chunk yet.
    fn newest(&mut self, _camera: CameraId, _bytes: Vec<u8>) {}

    /// Free space in bytes; `None` if unknown.
    fn free_bytes(&mut self) -> Option<u64> {
        None
    }
}
