//! Checkpoints on a thread and a connection of their own: while the writer appends to the log, they copy it into the session file.
//!
//! Commits are durable in the log; a checkpoint moves what is durable already. SQLite synchronises the log before it copies,
//! and the file before it reuses the log.

use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use sqlx::Connection;
use sqlx::sqlite::SqliteConnection;
use tokio::runtime::Runtime;

use crate::error::RecorderError;
use crate::query::Fault;
use crate::schema::PAGE_BYTES;

/// Log pages that trigger a checkpoint: 16 MiB.
const CHECKPOINT_PAGES: u64 = 256;
/// Log pages after which the writer waits for a checkpoint of all of them, so that the log starts anew: 64 MiB.
const LOG_PAGES: u64 = 1024;
/// Pages of a small commit: a row, its index and the pages above them.
const SMALL_COMMIT_PAGES: u64 = 4;

/// Checkpoints of an open session.
#[derive(Debug)]
pub(crate) struct Checkpoints {
    progress: Arc<Progress>,
    thread: Option<JoinHandle<()>>,
    /// Pages appended to the log since the last request, and since the last wait.
    fresh_pages: u64,
    log_pages: u64,
}

#[derive(Debug, Default)]
struct Progress {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    requested: u64,
    /// The last request that a checkpoint answered; the checkpoint began after it.
    done: u64,
    closed: bool,
    failure: Option<Fault>,
}

impl Progress {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, state: MutexGuard<'a, State>) -> MutexGuard<'a, State> {
        let waited = self.changed.wait(state);
        waited.unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for a request; `None` when the session closes.
    fn next(&self) -> Option<u64> {
        let mut state = self.lock();
        while !state.closed && state.requested == state.done {
            state = self.wait(state);
        }
        (!state.closed).then_some(state.requested)
    }

    fn finish(&self, request: u64, result: Result<(), Fault>) {
        let mut state = self.lock();
        state.done = request;
        if let Err(fault) = result {
            state.failure.get_or_insert(fault);
        }
        self.changed.notify_all();
    }
}

/// Releases a waiting writer if the thread panics.
struct ExitNotifier(Arc<Progress>);

impl Drop for ExitNotifier {
    fn drop(&mut self) {
        self.0.lock().closed = true;
        self.0.changed.notify_all();
    }
}

impl Checkpoints {
    /// Opens a connection to a session that has a log, and starts the thread.
    pub(crate) fn start(path: &Path) -> Result<Self, RecorderError> {
        let io = |source| RecorderError::Io {
            path: path.to_owned(),
            doing: "starting the checkpoint thread",
            source,
        };
        let build = tokio::runtime::Builder::new_current_thread().build();
        let runtime = build.map_err(io)?;
        let conn = runtime
            .block_on(crate::schema::connect_checkpoints(path))
            .map_err(|fault| fault.at(path, "opening it for checkpoints"))?;
        let progress = Arc::new(Progress::default());
        let shared = Arc::clone(&progress);
        let thread = std::thread::Builder::new()
            .name("recorder-checkpoint".to_owned())
            .spawn(move || run(&runtime, conn, &shared))
            .map_err(io)?;
        Ok(Self {
            progress,
            thread: Some(thread),
            fresh_pages: 0,
            log_pages: 0,
        })
    }

    /// Reports a commit of this many bytes of records.
    pub(crate) fn committed(&mut self, bytes: usize) -> Result<(), Fault> {
        let pages = (bytes as u64).div_ceil(PAGE_BYTES.into()) + SMALL_COMMIT_PAGES;
        self.fresh_pages += pages;
        self.log_pages += pages;
        if self.fresh_pages < CHECKPOINT_PAGES {
            return Ok(());
        }
        self.fresh_pages = 0;
        let mut state = self.progress.lock();
        state.requested += 1;
        self.progress.changed.notify_all();
        if self.log_pages >= LOG_PAGES {
            self.log_pages = 0;
            // A reader may keep the log in use; then it grows until the reader leaves.
            let all = state.requested;
            while !state.closed && state.done < all {
                state = self.progress.wait(state);
            }
        }
        state.failure.take().map_or(Ok(()), Err)
    }

    /// Ends the thread and its connection.
    pub(crate) fn close(&mut self) {
        self.progress.lock().closed = true;
        self.progress.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // After a panic of the thread, closing the session copies the rest of the log.
            let _ = thread.join();
        }
    }
}

impl Drop for Checkpoints {
    fn drop(&mut self) {
        self.close();
    }
}

fn run(runtime: &Runtime, mut conn: SqliteConnection, progress: &Arc<Progress>) {
    let _notifier = ExitNotifier(Arc::clone(progress));
    while let Some(request) = progress.next() {
        let passive = sqlx::query("PRAGMA wal_checkpoint(PASSIVE)").execute(&mut conn);
        let result = runtime.block_on(passive);
        progress.finish(request, result.map(drop).map_err(Fault::from));
    }
    // A failing close cannot be handled: commits are safe in the log.
    let _ = runtime.block_on(conn.close());
}
