//! Rescue of a session that was moved or removed while it was written: saves all records in one file that can be found.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use sqlx::sqlite::SqliteConnection;
use sqlx::{Connection, Row};

use crate::error::{CopyError, RescueError};
use crate::file_lock::RescueTargets;
use crate::query::Fault;

/// How long to wait for readers that keep the log from being emptied, after SQLite's own timeout.
const READER_TIMEOUT: Duration = Duration::from_secs(20);
const RETRY_INTERVAL: Duration = Duration::from_millis(50);

/// Checkpoints the log into the session file if that file still exists. Otherwise, or if readers prevent it, copies everything through
/// the open connection. Returns the path, or the reason for failure.
pub(crate) async fn rescue(
    mut conn: SqliteConnection,
    targets: RescueTargets,
) -> Result<PathBuf, RescueError> {
    // Rolls back a failed commit; fails harmlessly without one.
    let _ = sqlx::query("ROLLBACK").execute(&mut conn).await;
    let saved = match targets.current_path {
        Some(path) if empty_log(&mut conn).await.is_ok() => Ok(path),
        _ => copy(&mut conn, &targets.copies).await,
    };
    // A failing close cannot be handled: the records are safe.
    let _ = conn.close().await;
    saved
}

async fn empty_log(conn: &mut SqliteConnection) -> Result<(), Fault> {
    let from = Instant::now();
    loop {
        let row = sqlx::query("PRAGMA wal_checkpoint(TRUNCATE)")
            .fetch_one(&mut *conn)
            .await?;
        if row.try_get::<i64, _>(0)? == 0 {
            return Ok(());
        }
        if from.elapsed() > READER_TIMEOUT {
            return Err(Fault::bad("log", "no readers", "a reader"));
        }
        std::thread::sleep(RETRY_INTERVAL);
    }
}

async fn copy(conn: &mut SqliteConnection, paths: &[PathBuf]) -> Result<PathBuf, RescueError> {
    let mut attempts = Vec::new();
    for path in paths {
        match copy_to(conn, path).await {
            Ok(()) => return Ok(path.clone()),
            Err(e) => attempts.push((path.clone(), e)),
        }
    }
    Err(RescueError::from_attempts(attempts))
}

async fn copy_to(conn: &mut SqliteConnection, path: &Path) -> Result<(), CopyError> {
    let name = path.to_str().ok_or(CopyError::PathNotUtf8)?;
    let file = File::create_new(path)?;
    let copied = sqlx::query("VACUUM INTO ?").bind(name).execute(conn).await;
    // SQLite does not flush such a copy.
    let flushed = file.sync_all();
    let saved = copied
        .map_err(|e| CopyError::Sql(Box::new(e)))
        .and_then(|_| Ok(flushed?));
    if saved.is_err() {
        let _ = std::fs::remove_file(path);
    }
    saved
}
