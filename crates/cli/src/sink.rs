//! The consumer of a run's records: the session file first, then the terminal.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use skinrig_controller::{ControlHandle, RecordSink, SinkFault};
use skinrig_model::{
    HostTime, InterruptionKind, PressId, PressOutcome, PressTiming, PressVerdict, Record,
};
use skinrig_recorder::{RecorderError, Sealed, SessionWriter};

use crate::fault::FaultInjector;
use crate::progress::ProgressView;
use crate::remote::Remote;
use crate::rig::gates;

/// What the rig cannot know about its presses, but an import or the replay of one can.
#[derive(Debug, Clone, Default)]
pub(crate) struct ReplayExpectations {
    /// Times and positions come from a schedule; nothing was measured.
    pub scheduled: bool,
    /// When each scheduled press happens, each moment as the time since its attempt began. The controller sees its poses
    /// at intervals; a schedule is exact.
    pub timings: BTreeMap<PressId, PressTiming>,
    /// Presses that are left out, with the rule that says so.
    pub excluded: BTreeMap<PressId, String>,
    /// When and how the operator ended the recorded run.
    pub interruption: Option<(HostTime, InterruptionKind)>,
}

impl ReplayExpectations {
    /// Adds to the outcome of an attempt that began at `begun` what no device can say.
    fn complete(&self, outcome: &mut PressOutcome, begun: HostTime) {
        outcome.scheduled |= self.scheduled;
        let scheduled = self.timings.get(&outcome.attempt.press);
        if let (Some(timing), Some(scheduled)) = (&mut outcome.timing, scheduled) {
            *timing = scheduled.after(begun - HostTime::ZERO);
        }
        let rule = self.excluded.get(&outcome.attempt.press);
        if let (PressVerdict::Valid, Some(rule)) = (&outcome.verdict, rule) {
            outcome.verdict = PressVerdict::Excluded(rule.clone());
        }
    }
}

/// Told once when the seal has to wait.
pub(crate) const HELD_OPEN: &str = "note: another program has the session open; waiting for it, to seal the session (60 s at most)";

/// Writes every record to the session file and shows it.
pub(crate) struct SessionSink {
    writer: SessionWriter,
    view: ProgressView,
    known: ReplayExpectations,
    /// When the present attempt began.
    begun: HostTime,
    /// Where the session lies, when its free space matters.
    folder: Option<PathBuf>,
    /// Remarks to be written once the leg has begun.
    notes: Vec<String>,
    fault_injector: FaultInjector,
    /// The hand on the run from other terminals; goes away last, when the session is closed.
    remote: Option<Remote>,
}

impl SessionSink {
    /// A sink over a new session.
    #[must_use]
    pub(crate) fn new(
        writer: SessionWriter,
        view: ProgressView,
        known: ReplayExpectations,
    ) -> Self {
        Self {
            writer,
            view,
            known,
            begun: HostTime::ZERO,
            folder: None,
            notes: Vec::new(),
            fault_injector: FaultInjector::default(),
            remote: None,
        }
    }

    /// Tells the free space of `folder` when it is asked for.
    #[must_use]
    pub(crate) fn on_disk_of(mut self, folder: &Path) -> Self {
        self.folder = Some(folder.to_owned());
        self
    }

    /// Writes these remarks right after the first record.
    #[must_use]
    pub(crate) fn with_notes(mut self, notes: Vec<String>) -> Self {
        self.notes = notes;
        self
    }

    /// Listens to other terminals for the session at `session`. A run that cannot goes on, and says so.
    #[must_use]
    pub(crate) fn controlled(mut self, session: &Path, control: &ControlHandle) -> Self {
        match Remote::open(session, control) {
            Ok(remote) => self.remote = Some(remote),
            Err(why) => self.view.say(&format!(
                "warning: this run does not listen to other terminals ({why}); ctrl-C works"
            )),
        }
        self
    }

    /// With faults on purpose.
    #[must_use]
    pub(crate) fn with_faults(mut self, fault_injector: FaultInjector) -> Self {
        self.fault_injector = fault_injector;
        self
    }

    /// Seals the session.
    ///
    /// # Errors
    /// [`RecorderError`]; the session stays readable.
    pub(crate) fn seal(mut self) -> Result<Sealed, RecorderError> {
        self.view.finish();
        self.fault_injector.before_the_seal()?;
        self.writer.finish_with_notice(|| errln!("{HELD_OPEN}"))
    }
}

impl SessionSink {
    /// Remarks that the run had to wait for the disk, which is where data are lost next.
    fn tell_waits(&mut self, t: HostTime) -> Result<(), SinkFault> {
        let load = self.writer.load();
        if load.waits == 0 {
            return Ok(());
        }
        let mb = |bytes: usize| bytes as f64 / 1e6;
        let text = format!(
            "recorder: expected room for every record, found none {} times: up to {:.1} of {:.1} MB waited for the disk, the run \
             waited too, and data in the drivers; what they lost is counted per camera",
            load.waits,
            mb(load.most_bytes),
            mb(load.limit_bytes)
        );
        self.view.say(&format!("note: {text}"));
        let note = self.writer.accept(Record::Note { t, text });
        note.map_err(|e| fault_of(&e))
    }
}

/// What an error of the recorder means to the controller.
#[must_use]
pub fn fault_of(error: &RecorderError) -> SinkFault {
    match error {
        RecorderError::WriteTimeout(_) => SinkFault::Delayed(error.to_string()),
        _ => SinkFault::Rejected(error.to_string()),
    }
}

impl RecordSink for SessionSink {
    fn check(&mut self) -> Result<(), SinkFault> {
        self.writer.check().map_err(|e| fault_of(&e))
    }

    fn free_bytes(&mut self) -> Option<u64> {
        let free_b = gates::free_bytes(self.folder.as_deref()?).ok()?;
        Some(free_b as u64)
    }

    fn accept(&mut self, mut record: Record) -> Result<(), SinkFault> {
        match &mut record {
            Record::Intent { t, .. } => self.begun = *t,
            Record::Outcome(outcome) => self.known.complete(outcome, self.begun),
            _ => {}
        }
        if let Record::Preflight(checks) = &record {
            self.view.say(&gates::report(checks));
        }
        self.fault_injector.before(&record)?;
        if let Record::Ended { t, .. } = &record {
            self.tell_waits(*t)?;
        }
        // What is shown as done is on the disk. Bulk data, whose copy would cost, are only counted.
        let is_bulk = matches!(&record, Record::Chunk(_) | Record::Poses(_));
        let shown = if is_bulk {
            self.view.update(&record);
            None
        } else {
            Some(record.clone())
        };
        self.writer.accept(record).map_err(|e| fault_of(&e))?;
        if let Some(record) = shown {
            self.view.update(&record);
        }
        if let Some(remote) = &mut self.remote {
            remote.show(self.view.progress(), is_bulk);
        }
        for text in std::mem::take(&mut self.notes) {
            self.view.say(&format!("note: {text}"));
            let t = HostTime::ZERO;
            let note = self.writer.accept(Record::Note { t, text });
            note.map_err(|e| fault_of(&e))?;
        }
        Ok(())
    }
}
