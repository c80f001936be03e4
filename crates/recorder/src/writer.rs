//! The writing handle: records in, in order, never dropped.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use sha2::{Digest, Sha256};
use skinrig_model::{Record, ResumeHeader, RunHeader};
use sqlx::sqlite::SqliteConnection;
use tokio::runtime::Runtime;

use crate::error::RecorderError;
use crate::hex::hex;
use crate::insert::Journal;
use crate::left::{Left, Sealed};
use crate::leg::Joint;
use crate::lock::WriterLock;
use crate::prepare::Preparer;
use crate::queue::{Close, QueueLoad, Shared};
use crate::verify::ChunkScanner;
use crate::worker::Worker;
use crate::{beside, prepare, resume, schema};

/// Writes one session file.
///
/// Two threads of its own work for it: one checks, hashes and folds camera bytes, the next owns the file. Dropped without [`finish`](Self::finish), everything accepted is
/// committed and a readable, unsealed session stays behind. Not to be used on a thread that runs async tasks.
#[derive(Debug)]
pub struct SessionWriter {
    path: PathBuf,
    shared: Arc<Shared>,
    /// The preparing and the writing one.
    threads: Option<(JoinHandle<()>, Written)>,
    phase: Phase,
    /// Of a further leg; nothing moves in the first.
    joint: Joint,
    /// Given back when everything else is done: fields are dropped in their order, after `drop`.
    lock: WriterLock,
}

/// Between two looks whether the session is sealed.
const LOOK_AGAIN: Duration = Duration::from_millis(5);

type Written = JoinHandle<Option<Left>>;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    New,
    Resuming,
    Started,
    Ended,
}

impl SessionWriter {
    /// Makes a new session file. Its folder must exist.
    ///
    /// # Errors
    /// [`RecorderError::Exists`] when there is a file of that name; [`RecorderError::Io`] and
    /// [`RecorderError::Sql`] when it cannot be made.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, RecorderError> {
        let path = path.as_ref().to_owned();
        let runtime = runtime(&path)?;
        beside::refuse_special_files(&path)?;
        // The lock before the file: whoever sees the file sees that somebody writes it.
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
        let conn = runtime.block_on(schema::fill(&path))?;
        lock.take_log()?;
        let mut writer = Self {
            lock,
            path,
            shared: Arc::new(Shared::default()),
            threads: None,
            phase: Phase::New,
            joint: Joint::default(),
        };
        writer.start(runtime, conn, Preparer::default(), 1)?;
        Ok(writer)
    }

    /// Opens a session that was cut off, stopped or broken off by a fault, to go on with it in a further leg. Nothing in the file
    /// changes before the first record, which is [`Record::Resumed`]: with it, in one durable step, the seal is taken off, attempts
    /// that were cut off get their verdict, and the schema becomes the newest. All times and chunk numbers of the leg may begin
    /// anew: they are joined to those before. The whole session is checked first, as by [`verify`](crate::verify()).
    ///
    /// # Errors
    /// [`RecorderError::InUse`] while another process writes the session; [`RecorderError::Completed`] when there is nothing to
    /// resume; [`RecorderError::Unsound`] when [`verify`](crate::verify()) finds anything wrong; [`RecorderError::Empty`] without a
    /// header; or why it cannot be read.
    pub fn resume(
        path: impl AsRef<Path>,
        scanner: &mut dyn ChunkScanner,
    ) -> Result<Self, RecorderError> {
        let path = path.as_ref().to_owned();
        let lock = resume::lock_unfinished(&path, scanner)?;
        Ok(Self {
            lock,
            path,
            shared: Arc::new(Shared::default()),
            threads: None,
            phase: Phase::Resuming,
            joint: Joint::default(),
        })
    }

    /// Opens a session whose end is recorded and whose seal is not: [`finish`](Self::finish) is all that is left to it.
    ///
    /// # Errors
    /// [`RecorderError::InUse`] while another process writes the session; [`RecorderError::Completed`] when it is sealed;
    /// [`RecorderError::NotThere`] without an end; [`RecorderError::Unsound`] when [`verify`](crate::verify()) finds anything wrong;
    /// or why it cannot be read.
    pub fn ended(
        path: impl AsRef<Path>,
        scanner: &mut dyn ChunkScanner,
    ) -> Result<Self, RecorderError> {
        let path = path.as_ref().to_owned();
        let mut lock = resume::lock_unsealed(&path, scanner)?;
        let runtime = runtime(&path)?;
        let conn = runtime.block_on(resume::open_again(&path))?;
        lock.take_log()?;
        let mut writer = Self {
            lock,
            path,
            shared: Arc::new(Shared::default()),
            threads: None,
            phase: Phase::Ended,
            joint: Joint::default(),
        };
        writer.start(runtime, conn, Preparer::default(), 1)?;
        Ok(writer)
    }

    /// Starts the two threads on an open file.
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
            self.shared.close(Close::AsItIs);
            io(e)
        })?;
        self.threads = Some((preparing, writing));
        Ok(())
    }

    /// Writes the beginning of a further leg; it is durable on return.
    fn begin_leg(&mut self, header: &ResumeHeader) -> Result<(), RecorderError> {
        let runtime = runtime(&self.path)?;
        let (conn, leg) = runtime.block_on(resume::begin(&self.path, header))?;
        self.lock.take_log()?;
        self.joint = leg.joint;
        let preparer = Preparer::resuming(leg.formats, leg.joint.first_seq);
        self.start(runtime, conn, preparer, leg.number)
    }

    /// The session file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// How full the queue of records has been.
    #[must_use]
    pub fn load(&self) -> QueueLoad {
        self.shared.load()
    }

    /// Takes one record. `Started`, `Resumed`, `Intent`, `Outcome` and `Ended` return when they and all records before
    /// them are on the disk; others return at once, or wait while 64 MiB of records wait to be written. Nobody waits for longer than 30 s.
    ///
    /// The first record is `Started`, or `Resumed` in a further leg, the last is `Ended`. An `Outcome` needs its `Intent` before it.
    ///
    /// # Errors
    /// [`RecorderError::Record`] for a record out of order or a header whose digests are not those of its texts
    /// (nothing of it is written, the session goes on); [`RecorderError::Failed`] when this or an earlier
    /// record could not be written, from then on always; [`RecorderError::Late`] when this one was taken and is not known to be on the
    /// disk.
    pub fn accept(&mut self, record: Record) -> Result<(), RecorderError> {
        let next = self.next_phase(&record)?;
        if let Record::Resumed(header) = &record {
            self.begin_leg(header)?;
        } else {
            let record = self.joint.join(record)?;
            match self.shared.accept(record) {
                Ok(()) => {}
                Err(late @ RecorderError::Late(_)) => {
                    self.phase = next; // it was taken
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
            (Phase::Ended, _) => out_of_order("nothing after the run's end", "a record"),
        }
    }

    /// How long [`finish`](Self::finish) waits for other programs that have the session open; 60 s unless it is set here. New readers of
    /// this version stay away meanwhile.
    pub fn seal_within(&mut self, patience: Duration) {
        self.shared.set_seal_patience(patience);
    }

    /// Commits, writes the seal (final counts, tree hash, file hash), leaves one file and makes it read-only.
    ///
    /// # Errors
    /// [`RecorderError::Unsealable`] before `Ended` and while a planned press has no verdict; [`RecorderError::HeldOpen`] when another
    /// program had the session open for too long; [`RecorderError::Failed`] after a failed write. The session then stays
    /// readable and unsealed.
    pub fn finish(self) -> Result<Sealed, RecorderError> {
        self.finish_or_tell(|| {})
    }

    /// As [`finish`](Self::finish); calls `tell` once when it has to wait for another program that has the session open.
    ///
    /// # Errors
    /// As [`finish`](Self::finish).
    pub fn finish_or_tell(mut self, tell: impl FnOnce()) -> Result<Sealed, RecorderError> {
        if self.threads.is_none() {
            return Err(RecorderError::Unsealable {
                path: self.path.clone(),
                expected: "the run's end as last record".into(),
                found: "a leg that was not begun".into(),
            });
        }
        if let Err(displaced) = self.check() {
            return Err(self.rescue(&displaced));
        }
        if let Some(detail) = self.shared.failure() {
            return Err(RecorderError::Failed(detail));
        }
        self.lock.announce_sealing();
        self.lock.without_log();
        self.shared.close(Close::Seal);
        let mut tell = Some(tell);
        while self.threads.as_ref().is_some_and(|(_, w)| !w.is_finished()) {
            if self.shared.is_held_open()
                && let Some(tell) = tell.take()
            {
                tell();
            }
            std::thread::sleep(LOOK_AGAIN);
        }
        let sealed = match self.close(Close::Seal) {
            Some(Left::Sealed(sealed)) => sealed,
            _ => Err(self.ended_early()),
        };
        self.lock.withdraw_sealing();
        // What sealing met with when the file went away under it; the file is closed, and without a log.
        if let (Err(_), Err(displaced)) = (&sealed, self.check()) {
            let refuge = self.lock.refuge();
            let saved = refuge
                .place
                .map_or_else(|| self.lock.copy(&refuge.copies), Ok);
            return Err(rescued(&displaced, saved));
        }
        sealed
    }

    /// Whether the session is still where it was opened: it is written to the open file, whatever becomes of its name. To be asked
    /// now and then during a run. When it is not, the run is to be ended; [`finish`](Self::finish) then brings all that was recorded,
    /// its end included, to where it can be found.
    ///
    /// # Errors
    /// [`RecorderError::Displaced`].
    pub fn check(&self) -> Result<(), RecorderError> {
        self.lock.check()
    }

    /// Brings what was recorded to where it can be found; says where.
    fn rescue(&mut self, displaced: &RecorderError) -> RecorderError {
        let saved = match self.close(Close::Rescue(self.lock.refuge())) {
            Some(Left::Saved(saved)) => saved,
            _ => Err(self.ended_early().to_string()),
        };
        if saved.is_ok() {
            self.lock.tidy();
        }
        rescued(displaced, saved)
    }

    fn ended_early(&self) -> RecorderError {
        let ended = || "the recorder thread ended".to_owned();
        RecorderError::Failed(self.shared.failure().unwrap_or_else(ended))
    }

    fn close(&mut self, how: Close) -> Option<Left> {
        let (preparing, writing) = self.threads.take()?;
        self.shared.close(how);
        // A panic of the first thread has told the second, which leaves an unsealed session.
        let _ = preparing.join();
        writing.join().ok().flatten()
    }
}

/// What became of a session that was moved or removed.
fn rescued(displaced: &RecorderError, saved: Result<PathBuf, String>) -> RecorderError {
    let displaced = displaced.to_string();
    match saved {
        Ok(to) => RecorderError::Rescued { displaced, to },
        Err(why) => RecorderError::Lost { displaced, why },
    }
}

impl Drop for SessionWriter {
    fn drop(&mut self) {
        self.close(Close::AsItIs);
    }
}

/// What the connections of a session run on.
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
                expected: format!("{expected}, the SHA-256 of its text"),
                found: digest.clone(),
            });
        }
    }
    Ok(())
}
