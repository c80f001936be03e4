//! Looks at the data after a repetition: begins them, records their answers, and stops the run once one decides.

use skinrig_model::{InterruptionKind, InterruptionReason, Record, RunEnd, RunFault, StopReason};

use super::Executor;
use crate::looks::LookOutcome;
use crate::states::{Event, State};

impl Executor<'_> {
    /// Begins a look. An answer that is there at once counts before the next step.
    pub(super) fn begin_look(&mut self, number: u32) -> Result<(), RunFault> {
        if self.answered.is_some() {
            return Ok(());
        }
        self.looks.begin(number);
        self.take_looks()
    }

    /// Records the looks that are done. One that decides requests a stop, like the operator's: the current press is finished.
    /// A paused run stays paused until it is resumed.
    pub(super) fn take_looks(&mut self) -> Result<(), RunFault> {
        let t = self.now();
        while let Some(outcome) = self.looks.poll(t) {
            let text = match outcome {
                LookOutcome::Taken(look) => {
                    self.answered = self.answered.or(look.answer.map(|_| look));
                    look.to_string()
                }
                LookOutcome::NotTaken { number, why } => {
                    format!("look {number} was not taken: {why}")
                }
            };
            self.journal.note(t, text)?;
        }
        let (Some(look), None, State::Running) =
            (self.answered, self.decided, self.machine.state())
        else {
            return Ok(());
        };
        self.decided = Some(look);
        self.machine.fire(Event::Stop);
        let end = RunEnd::Stopped(StopReason::Decided(Box::new(look)));
        self.journal.emit(Record::Interruption {
            kind: InterruptionKind::Stop,
            t,
            reason: InterruptionReason::End(end),
        })
    }

    /// Reason for a stop between two presses.
    pub(super) fn stop_reason(&self) -> StopReason {
        match self.decided {
            Some(look) => StopReason::Decided(Box::new(look)),
            None => StopReason::Stop,
        }
    }
}
