//! The consumer of a run's records: the session file first, then the terminal.

use skinrig_controller::{RecordSink, SinkFault};
use skinrig_model::Record;
use skinrig_recorder::{RecorderError, Sealed, SessionWriter};

use crate::progress::ProgressView;

/// Writes every record to the session file and shows it.
pub struct SessionSink {
    writer: SessionWriter,
    view: ProgressView,
    scheduled: bool,
}

impl SessionSink {
    /// A sink over a new session. `scheduled` marks every outcome as taken from a schedule, not measured.
    #[must_use]
    pub const fn new(writer: SessionWriter, view: ProgressView, scheduled: bool) -> Self {
        Self {
            writer,
            view,
            scheduled,
        }
    }

    /// Seals the session.
    ///
    /// # Errors
    /// [`RecorderError`]; the session stays readable.
    pub fn seal(mut self) -> Result<Sealed, RecorderError> {
        self.view.finish();
        self.writer.finish()
    }
}

impl RecordSink for SessionSink {
    fn accept(&mut self, mut record: Record) -> Result<(), SinkFault> {
        if let (true, Record::Outcome(outcome)) = (self.scheduled, &mut record) {
            outcome.scheduled = true;
        }
        self.view.update(&record);
        self.writer
            .accept(record)
            .map_err(|e| SinkFault(e.to_string()))
    }
}
