//! The writer thread, which owns the session file: writes prepared records, commits and seals.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use sqlx::Connection;
use tokio::runtime::Runtime;

use crate::close_result::{CloseResult, SealedSession};
use crate::error::{RecorderError, WriteFailure};
use crate::insert::Journal;
use crate::prepared::PreparedResult;
use crate::query::Fault;
use crate::queue::{CloseMode, Shared, WriterTask};
use crate::{rescue, seal};

/// Longest time until a commit if no durable record or full transaction triggers one earlier.
const COMMIT_AFTER: Duration = Duration::from_millis(500);
const SEAL_RETRY_INTERVAL: Duration = Duration::from_millis(20);

/// Writes prepared records into the session file.
pub(crate) struct Worker {
    pub runtime: Runtime,
    pub journal: Journal,
    pub shared: Arc<Shared>,
}

/// Notifies waiting callers when the thread exits, including by panic.
struct ExitNotifier(Arc<Shared>);

impl Drop for ExitNotifier {
    fn drop(&mut self) {
        self.0.fail(WriteFailure::WriterExited);
    }
}

/// Failure for a fault of the writer: unlike in a reader, an invalid value does not mean that the file is damaged.
fn failure(fault: Fault, path: &Path, doing: &'static str) -> WriteFailure {
    match fault {
        Fault::Bad {
            place,
            expected,
            found,
        } => WriteFailure::InvalidRecord {
            path: path.to_owned(),
            place,
            expected,
            found,
        },
        sql @ Fault::Sql(_) => WriteFailure::System(Arc::new(sql.at(path, doing))),
    }
}

impl Worker {
    /// Writes until the session is closed, then closes it as requested.
    pub(crate) fn run(mut self) -> Option<CloseResult> {
        let notifier = ExitNotifier(Arc::clone(&self.shared));
        let path = self.journal.path.clone();
        let mut written = 0;
        let close = loop {
            let commit_at = self.journal.opened().map(|t| t + COMMIT_AFTER);
            let step = match self.shared.next_task(commit_at) {
                WriterTask::Write(records) => self.write_all(records, &mut written),
                WriterTask::Commit => self.commit(written),
                WriterTask::Close(close) => break close,
            };
            if let Err(fault) = step {
                self.shared.fail(failure(fault, &path, "writing a record"));
            }
        };
        if self.shared.failure().is_none()
            && let Err(fault) = self.commit(written)
        {
            self.shared
                .fail(failure(fault, &path, "committing the last records"));
        }
        let failed = self.shared.failure().is_some();
        let Self {
            runtime,
            journal,
            shared,
        } = self;
        let result = match close {
            CloseMode::Seal if !failed => {
                let sealed = runtime.block_on(seal_session(journal, &shared));
                Some(CloseResult::Sealed(sealed))
            }
            CloseMode::Rescue(targets) => {
                let saved = runtime.block_on(rescue::rescue(journal.conn, targets));
                Some(CloseResult::Rescued(saved))
            }
            CloseMode::Seal | CloseMode::Unsealed => {
                // A failing close cannot be handled: the commit is safe.
                let _ = runtime.block_on(journal.conn.close());
                None
            }
        };
        drop(notifier);
        result
    }

    fn write_all(
        &mut self,
        records: VecDeque<(PreparedResult, usize)>,
        written: &mut u64,
    ) -> Result<(), Fault> {
        let mut durable = false;
        for (record, bytes) in records {
            let record = match record {
                Ok(record) => record,
                Err(fault) => {
                    // Nothing of this record was written; everything before it is sound.
                    self.commit(*written)?;
                    return Err(fault);
                }
            };
            durable |= record.is_durable();
            self.runtime.block_on(self.journal.write(record, bytes))?;
            *written += 1;
            self.shared.release(bytes);
            if self.journal.commit_due() {
                self.commit(*written)?;
                durable = false;
            }
        }
        // A steady trickle of small records must not delay the commit indefinitely.
        let late = self
            .journal
            .opened()
            .is_some_and(|t| t.elapsed() >= COMMIT_AFTER);
        if durable || late {
            self.commit(*written)
        } else {
            Ok(())
        }
    }

    fn commit(&mut self, written: u64) -> Result<(), Fault> {
        self.runtime.block_on(self.journal.commit())?;
        self.shared.mark_durable(written);
        Ok(())
    }
}

/// Whether SQLite failed because another program has the file open: `SQLITE_BUSY` or `SQLITE_LOCKED`.
fn is_held(error: &sqlx::Error) -> bool {
    let code = error.as_database_error().and_then(|e| e.code());
    let code = code.and_then(|code| code.parse::<u32>().ok());
    code.is_some_and(|code| matches!(code & 0xFF, 5 | 6))
}

async fn seal_session(
    mut journal: Journal,
    shared: &Shared,
) -> Result<SealedSession, RecorderError> {
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
    // Leave the log before a seal exists: if this fails, the session is clearly unsealed.
    conn.clear_cached_statements()
        .await
        .map_err(|e| sql(e.into()))?;
    // Readers usually leave within moments; SQLite's own timeout does not apply here.
    let timeout = shared.seal_timeout();
    let from = Instant::now();
    let mode: String = loop {
        let requested = sqlx::query_scalar("PRAGMA journal_mode = DELETE");
        match requested.fetch_one(&mut conn).await {
            Ok(mode) => break mode,
            Err(e) if !is_held(&e) => return Err(sql(e.into())),
            Err(_) if from.elapsed() < timeout => {
                shared.mark_held_open();
                std::thread::sleep(SEAL_RETRY_INTERVAL);
            }
            Err(e) => {
                return Err(RecorderError::HeldOpen {
                    path: path.clone(),
                    waited: timeout,
                    found: e.to_string(),
                });
            }
        }
    };
    if mode != "delete" {
        return Err(sql(Fault::bad("journal mode", "delete", mode)));
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
    Ok(SealedSession {
        path,
        bytes: metadata.len(),
        totals,
        tree_sha256,
        file_sha256,
    })
}
