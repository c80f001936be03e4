//! The thread that owns the session file: writes what is prepared, commits, seals.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use sqlx::Connection;
use tokio::runtime::Runtime;

use crate::error::RecorderError;
use crate::insert::Journal;
use crate::left::{Left, Sealed};
use crate::prepared::Prepared;
use crate::query::Fault;
use crate::queue::{Close, Next, Shared};
use crate::{rescue, seal};

/// What is not committed by a durable record or by its size is committed after this time.
const COMMIT_AFTER: Duration = Duration::from_millis(500);
const SEAL_AGAIN: Duration = Duration::from_millis(20);

/// Writes prepared records into the session file.
pub struct Worker {
    pub runtime: Runtime,
    pub journal: Journal,
    pub shared: Arc<Shared>,
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

impl Worker {
    /// Writes until the session is closed, then leaves it as it was asked to.
    pub fn run(mut self) -> Option<Left> {
        let farewell = Farewell(Arc::clone(&self.shared));
        let path = self.journal.path.clone();
        let mut written = 0;
        let close = loop {
            let commit_at = self.journal.opened().map(|t| t + COMMIT_AFTER);
            let step = match self.shared.next(commit_at) {
                Next::Write(records) => self.write_all(records, &mut written),
                Next::Commit => self.commit(written),
                Next::Close(close) => break close,
            };
            if let Err(fault) = step {
                self.shared.fail(told(fault, &path, "writing a record"));
            }
        };
        if self.shared.failure().is_none()
            && let Err(fault) = self.commit(written)
        {
            self.shared
                .fail(told(fault, &path, "committing the last records"));
        }
        let failed = self.shared.failure().is_some();
        let Self {
            runtime,
            journal,
            shared,
        } = self;
        let result = match close {
            Close::Seal if !failed => {
                let sealed = runtime.block_on(seal_session(journal, &shared));
                Some(Left::Sealed(sealed))
            }
            Close::Rescue(refuge) => {
                let saved = runtime.block_on(rescue::rescue(journal.conn, refuge));
                Some(Left::Saved(saved))
            }
            Close::Seal | Close::AsItIs => {
                // Nothing can be done about a failing close: what was committed is safe.
                let _ = runtime.block_on(journal.conn.close());
                None
            }
        };
        drop(farewell);
        result
    }

    fn write_all(
        &mut self,
        records: VecDeque<(Prepared, usize)>,
        written: &mut u64,
    ) -> Result<(), Fault> {
        let mut durable = false;
        for (record, bytes) in records {
            let record = match record {
                Ok(record) => record,
                Err(fault) => {
                    // Nothing of it was written; what came before it is sound.
                    self.commit(*written)?;
                    return Err(fault);
                }
            };
            durable |= record.is_durable();
            self.runtime.block_on(self.journal.write(record, bytes))?;
            *written += 1;
            self.shared.written(bytes);
            if self.journal.commit_due() {
                self.commit(*written)?;
                durable = false;
            }
        }
        // A steady trickle of small records must not put the commit off for ever.
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
        self.shared.durable(written);
        Ok(())
    }
}

/// Whether SQLite refuses because another program has the file open: `SQLITE_BUSY` or `SQLITE_LOCKED`.
fn is_held(error: &sqlx::Error) -> bool {
    let code = error.as_database_error().and_then(|e| e.code());
    let code = code.and_then(|code| code.parse::<u32>().ok());
    code.is_some_and(|code| matches!(code & 0xFF, 5 | 6))
}

async fn seal_session(mut journal: Journal, shared: &Shared) -> Result<Sealed, RecorderError> {
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
    conn.clear_cached_statements()
        .await
        .map_err(|e| sql(e.into()))?;
    // Whoever just looks is gone in a moment; SQLite itself does not wait here.
    let patience = shared.seal_patience();
    let from = Instant::now();
    let mode: String = loop {
        let asked = sqlx::query_scalar("PRAGMA journal_mode = DELETE");
        match asked.fetch_one(&mut conn).await {
            Ok(mode) => break mode,
            Err(e) if !is_held(&e) => return Err(sql(e.into())),
            Err(_) if from.elapsed() < patience => {
                shared.held_open();
                std::thread::sleep(SEAL_AGAIN);
            }
            Err(e) => {
                return Err(RecorderError::HeldOpen {
                    path: path.clone(),
                    waited: patience,
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
    Ok(Sealed {
        path,
        bytes: metadata.len(),
        totals,
        tree_sha256,
        file_sha256,
    })
}
