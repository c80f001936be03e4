//! The writing handle of a session: accepts records in order and never drops one.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use sha2::{Digest, Sha256};
use skinrig_model::{Record, ResumeHeader, RunHeader};
use sqlx::sqlite::SqliteConnection;
use tokio::runtime::Runtime;

use crate::close_result::{CloseResult, SealedSession};
use crate::error::{RecorderError, RescueError, WriteFailure};
use crate::hex::hex;
use crate::insert::Journal;
use crate::leg::LegOffset;
use crate::lock::WriterLock;
use crate::prepare::Preparer;
use crate::queue::{CloseMode, QueueLoad, Shared};
use crate::verify::ChunkScanner;
use crate::worker::Worker;
use crate::{prepare, resume, schema, sidecar};

/// Writes one session file.
///
/// Two threads work for it: one checks, hashes and folds camera bytes, the other owns the file. If it is dropped without
/// [`finish`](Self::finish), all accepted records are committed and the session stays readable but unsealed. Do not use it on a thread
/// that runs async tasks.
#[derive(Debug)]
pub struct SessionWriter {
    path: PathBuf,
    shared: Arc<Shared>,
    /// The preparation thread and the writer thread.
    threads: Option<(JoinHandle<()>, WriterThread)>,
    phase: Phase,
    /// Offsets of a further leg; zero in the first.
    offset: LegOffset,
    /// Last field: fields are dropped in order after `drop`, and the lock goes last.
    lock: WriterLock,
}

/// Interval at which `finish` checks whether the session is sealed.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

type WriterThread = JoinHandle<Option<CloseResult>>;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    New,
    Resuming,
    Started,
    Ended,
}

impl SessionWriter {
    /// Creates a session file. Its folder must exist.
    ///
    /// # Errors
    /// [`RecorderError::Exists`] if the file exists; [`RecorderError::Io`] and [`RecorderError::Sql`] if it cannot be
    /// created.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, RecorderError> {
        let path = path.as_ref().to_owned();
        let runtime = runtime(&path)?;
        sidecar::reject_special_files(&path)?;
        // Lock before creating the file: a visible file is always locked.
        let exists = || RecorderError::Exists { path: path.clone() };
        if path.exists() {
            return Err(exists());
        }
        let mut lock = WriterLock::take(&path).map_err(|e| match e {
            RecorderError::InUse { .. } => exists(),
            other => other,
        })?;
        schema::create_file(&path)?;
        lock.take_file()?;
        let conn = runtime.block_on(schema::create_schema(&path))?;
        lock.take_log()?;
        let mut writer = Self::locked(path, lock, Phase::New);
        writer.start(runtime, conn, Preparer::default(), 1)?;
        Ok(writer)
    }

    /// Opens an interrupted, stopped or faulted session to continue it in a further leg. The whole session is verified first, as by
    /// [`verify`](crate::verify()). Nothing in the file changes before the first record, which is [`Record::Resumed`]: one durable
    /// transaction then removes the seal, gives interrupted attempts their verdict and migrates the schema. Times and chunk numbers
    /// of the leg may start at zero: they are moved behind the existing ones.
    ///
    /// # Errors
    /// [`RecorderError::InUse`] while another process writes the session; [`RecorderError::AlreadyCompleted`] if there is nothing to
    /// resume; [`RecorderError::Unsound`] if [`verify`](crate::verify()) finds a problem; [`RecorderError::Empty`] without a
    /// header; or a read error.
    pub fn resume<S: ChunkScanner>(path: impl AsRef<Path>) -> Result<Self, RecorderError> {
        let path = path.as_ref().to_owned();
        let lock = resume::lock_unfinished::<S>(&path)?;
        Ok(Self::locked(path, lock, Phase::Resuming))
    }

    /// Opens a session whose end is recorded but whose seal is missing: only [`finish`](Self::finish) remains to be called.
    ///
    /// # Errors
    /// [`RecorderError::InUse`] while another process writes the session; [`RecorderError::AlreadyCompleted`] if it is sealed;
    /// [`RecorderError::NotFound`] without an end; [`RecorderError::Unsound`] if [`verify`](crate::verify()) finds a problem;
    /// or a read error.
    pub fn open_ended<S: ChunkScanner>(path: impl AsRef<Path>) -> Result<Self, RecorderError> {
        let path = path.as_ref().to_owned();
        let mut lock = resume::lock_unsealed::<S>(&path)?;
        let runtime = runtime(&path)?;
        let conn = runtime.block_on(resume::reopen(&path))?;
        lock.take_log()?;
        let mut writer = Self::locked(path, lock, Phase::Ended);
        writer.start(runtime, conn, Preparer::default(), 1)?;
        Ok(writer)
    }

    /// A writer whose threads are not yet running.
    fn locked(path: PathBuf, lock: WriterLock, phase: Phase) -> Self {
        Self {
            path,
            shared: Arc::new(Shared::default()),
            threads: None,
            phase,
            offset: LegOffset::default(),
            lock,
        }
    }

    /// Starts both threads on an open file.
    fn start(
        &mut self,
        runtime: Runtime,
        conn: SqliteConnection,
        preparer: Preparer,
        leg: u32,
    ) -> Result<(), RecorderError> {
        let worker = Worker {
            runtime,
            journal: Journal::new(self.path.clone(), conn, leg),
            shared: Arc::clone(&self.shared),
        };
        let io = |e| starting(&self.path, e);
        let named = |name: &str| std::thread::Builder::new().name(name.to_owned());
        let records = Arc::clone(&self.shared);
        let preparing = named("recorder-prepare")
            .spawn(move || prepare::run(&records, preparer))
            .map_err(io)?;
        let writing = named("recorder").spawn(move || worker.run()).map_err(|e| {
            self.shared.close(CloseMode::Unsealed);
            io(e)
        })?;
        self.threads = Some((preparing, writing));
        Ok(())
    }

    /// Writes the start of a further leg; it is durable on return.
    fn begin_leg(&mut self, header: &ResumeHeader) -> Result<(), RecorderError> {
        let runtime = runtime(&self.path)?;
        let (conn, leg) = runtime.block_on(resume::begin(&self.path, header))?;
        self.lock.take_log()?;
        self.offset = leg.offset;
        let preparer = Preparer::resuming(leg.formats, leg.offset.first_seq);
        self.start(runtime, conn, preparer, leg.number)
    }

    /// The session file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Load of the record queue.
    #[must_use]
    pub fn load(&self) -> QueueLoad {
        self.shared.load()
    }

    /// Accepts one record. `Started`, `Resumed`, `Intent`, `Outcome` and `Ended` return when they and all earlier records
    /// are on disk. Others return at once, or block while 64 MiB of records are queued. No call blocks for more than 30 s.
    ///
    /// The first record is `Started`, or `Resumed` in a further leg; the last is `Ended`, except for `Notification`. An `Outcome` must follow its `Intent`.
    ///
    /// # Errors
    /// [`RecorderError::Record`] for a record out of order, or a header whose digests do not match its texts: nothing of it is
    /// written, and the session continues. [`RecorderError::WriteFailed`] if this or an earlier record could not be written, and from then
    /// on always. [`RecorderError::WriteTimeout`] if this record was accepted but may not be on disk.
    pub fn accept(&mut self, record: Record) -> Result<(), RecorderError> {
        let next = self.next_phase(&record)?;
        if let Record::Resumed(header) = &record {
            self.begin_leg(header)?;
        } else {
            let record = self.offset.apply(record)?;
            match self.shared.accept(record) {
                Ok(()) => {}
                Err(late @ RecorderError::WriteTimeout(_)) => {
                    self.phase = next; // the record was accepted
                    return Err(late);
                }
                Err(refused) => return Err(refused),
            }
        }
        self.phase = next;
        Ok(())
    }

    fn next_phase(&self, record: &Record) -> Result<Phase, RecorderError> {
        let out_of_order = |expected: &str, found: &str| {
            Err(RecorderError::Record {
                record: "order of records".into(),
                expected: expected.into(),
                found: found.into(),
            })
        };
        match (self.phase, record) {
            (Phase::New, Record::Started(header)) => {
                check_digests(header)?;
                Ok(Phase::Started)
            }
            (Phase::Resuming, Record::Resumed(_)) => Ok(Phase::Started),
            (Phase::New, _) => out_of_order("the run's header first", "another record"),
            (Phase::Resuming, _) => out_of_order("the leg's header first", "another record"),
            (Phase::Started, Record::Started(_) | Record::Resumed(_)) => {
                out_of_order("one header", "a second one")
            }
            (Phase::Started, Record::Ended { .. }) => Ok(Phase::Ended),
            (Phase::Started, _) => Ok(Phase::Started),
            (Phase::Ended, Record::Notification(_)) => Ok(Phase::Ended),
            (Phase::Ended, _) => out_of_order("no records after the end of the run", "a record"),
        }
    }

    /// Sets how long [`finish`](Self::finish) waits for other programs that have the session open; 60 s by default. New readers
    /// of this version of skinrig wait meanwhile.
    pub fn set_seal_timeout(&mut self, timeout: Duration) {
        self.shared.set_seal_timeout(timeout);
    }

    /// Commits, writes the seal (final counts, tree hash, file hash), removes the log and makes the file read-only.
    ///
    /// # Errors
    /// [`RecorderError::Unsealable`] before `Ended` and while a planned press has no verdict; [`RecorderError::HeldOpen`] if another
    /// program kept the session open for too long; [`RecorderError::WriteFailed`] after a failed write. The session then stays
    /// readable and unsealed.
    pub fn finish(self) -> Result<SealedSession, RecorderError> {
        self.finish_with_notice(|| {})
    }

    /// Like [`finish`](Self::finish); calls `on_wait` once if it has to wait for another program.
    ///
    /// # Errors
    /// As [`finish`](Self::finish).
    pub fn finish_with_notice(
        mut self,
        on_wait: impl FnOnce(),
    ) -> Result<SealedSession, RecorderError> {
        if self.threads.is_none() {
            return Err(RecorderError::Unsealable {
                path: self.path.clone(),
                expected: "the end of the run as the last record".into(),
                found: "a leg without records".into(),
            });
        }
        if let Err(displaced) = self.check() {
            return Err(self.rescue(displaced));
        }
        if let Some(failure) = self.shared.failure() {
            return Err(RecorderError::WriteFailed(failure));
        }
        self.lock.announce_sealing();
        self.lock.forget_log();
        self.shared.close(CloseMode::Seal);
        let mut on_wait = Some(on_wait);
        while self.threads.as_ref().is_some_and(|(_, w)| !w.is_finished()) {
            if self.shared.is_held_open()
                && let Some(on_wait) = on_wait.take()
            {
                on_wait();
            }
            std::thread::sleep(POLL_INTERVAL);
        }
        let sealed = match self.close(CloseMode::Seal) {
            Some(CloseResult::Sealed(sealed)) => sealed,
            _ => Err(RecorderError::WriteFailed(self.failure())),
        };
        self.lock.withdraw_sealing();
        // Sealing failed because the file disappeared; it is closed and has no log.
        if let (Err(_), Err(displaced)) = (&sealed, self.check()) {
            let targets = self.lock.rescue_targets();
            let saved = targets
                .current_path
                .map_or_else(|| self.lock.copy(&targets.copies), Ok);
            return Err(rescued(displaced, saved));
        }
        sealed
    }

    /// Checks that the session files are still where they were opened; records go to the open file regardless of its name. Call it
    /// regularly during a run, and end the run if it fails: [`finish`](Self::finish) then saves all records, including the end of the
    /// run, in a file that can be found.
    ///
    /// # Errors
    /// [`RecorderError::Displaced`].
    pub fn check(&self) -> Result<(), RecorderError> {
        self.lock.check()
    }

    /// Saves the records in a file that can be found; returns an error that names it.
    fn rescue(&mut self, displaced: RecorderError) -> RecorderError {
        let saved = match self.close(CloseMode::Rescue(self.lock.rescue_targets())) {
            Some(CloseResult::Rescued(saved)) => saved,
            _ => Err(RescueError::Writer(self.failure())),
        };
        if saved.is_ok() {
            self.lock.remove_log_files();
        }
        rescued(displaced, saved)
    }

    fn failure(&self) -> WriteFailure {
        let failure = self.shared.failure();
        failure.unwrap_or(WriteFailure::WriterExited)
    }

    fn close(&mut self, mode: CloseMode) -> Option<CloseResult> {
        let (preparing, writing) = self.threads.take()?;
        self.shared.close(mode);
        // After a panic of the preparation thread, the writer thread leaves an unsealed session.
        let _ = preparing.join();
        writing.join().ok().flatten()
    }
}

/// Error for a session that was moved or removed during the run.
fn rescued(displaced: RecorderError, saved: Result<PathBuf, RescueError>) -> RecorderError {
    let displaced = Box::new(displaced);
    match saved {
        Ok(to) => RecorderError::Rescued { displaced, to },
        Err(reason) => RecorderError::Lost { displaced, reason },
    }
}

impl Drop for SessionWriter {
    fn drop(&mut self) {
        self.close(CloseMode::Unsealed);
    }
}

/// Async runtime of a session's connections.
fn runtime(path: &Path) -> Result<Runtime, RecorderError> {
    tokio::runtime::Builder::new_current_thread()
        .build()
        .map_err(|e| starting(path, e))
}

fn starting(path: &Path, source: std::io::Error) -> RecorderError {
    RecorderError::Io {
        path: path.to_owned(),
        doing: "starting the recorder thread",
        source,
    }
}

fn check_digests(header: &RunHeader) -> Result<(), RecorderError> {
    for (record, text, digest) in [
        (
            "protocol_sha256",
            &header.protocol_text,
            &header.protocol_sha256,
        ),
        ("plan_sha256", &header.plan_json, &header.plan_sha256),
    ] {
        let expected = hex(&Sha256::digest(text.as_bytes()));
        if expected != *digest {
            return Err(RecorderError::Record {
                record: record.into(),
                expected: format!("{expected}, the SHA-256 of the text"),
                found: digest.clone(),
            });
        }
    }
    Ok(())
}
