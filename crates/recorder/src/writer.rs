//! The writing handle: records in, on a thread of its own, in order, never dropped.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use sha2::{Digest, Sha256};
use skinrig_model::{Record, RunHeader};
use sqlx::Connection;
use tokio::runtime::Runtime;

use crate::error::RecorderError;
use crate::insert::Journal;
use crate::query::Fault;
use crate::rows::SessionTotals;
use crate::{schema, seal};

/// Bytes of records that may wait to be written; beyond, [`SessionWriter::accept`] waits.
const QUEUE_BYTES: usize = 64 << 20;

/// What is not committed by a durable record or by its size is committed after this time.
const COMMIT_AFTER: Duration = Duration::from_millis(500);

/// A sealed session.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sealed {
    /// The file, now read-only.
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// Final counts.
    pub totals: SessionTotals,
    /// SHA-256 of the content.
    pub tree_sha256: [u8; 32],
    /// SHA-256 of the file, with the place of this hash taken as zero.
    pub file_sha256: [u8; 32],
}

/// Writes one session file.
///
/// A thread of its own owns the file. Dropped without [`finish`](Self::finish), everything accepted is
/// committed and a readable, unsealed session stays behind. Not to be used on a thread that runs async tasks.
#[derive(Debug)]
pub struct SessionWriter {
    path: PathBuf,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<Option<Result<Sealed, RecorderError>>>>,
    phase: Phase,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    New,
    Started,
    Ended,
}

#[derive(Debug, Default)]
struct Shared {
    queue: Mutex<Queue>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct Queue {
    records: VecDeque<(Record, usize)>,
    /// Bytes accepted and not yet written.
    bytes: usize,
    /// Records accepted, and how many of them are durable, since the beginning.
    accepted: u64,
    durable: u64,
    failed: Option<String>,
    closed: Option<Close>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Close {
    AsItIs,
    Seal,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, queue: MutexGuard<'a, Queue>) -> MutexGuard<'a, Queue> {
        self.changed
            .wait(queue)
            .unwrap_or_else(PoisonError::into_inner)
    }

    fn fail(&self, detail: String) {
        let mut queue = self.lock();
        queue.failed.get_or_insert(detail);
        queue.records.clear();
        queue.bytes = 0;
        self.changed.notify_all();
    }
}

impl SessionWriter {
    /// Makes a new session file. Its folder must exist.
    ///
    /// # Errors
    /// [`RecorderError::Exists`] when there is a file of that name; [`RecorderError::Io`] and
    /// [`RecorderError::Sql`] when it cannot be made.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, RecorderError> {
        let path = path.as_ref().to_owned();
        let io = |source| RecorderError::Io {
            path: path.clone(),
            doing: "starting the recorder thread",
            source,
        };
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .map_err(io)?;
        let conn = runtime.block_on(schema::create(&path))?;
        let shared = Arc::new(Shared::default());
        let worker = Worker {
            runtime,
            journal: Journal::new(path.clone(), conn),
            shared: Arc::clone(&shared),
        };
        let thread = std::thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || worker.run())
            .map_err(io)?;
        Ok(Self {
            path,
            shared,
            thread: Some(thread),
            phase: Phase::New,
        })
    }

    /// The session file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Takes one record. `Started`, `Intent`, `Outcome` and `Ended` return when they and all records before
    /// them are on the disk; others return at once, or wait while 64 MiB of records wait to be written.
    ///
    /// The first record is `Started`, the last is `Ended`. An `Outcome` needs its `Intent` before it.
    ///
    /// # Errors
    /// [`RecorderError::Record`] for a record out of order or a header whose digests are not those of its texts
    /// (nothing of it is written, the session goes on); [`RecorderError::Failed`] when this or an earlier
    /// record could not be written, from then on always.
    pub fn accept(&mut self, record: Record) -> Result<(), RecorderError> {
        let next = self.next_phase(&record)?;
        let durable = matches!(
            record,
            Record::Started(_) | Record::Intent { .. } | Record::Outcome(_) | Record::Ended { .. }
        );
        let bytes = size_of(&record);
        let mut queue = self.shared.lock();
        while queue.failed.is_none() && queue.bytes > 0 && queue.bytes + bytes > QUEUE_BYTES {
            queue = self.shared.wait(queue);
        }
        if let Some(detail) = &queue.failed {
            return Err(RecorderError::Failed(detail.clone()));
        }
        self.phase = next;
        queue.records.push_back((record, bytes));
        queue.bytes += bytes;
        queue.accepted += 1;
        let mine = queue.accepted;
        self.shared.changed.notify_all();
        while durable && queue.durable < mine {
            if let Some(detail) = &queue.failed {
                return Err(RecorderError::Failed(detail.clone()));
            }
            queue = self.shared.wait(queue);
        }
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
            (Phase::New, _) => out_of_order("the run's header first", "another record"),
            (Phase::Started, Record::Started(_)) => out_of_order("one header", "a second one"),
            (Phase::Started, Record::Ended { .. }) => Ok(Phase::Ended),
            (Phase::Started, _) => Ok(Phase::Started),
            (Phase::Ended, _) => out_of_order("nothing after the run's end", "a record"),
        }
    }

    /// Commits, writes the seal (final counts, tree hash, file hash), leaves one file and makes it read-only.
    ///
    /// # Errors
    /// [`RecorderError::Unsealable`] before `Ended`, while a planned press has no verdict, or while another
    /// program has the session open; [`RecorderError::Failed`] after a failed write. The session then stays
    /// readable and unsealed.
    pub fn finish(mut self) -> Result<Sealed, RecorderError> {
        if let Some(detail) = &self.shared.lock().failed {
            return Err(RecorderError::Failed(detail.clone()));
        }
        match self.close(Close::Seal) {
            Some(result) => result,
            None => Err(RecorderError::Failed(
                self.shared
                    .lock()
                    .failed
                    .clone()
                    .unwrap_or_else(|| "the recorder thread ended".into()),
            )),
        }
    }

    fn close(&mut self, how: Close) -> Option<Result<Sealed, RecorderError>> {
        let thread = self.thread.take()?;
        self.shared.lock().closed = Some(how);
        self.shared.changed.notify_all();
        thread.join().ok().flatten()
    }
}

impl Drop for SessionWriter {
    fn drop(&mut self) {
        self.close(Close::AsItIs);
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

/// Lower-case hex.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// About how much memory a record takes.
fn size_of(record: &Record) -> usize {
    const SMALL: usize = 256;
    SMALL
        + match record {
            Record::Started(h) => {
                h.protocol_text.len() + h.plan_json.len() + h.rig_json.len() + 64 * h.presses.len()
            }
            Record::Chunk(chunk) => chunk.bytes.len() + 24 * chunk.triggers.len(),
            Record::Poses(samples) => 64 * samples.len(),
            _ => 0,
        }
}

struct Worker {
    runtime: Runtime,
    journal: Journal,
    shared: Arc<Shared>,
}

/// Tells waiting callers when the thread ends, however it ends.
struct Farewell(Arc<Shared>);

impl Drop for Farewell {
    fn drop(&mut self) {
        self.0.fail("the recorder thread ended".to_owned());
    }
}

/// A fault of the writing side in words: a record that cannot be kept is no damage to the file.
fn told(fault: Fault, path: &Path, doing: &'static str) -> String {
    match fault {
        Fault::Bad {
            place,
            expected,
            found,
        } => {
            format!(
                "{}: {place}: expected {expected}, found {found}",
                path.display()
            )
        }
        sql @ Fault::Sql(_) => sql.at(path, doing).to_string(),
    }
}

enum Next {
    Records(VecDeque<(Record, usize)>),
    CommitNow,
    Close(Close),
}

impl Worker {
    fn run(mut self) -> Option<Result<Sealed, RecorderError>> {
        let farewell = Farewell(Arc::clone(&self.shared));
        let path = self.journal.path.clone();
        let mut opened: Option<Instant> = None;
        let mut written = 0;
        let close = loop {
            let step = match self.next(opened.map(|t| t + COMMIT_AFTER)) {
                Next::Records(records) => self.write_all(records, &mut written).and_then(|()| {
                    // A steady trickle of small records must not put the commit off for ever.
                    match opened {
                        Some(t) if t.elapsed() >= COMMIT_AFTER => self.commit(written),
                        _ => Ok(()),
                    }
                }),
                Next::CommitNow => self.commit(written),
                Next::Close(close) => break close,
            };
            if let Err(fault) = step {
                self.shared.fail(told(fault, &path, "writing a record"));
            }
            opened = self
                .journal
                .pending()
                .then(|| opened.unwrap_or_else(Instant::now));
        };
        let failed = self.shared.lock().failed.is_some();
        if !failed && let Err(fault) = self.commit(written) {
            self.shared
                .fail(told(fault, &path, "committing the last records"));
        }
        let failed = self.shared.lock().failed.is_some();
        let Self {
            runtime, journal, ..
        } = self;
        let result = if close == Close::Seal && !failed {
            Some(runtime.block_on(seal_session(journal)))
        } else {
            // Nothing can be done about a failing close: what was committed is safe.
            let _ = runtime.block_on(journal.conn.close());
            None
        };
        drop(farewell);
        result
    }

    fn next(&self, commit_at: Option<Instant>) -> Next {
        let mut queue = self.shared.lock();
        loop {
            if !queue.records.is_empty() {
                return Next::Records(std::mem::take(&mut queue.records));
            }
            if let Some(close) = queue.closed {
                return Next::Close(close);
            }
            match commit_at.filter(|_| queue.failed.is_none()) {
                None => queue = self.shared.wait(queue),
                Some(at) => {
                    let left = at.saturating_duration_since(Instant::now());
                    if left.is_zero() {
                        return Next::CommitNow;
                    }
                    queue = self
                        .shared
                        .changed
                        .wait_timeout(queue, left)
                        .unwrap_or_else(PoisonError::into_inner)
                        .0;
                }
            }
        }
    }

    fn write_all(
        &mut self,
        records: VecDeque<(Record, usize)>,
        written: &mut u64,
    ) -> Result<(), Fault> {
        let mut durable = false;
        for (record, bytes) in records {
            durable |= matches!(
                record,
                Record::Started(_)
                    | Record::Intent { .. }
                    | Record::Outcome(_)
                    | Record::Ended { .. }
            );
            self.runtime.block_on(self.journal.write(record, bytes))?;
            *written += 1;
            {
                let mut queue = self.shared.lock();
                queue.bytes = queue.bytes.saturating_sub(bytes);
                self.shared.changed.notify_all();
            }
            if self.journal.commit_due() {
                self.commit(*written)?;
                durable = false;
            }
        }
        if durable {
            self.commit(*written)
        } else {
            Ok(())
        }
    }

    fn commit(&mut self, written: u64) -> Result<(), Fault> {
        self.runtime.block_on(self.journal.commit())?;
        self.shared.lock().durable = written;
        self.shared.changed.notify_all();
        Ok(())
    }
}

async fn seal_session(mut journal: Journal) -> Result<Sealed, RecorderError> {
    let path = journal.path.clone();
    let sql = |fault: Fault| fault.at(&path, "sealing");
    let totals = match journal.sealable().await.map_err(sql)? {
        Ok(totals) => totals,
        Err((expected, found)) => {
            let _ = journal.conn.close().await;
            return Err(RecorderError::Unsealable {
                path,
                expected,
                found,
            });
        }
    };
    let mut conn = journal.conn;
    // Out of the log first, while no seal exists: should this fail, the session is plainly unsealed.
    let unsealable = |found: String| RecorderError::Unsealable {
        path: path.clone(),
        expected: "that no other program has the session open".into(),
        found,
    };
    conn.clear_cached_statements()
        .await
        .map_err(|e| sql(e.into()))?;
    let mode: String = sqlx::query_scalar("PRAGMA journal_mode = DELETE")
        .fetch_one(&mut conn)
        .await
        .map_err(|e| unsealable(e.to_string()))?;
    if mode != "delete" {
        return Err(unsealable(format!("journal mode {mode}")));
    }
    let (tree_sha256, placeholder) = seal::write_rows(&mut conn, &totals).await.map_err(sql)?;
    let page = seal::seal_page(&mut conn).await.map_err(sql)?;
    conn.close().await.map_err(|e| sql(e.into()))?;
    let io = |doing| {
        let path = path.clone();
        move |source| RecorderError::Io {
            path,
            doing,
            source,
        }
    };
    let file_sha256 =
        seal::stamp(&path, page, &placeholder).map_err(io("writing the file hash"))?;
    let metadata = std::fs::metadata(&path).map_err(io("reading its size"))?;
    let mut permissions = metadata.permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&path, permissions).map_err(io("making it read-only"))?;
    Ok(Sealed {
        path,
        bytes: metadata.len(),
        totals,
        tree_sha256,
        file_sha256,
    })
}
