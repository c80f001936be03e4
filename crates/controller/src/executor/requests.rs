//! Handling of the operator's requests and notes at every tick.

use skinrig_model::{
    InterruptionKind, InterruptionReason as Reason, Record, RunEnd, RunFault, StopReason,
};

use super::Executor;
use crate::control::Request;
use crate::error::Halt;
use crate::states::Event;

impl Executor<'_> {
    /// Handles the operator's requests.
    pub(super) fn handle_requests(&mut self) -> Result<(), Halt> {
        self.write_notes()?;
        let requests = self.machine.requests_made();
        for request in self.machine.take_requests() {
            let before = self.machine.state();
            let (event, kind, reason) = match request {
                Request::Halt => return Err(Halt::Halted),
                Request::Abort => return Err(Halt::Aborted),
                Request::Stop => (
                    Event::Stop,
                    InterruptionKind::Stop,
                    Reason::End(RunEnd::Stopped(StopReason::Stop)),
                ),
                Request::PauseNow => (
                    Event::PauseNow,
                    InterruptionKind::PauseNow,
                    Reason::PauseNow,
                ),
                Request::Pause => (Event::Pause, InterruptionKind::Pause, Reason::Pause),
                Request::Resume => (Event::Resume, InterruptionKind::Resume, Reason::Resume),
            };
            let took_over = self.suspender.release();
            self.machine.fire(event);
            // Requests without effect are not recorded.
            if took_over || self.machine.state() != before {
                let t = self.now();
                self.journal
                    .emit(Record::Interruption { kind, t, reason })?;
            }
        }
        self.machine.acknowledge(requests);
        if self.machine.take_interruption() {
            return Err(Halt::PausedNow);
        }
        Ok(())
    }

    /// Emits the operator's notes.
    pub(super) fn write_notes(&mut self) -> Result<(), RunFault> {
        for text in self.machine.take_notes() {
            let t = self.now();
            self.journal.note(t, text)?;
            self.machine.count_note();
        }
        Ok(())
    }
}
