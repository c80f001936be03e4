//! Passes records to the sink and keeps the tally: every planned press ends with exactly one outcome. Buffers pose samples.

use std::panic::{AssertUnwindSafe, catch_unwind};

use skinrig_model::{
    AttemptId, CameraId, HostDuration, HostTime, MissedReason, PoseSample, PressHistory, PressId,
    PressOutcome, PressVerdict, Record, RunFault, SinkFault,
};

use crate::error::Problem;
use crate::settings::ControllerSettings;
use crate::sink::RecordSink;

/// State of a planned press.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum PressState {
    Planned,
    InProgress,
    Valid,
    Invalid,
    Missed,
}

/// The sink and the tally of presses.
pub(crate) struct Journal<'a> {
    sink: &'a mut dyn RecordSink,
    states: Vec<PressState>,
    /// Attempts at each press so far, including earlier legs.
    attempts: Vec<u32>,
    /// Pose samples not yet emitted.
    poses: Vec<PoseSample>,
    /// Pose samples per record.
    pose_block: usize,
    /// Time of the last check of the sink.
    checked: HostTime,
    check_every: HostDuration,
    /// True during the end of the run: failures of the sink, the cameras or the trigger box no longer interrupt it.
    is_ending: bool,
    /// Problems during the end of the run.
    problems: Vec<Problem>,
}

impl<'a> Journal<'a> {
    pub(crate) fn new(
        sink: &'a mut dyn RecordSink,
        presses: usize,
        settings: &ControllerSettings,
    ) -> Self {
        Self {
            sink,
            states: vec![PressState::Planned; presses],
            attempts: vec![0; presses],
            poses: Vec::new(),
            pose_block: settings.pose_block,
            checked: HostTime::ZERO,
            check_every: settings.check_sink_every,
            is_ending: false,
            problems: Vec::new(),
        }
    }

    /// Restores the tally from earlier legs, one history per planned press.
    pub(crate) fn restore(&mut self, histories: &[PressHistory]) {
        for (i, history) in histories.iter().enumerate().take(self.states.len()) {
            self.attempts[i] = history.attempts;
            self.states[i] = match &history.verdict {
                _ if history.attempts == 0 => PressState::Planned,
                Some(PressVerdict::Valid | PressVerdict::Excluded(_)) => PressState::Valid,
                Some(PressVerdict::Missed(_)) => PressState::Missed,
                // An interrupted attempt is already invalid.
                Some(PressVerdict::Invalid(_)) | None => PressState::Invalid,
            };
        }
    }

    /// Identifier of the next attempt at `press`.
    pub(crate) fn next_attempt(&self, press: PressId) -> AttemptId {
        let before = self.attempts.get(press.index() as usize).copied();
        AttemptId {
            press,
            number: before.unwrap_or(0) + 1,
        }
    }

    /// See [`RecordSink::wants_newest`].
    pub(crate) fn wants_newest(&mut self) -> Option<usize> {
        self.sink.wants_newest()
    }

    /// See [`RecordSink::newest`].
    pub(crate) fn newest(&mut self, camera: CameraId, bytes: Vec<u8>) {
        self.sink.newest(camera, bytes);
    }

    /// Free space of the sink in bytes, if known.
    pub(crate) fn free_bytes(&mut self) -> Option<u64> {
        self.sink.free_bytes()
    }

    /// Regularly checks that the records are still where they were written.
    pub(crate) fn check(&mut self, now: HostTime) -> Result<(), RunFault> {
        if now - self.checked < self.check_every {
            return Ok(());
        }
        self.checked = now;
        Ok(self.sink.check()?)
    }

    /// From now on no failure of the sink interrupts the end of the run.
    pub(crate) const fn begin_ending(&mut self) {
        self.is_ending = true;
    }

    /// True during the end of the run: failures become problems.
    pub(crate) const fn is_ending(&self) -> bool {
        self.is_ending
    }

    /// Problems during the end of the run.
    pub(crate) fn problems(&self) -> &[Problem] {
        &self.problems
    }

    /// Takes the problems during the end of the run.
    pub(crate) fn take_problems(&mut self) -> Vec<Problem> {
        std::mem::take(&mut self.problems)
    }

    pub(crate) fn problem(&mut self, doing: &'static str, error: impl Into<RunFault>) {
        let problem = Problem {
            doing,
            error: error.into(),
        };
        if !self.problems.contains(&problem) {
            self.problems.push(problem);
        }
    }

    /// Emits a record. During the end of the run a failure becomes a problem instead of an error.
    pub(crate) fn emit(&mut self, record: Record) -> Result<(), RunFault> {
        if !self.is_ending {
            return Ok(self.sink.accept(record)?);
        }
        match catch_unwind(AssertUnwindSafe(|| self.sink.accept(record))) {
            Ok(Ok(())) => {}
            Ok(Err(fault)) => self.problem("", fault),
            Err(_) => self.problem("", SinkFault::Rejected("panicked".to_owned())),
        }
        Ok(())
    }

    /// Emits a note.
    pub(crate) fn note(&mut self, t: HostTime, text: String) -> Result<(), RunFault> {
        self.emit(Record::Note { t, text })
    }

    /// Buffers pose samples; emits them once a block is full.
    pub(crate) fn add_poses(&mut self, samples: &[PoseSample]) -> Result<(), RunFault> {
        self.poses.extend_from_slice(samples);
        if self.poses.len() >= self.pose_block {
            self.emit_poses()?;
        }
        Ok(())
    }

    /// Emits all buffered samples.
    pub(crate) fn emit_poses(&mut self) -> Result<(), RunFault> {
        if self.poses.is_empty() {
            return Ok(());
        }
        let block = std::mem::take(&mut self.poses);
        self.emit(Record::Poses(block))
    }

    fn set(&mut self, press: PressId, state: PressState) {
        if let Some(f) = self.states.get_mut(press.index() as usize) {
            *f = state;
        }
    }

    /// Starts an attempt: its intent is durable on return.
    pub(crate) fn intent(&mut self, attempt: AttemptId, t: HostTime) -> Result<(), RunFault> {
        let emitted = self.emit(Record::Intent { attempt, t });
        if !was_rejected(&emitted) {
            if let Some(attempts) = self.attempts.get_mut(attempt.press.index() as usize) {
                *attempts = attempt.number;
            }
            self.set(attempt.press, PressState::InProgress);
        }
        emitted
    }

    /// Ends an attempt.
    pub(crate) fn outcome(&mut self, outcome: PressOutcome) -> Result<(), RunFault> {
        let state = match outcome.verdict {
            PressVerdict::Valid => PressState::Valid,
            _ => PressState::Invalid,
        };
        let press = outcome.attempt.press;
        let emitted = self.emit(Record::Outcome(outcome));
        if !was_rejected(&emitted) {
            self.set(press, state);
        }
        emitted
    }

    /// Marks every press that was never attempted as missed.
    pub(crate) fn miss_the_rest(&mut self, reason: &MissedReason) -> Result<(), RunFault> {
        for i in 0..self.states.len() {
            if self.states[i] == PressState::Planned {
                let attempt = self.next_attempt(PressId::from_index(i as u32));
                self.emit(Record::Missed(attempt, reason.clone()))?;
                self.states[i] = PressState::Missed;
            }
        }
        Ok(())
    }

    /// The valid presses.
    pub(crate) fn valid(&self) -> Vec<PressId> {
        let states = self.states.iter().zip(0..);
        states
            .filter(|(f, _)| **f == PressState::Valid)
            .map(|(_, i)| PressId::from_index(i))
            .collect()
    }

    /// Numbers of presses: planned, valid, invalid, missed.
    pub(crate) fn counts(&self) -> [usize; 4] {
        let n = |state| self.states.iter().filter(|f| **f == state).count();
        [
            self.states.len(),
            n(PressState::Valid),
            // An intent without an outcome is not valid.
            n(PressState::Invalid) + n(PressState::InProgress),
            n(PressState::Missed),
        ]
    }
}

/// Whether a record is certainly not in the session. A late one may still arrive there, and must not be followed by another of its kind.
pub(crate) const fn was_rejected(result: &Result<(), RunFault>) -> bool {
    matches!(result, Err(RunFault::Sink(SinkFault::Rejected(_))))
}
