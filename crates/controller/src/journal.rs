//! Hands records to the sink and keeps the books: every planned press ends as exactly one of its outcomes.

use std::panic::{AssertUnwindSafe, catch_unwind};

use skinrig_model::{AttemptId, PressHistory, PressId, PressOutcome, PressVerdict, Record};

use crate::error::{ControllerError, Problem};
use crate::sink::{RecordSink, SinkFault};

/// What became of a planned press.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fate {
    Planned,
    Under,
    Valid,
    Invalid,
    Missed,
}

/// The sink and the books.
pub(crate) struct Journal<'a> {
    sink: &'a mut dyn RecordSink,
    fates: Vec<Fate>,
    /// Attempts at each press so far, those of earlier legs counted.
    attempts: Vec<u32>,
    /// While ending: a failing or panicking sink no longer stops anything.
    lenient: bool,
    /// What went wrong while ending.
    pub(crate) problems: Vec<Problem>,
}

impl<'a> Journal<'a> {
    pub(crate) fn new(sink: &'a mut dyn RecordSink, presses: usize) -> Self {
        Self {
            sink,
            fates: vec![Fate::Planned; presses],
            attempts: vec![0; presses],
            lenient: false,
            problems: Vec::new(),
        }
    }

    /// What earlier legs of the session did, one history per planned press.
    pub(crate) fn remember(&mut self, histories: &[PressHistory]) {
        for (i, history) in histories.iter().enumerate().take(self.fates.len()) {
            self.attempts[i] = history.attempts;
            self.fates[i] = match &history.verdict {
                _ if history.attempts == 0 => Fate::Planned,
                Some(PressVerdict::Valid | PressVerdict::Excluded(_)) => Fate::Valid,
                Some(PressVerdict::Missed(_)) => Fate::Missed,
                // An attempt that was cut off is invalid already.
                Some(PressVerdict::Invalid(_)) | None => Fate::Invalid,
            };
        }
    }

    /// The attempt that comes next at `press`.
    pub(crate) fn next_attempt(&self, press: PressId) -> AttemptId {
        let before = self.attempts.get(press.index() as usize).copied();
        AttemptId {
            press,
            number: before.unwrap_or(0) + 1,
        }
    }

    /// Bytes that the sink still has room for, when it knows.
    pub(crate) fn free_bytes(&mut self) -> Option<u64> {
        self.sink.free_bytes()
    }

    /// Whether the sink still has what it took.
    pub(crate) fn check(&mut self) -> Result<(), ControllerError> {
        Ok(self.sink.check()?)
    }

    /// From now on nothing that the sink does stops the run's end.
    pub(crate) const fn ending(&mut self) {
        self.lenient = true;
    }

    pub(crate) fn problem(&mut self, doing: &'static str, error: impl Into<ControllerError>) {
        let problem = Problem {
            doing,
            error: error.into(),
        };
        if !self.problems.contains(&problem) {
            self.problems.push(problem);
        }
    }

    /// Emits a record; while ending, a failure is remembered instead of returned.
    pub(crate) fn emit(&mut self, record: Record) -> Result<(), ControllerError> {
        if !self.lenient {
            return Ok(self.sink.accept(record)?);
        }
        match catch_unwind(AssertUnwindSafe(|| self.sink.accept(record))) {
            Ok(Ok(())) => {}
            Ok(Err(fault)) => self.problem("", fault),
            Err(_) => self.problem("", SinkFault::Refused("panicked".to_owned())),
        }
        Ok(())
    }

    fn set(&mut self, press: PressId, fate: Fate) {
        if let Some(f) = self.fates.get_mut(press.index() as usize) {
            *f = fate;
        }
    }

    /// A press begins: its intent is durable when this returns.
    pub(crate) fn intent(
        &mut self,
        attempt: AttemptId,
        t: skinrig_model::HostTime,
    ) -> Result<(), ControllerError> {
        let told = self.emit(Record::Intent { attempt, t });
        if !was_refused(&told) {
            if let Some(attempts) = self.attempts.get_mut(attempt.press.index() as usize) {
                *attempts = attempt.number;
            }
            self.set(attempt.press, Fate::Under);
        }
        told
    }

    /// A press ended.
    pub(crate) fn outcome(&mut self, outcome: PressOutcome) -> Result<(), ControllerError> {
        let fate = match outcome.verdict {
            PressVerdict::Valid => Fate::Valid,
            _ => Fate::Invalid,
        };
        let press = outcome.attempt.press;
        let told = self.emit(Record::Outcome(outcome));
        if !was_refused(&told) {
            self.set(press, fate);
        }
        told
    }

    /// Every press that was never attempted is missed, for this reason.
    pub(crate) fn miss_the_rest(&mut self, reason: &str) -> Result<(), ControllerError> {
        for i in 0..self.fates.len() {
            if self.fates[i] == Fate::Planned {
                let attempt = self.next_attempt(PressId::from_index(i as u32));
                self.emit(Record::Missed(attempt, reason.to_owned()))?;
                self.fates[i] = Fate::Missed;
            }
        }
        Ok(())
    }

    /// The presses that are valid.
    pub(crate) fn valid(&self) -> Vec<PressId> {
        let fates = self.fates.iter().zip(0..);
        fates
            .filter(|(f, _)| **f == Fate::Valid)
            .map(|(_, i)| PressId::from_index(i))
            .collect()
    }

    /// Presses planned, valid, invalid, missed.
    pub(crate) fn counts(&self) -> [usize; 4] {
        let n = |fate| self.fates.iter().filter(|f| **f == fate).count();
        [
            self.fates.len(),
            n(Fate::Valid),
            // A press whose intent stands without outcome is not valid.
            n(Fate::Invalid) + n(Fate::Under),
            n(Fate::Missed),
        ]
    }
}

/// Whether a record is certainly not in the session: one that is late may come there yet, and must not be followed by another of its kind.
pub(crate) const fn was_refused(told: &Result<(), ControllerError>) -> bool {
    matches!(told, Err(ControllerError::Sink(SinkFault::Refused(_))))
}
