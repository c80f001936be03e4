//! Takes a run's records: writes them to the session file, then updates the terminal.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use skinrig_controller::{ControlHandle, RecordSink, RunReport, SinkFault};
use skinrig_model::{
    CameraId, ExcludedReason, HostTime, InterruptionKind, PressId, PressOutcome, PressTiming,
    PressVerdict, Record,
};
use skinrig_protocol::PlantedFault;
use skinrig_recorder::{RecorderError, SealedSession, SessionWriter};

use crate::fault::FaultInjector;
use crate::notify::{self, RunMessages};
use crate::progress::ProgressView;
use crate::remote::Remote;
use crate::rig::gates;

/// Facts about presses that no device provides, but an import or its replay does.
#[derive(Debug, Clone, Default)]
pub(crate) struct ReplayExpectations {
    /// Times and positions come from a schedule; nothing was measured.
    pub scheduled: bool,
    /// Exact times of each scheduled press, relative to the start of its attempt. The controller samples poses at intervals,
    /// which is less exact.
    pub timings: BTreeMap<PressId, PressTiming>,
    /// Excluded presses, each with its rule.
    pub excluded: BTreeMap<PressId, ExcludedReason>,
    /// When and how the operator ended the recorded run.
    pub interruption: Option<(HostTime, InterruptionKind)>,
}

impl ReplayExpectations {
    /// Completes the outcome of an attempt that began at `begun` with these facts.
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

/// Printed once if the seal has to wait.
pub(crate) const HELD_OPEN: &str = "note: another program has the session open; waiting for it, to seal the session (60 s at most)";

/// Writes every record to the session file and shows progress.
pub(crate) struct SessionSink {
    writer: SessionWriter,
    view: ProgressView,
    known: ReplayExpectations,
    /// Start of the current attempt.
    begun: HostTime,
    /// Folder of the session, if its free space is monitored.
    folder: Option<PathBuf>,
    /// Notes to write once the leg has begun.
    notes: Vec<String>,
    fault_injector: FaultInjector,
    /// Messages about the end of the run.
    messages: Option<RunMessages>,
    /// Control from other terminals; dropped last, when the session is closed.
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
            messages: None,
            remote: None,
        }
    }

    /// Reports the free space of `folder` on request.
    #[must_use]
    pub(crate) fn on_disk_of(mut self, folder: &Path) -> Self {
        self.folder = Some(folder.to_owned());
        self
    }

    /// Writes these notes right after the first record.
    #[must_use]
    pub(crate) fn with_notes(mut self, notes: Vec<String>) -> Self {
        self.notes = notes;
        self
    }

    /// Accepts requests from other terminals for `session`, of a run that `feels` touches or not. If that fails, the run continues
    /// with a warning.
    #[must_use]
    pub(crate) fn controlled(
        mut self,
        session: &Path,
        control: &ControlHandle,
        feels: bool,
    ) -> Self {
        match Remote::open(session, control, feels) {
            Ok(remote) => self.remote = Some(remote),
            Err(why) => self.view.print(&format!(
                "warning: this run cannot be controlled from other terminals ({why}); ctrl-C works"
            )),
        }
        self
    }

    /// Injects faults.
    #[must_use]
    pub(crate) fn with_faults(mut self, fault_injector: FaultInjector) -> Self {
        self.fault_injector = fault_injector;
        self
    }

    /// The injected faults that did not occur in this run, which is over.
    #[must_use]
    pub(crate) fn faults_never_struck(&self) -> Vec<PlantedFault> {
        self.fault_injector.never_struck()
    }

    /// Sends messages about the end of the run.
    #[must_use]
    pub(crate) fn notifying(mut self, messages: Option<RunMessages>) -> Self {
        self.messages = messages;
        self
    }

    /// Sends messages about the end of the run in `session`, and records the results.
    pub(crate) fn notify(&mut self, report: &RunReport, session: &Path) {
        let Some(messages) = self.messages.take() else {
            return;
        };
        for notification in messages.send(report, session) {
            self.view.print(&notify::line(&notification));
            let record = Record::Notification(Box::new(notification));
            if let Err(e) = self.writer.accept(record) {
                self.view
                    .print(&format!("warning: the session does not record this: {e}"));
            }
        }
    }

    /// Seals the session.
    ///
    /// # Errors
    /// [`RecorderError`]; the session stays readable.
    pub(crate) fn seal(mut self) -> Result<SealedSession, RecorderError> {
        self.view.finish();
        self.fault_injector.before_the_seal()?;
        self.writer.finish_with_notice(|| errln!("{HELD_OPEN}"))
    }
}

impl SessionSink {
    /// Adds a note if the run had to wait for the disk, because data loss is likely then.
    fn note_waits(&mut self, t: HostTime) -> Result<(), SinkFault> {
        let load = self.writer.load();
        if load.waits == 0 {
            return Ok(());
        }
        let mb = |bytes: usize| bytes as f64 / 1e6;
        let text = format!(
            "recorder: expected room for every record, found none {} times: up to {:.1} of {:.1} MB waited for the disk, so did \
            the run and data in the drivers; their losses are counted per camera",
            load.waits,
            mb(load.most_bytes),
            mb(load.limit_bytes)
        );
        self.view.print(&format!("note: {text}"));
        let note = self.writer.accept(Record::Note { t, text });
        note.map_err(|e| fault_of(&e))
    }
}

/// The recorder's error as a fault for the controller.
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

    fn wants_newest(&mut self) -> Option<usize> {
        self.remote.as_ref()?.wants_newest()
    }

    fn newest(&mut self, camera: CameraId, bytes: Vec<u8>) {
        if let Some(remote) = &self.remote {
            remote.show_newest(camera, bytes);
        }
    }

    fn accept(&mut self, mut record: Record) -> Result<(), SinkFault> {
        match &mut record {
            Record::Intent { t, .. } => self.begun = *t,
            Record::Outcome(outcome) => self.known.complete(outcome, self.begun),
            _ => {}
        }
        if let Record::Preflight(checks) = &record {
            self.view.print(&gates::report(checks));
        }
        self.fault_injector.before(&record)?;
        if let Record::Ended { t, .. } = &record {
            self.note_waits(*t)?;
        }
        // Show a record only after it is on the disk. Bulk data, which are expensive to copy, are only counted.
        let is_bulk = matches!(&record, Record::Chunk(_) | Record::Poses(_));
        if let (Some(remote), Record::Chunk(chunk)) = (&self.remote, &record) {
            remote.show_chunk(chunk);
        }
        let shown = if is_bulk {
            self.view.update(&record);
            None
        } else {
            Some(record.clone())
        };
        self.writer.accept(record).map_err(|e| fault_of(&e))?;
        if let Some(record) = &shown {
            self.view.update(record);
        }
        match (&self.remote, shown) {
            (Some(remote), Some(Record::Touch(touch))) => remote.show_touch(&touch),
            (Some(remote), Some(Record::Ended { .. })) => remote.end_touches(),
            _ => {}
        }
        if let Some(remote) = &mut self.remote {
            remote.show(self.view.progress(), is_bulk);
        }
        for text in std::mem::take(&mut self.notes) {
            self.view.print(&format!("note: {text}"));
            let t = HostTime::ZERO;
            let note = self.writer.accept(Record::Note { t, text });
            note.map_err(|e| fault_of(&e))?;
        }
        Ok(())
    }
}
