//! A session that was moved or removed while it was written: all that was recorded is brought into one file that can be found.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use sqlx::sqlite::SqliteConnection;
use sqlx::{Connection, Row};

use crate::held::Refuge;
use crate::query::Fault;

/// How long readers are waited for that keep the log from being emptied, beyond what SQLite itself waits.
const READERS: Duration = Duration::from_secs(20);
const TRY_AGAIN: Duration = Duration::from_millis(50);

/// Empties the log into the session file where that can still be found; else, or when readers prevent it, copies all of it through the
/// open connection. Where it is now, or why it could not be saved.
pub async fn rescue(mut conn: SqliteConnection, refuge: Refuge) -> Result<PathBuf, String> {
    // Of a commit that failed; an error where there is none.
    let _ = sqlx::query("ROLLBACK").execute(&mut conn).await;
    let saved = match refuge.place {
        Some(place) if empty_log(&mut conn).await.is_ok() => Ok(place),
        _ => copy(&mut conn, &refuge.copies).await,
    };
    // Nothing can be done about a failing close: what was recorded is safe.
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
        if from.elapsed() > READERS {
            return Err(Fault::bad("log", "no reader of it", "one"));
        }
        std::thread::sleep(TRY_AGAIN);
    }
}

async fn copy(conn: &mut SqliteConnection, paths: &[PathBuf]) -> Result<PathBuf, String> {
    let mut refused = Vec::new();
    for path in paths {
        match copy_to(conn, path).await {
            Ok(()) => return Ok(path.clone()),
            Err(e) => refused.push(format!("{}: {e}", path.display())),
        }
    }
    Err(if refused.is_empty() {
        "expected a folder for a copy, found none".to_owned()
    } else {
        refused.join("; ")
    })
}

async fn copy_to(conn: &mut SqliteConnection, path: &Path) -> Result<(), String> {
    let name = path.to_str().ok_or("expected a path in UTF-8")?;
    let file = File::create_new(path).map_err(|e| e.to_string())?;
    let copied = sqlx::query("VACUUM INTO ?").bind(name).execute(conn).await;
    // SQLite does not flush such a copy by itself.
    let flushed = file.sync_all();
    let saved = copied
        .map_err(|e| e.to_string())
        .and_then(|_| flushed.map_err(|e| e.to_string()));
    if saved.is_err() {
        let _ = std::fs::remove_file(path);
    }
    saved
}
