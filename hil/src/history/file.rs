//! Opens history files: format check, migrations, and locking between programs.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;
use std::sync::LazyLock;
use std::time::Duration;

use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection, SqliteJournalMode, SqliteSynchronous};
use sqlx::{ConnectOptions, Connection, Row, SqlSafeStr, Sqlite, Transaction};

use super::error::{HistoryError, QueryError};

/// Schema version that this program writes, and the newest that it reads (`PRAGMA user_version`).
pub(crate) const HISTORY_SCHEMA_VERSION: u32 = 1;
/// `skrh` in ASCII (`PRAGMA application_id`).
pub(crate) const HISTORY_APPLICATION_ID: u32 = u32::from_be_bytes(*b"skrh");

/// Every migration, oldest first: version, description and SQL.
const MIGRATIONS: [(i64, &str, &str); 1] = [(
    20261122000000,
    "history",
    include_str!("../../../migrations/history/20261122000000_history.sql"),
)];

static MIGRATOR: LazyLock<Migrator> = LazyLock::new(|| {
    let migrations = MIGRATIONS.into_iter().map(|(version, description, sql)| {
        let kind = MigrationType::Simple;
        Migration::new(version, description.into(), kind, sql.into_sql_str(), false)
    });
    Migrator::with_migrations(migrations.collect())
});

/// How long to wait for another writer. A write takes milliseconds.
const BUSY: Duration = Duration::from_secs(30);

/// Opens a history after checking its first page. `create`: whether to create a missing file.
pub(super) async fn open(path: &Path, create: bool) -> Result<SqliteConnection, HistoryError> {
    let is_new = !check_first_page(path)?;
    if is_new && !create {
        return Err(HistoryError::Missing {
            path: path.to_owned(),
        });
    }
    if let Some(folder) = path.parent().filter(|_| create) {
        std::fs::create_dir_all(folder).map_err(|source| HistoryError::Io {
            path: folder.to_owned(),
            doing: "creating the folder",
            source,
        })?;
    }
    let mut conn = SqliteConnectOptions::new()
        .filename(path)
        .create_if_missing(create)
        // No side files between writes, so that the file can be copied.
        .journal_mode(SqliteJournalMode::Delete)
        .synchronous(SqliteSynchronous::Extra)
        .foreign_keys(true)
        .busy_timeout(BUSY)
        .thread_name(|_| "history-sqlite".to_owned())
        .connect()
        .await
        .map_err(|e| QueryError::from(e).at(path, "opening it"))?;
    let sound = check_integrity(&mut conn).await;
    sound.map_err(|fault| fault.at(path, "checking it"))?;
    Ok(conn)
}

/// Starts a transaction that excludes other writers, and migrates the schema.
pub(super) async fn begin(
    conn: &mut SqliteConnection,
) -> Result<Transaction<'_, Sqlite>, QueryError> {
    // Lock at the first statement: if two programs create a file at the same time, one creates the schema while the other waits.
    let mut all = conn.begin_with("BEGIN IMMEDIATE").await?;
    let done = MIGRATOR.run(&mut *all).await;
    done.map_err(sqlx::Error::from)?;
    Ok(all)
}

async fn check_integrity(conn: &mut SqliteConnection) -> Result<(), QueryError> {
    // The SQLite client would panic on invalid UTF-8 in the schema.
    let sql = "SELECT CAST(coalesce(sql, '') AS BLOB) AS sql FROM sqlite_schema";
    for row in sqlx::query(sql).fetch_all(&mut *conn).await? {
        let text: Vec<u8> = row.try_get("sql")?;
        if std::str::from_utf8(&text).is_err() {
            return Err(QueryError::damaged("schema", "UTF-8 text", "other bytes"));
        }
    }
    let result: String = sqlx::query_scalar("PRAGMA quick_check(1)")
        .fetch_one(conn)
        .await?;
    if result == "ok" {
        return Ok(());
    }
    Err(QueryError::Damaged(result))
}

/// True for a history, false for a missing or empty file. Layout: sqlite.org/fileformat.html section 1.3.
fn check_first_page(path: &Path) -> Result<bool, HistoryError> {
    let io = |source| HistoryError::Io {
        path: path.to_owned(),
        doing: "reading it",
        source,
    };
    let foreign = |found: &str| {
        Err(HistoryError::Foreign {
            path: path.to_owned(),
            found: found.to_owned(),
        })
    };
    match std::fs::metadata(path) {
        Ok(m) if m.is_dir() => return foreign("a folder"),
        // Opening a pipe would block until another program writes to it.
        Ok(m) if !m.is_file() => return foreign("a pipe, a socket or a device"),
        Ok(_) => {}
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(false),
        Err(e) => return Err(io(e)),
    }
    let file = File::open(path).map_err(io)?;
    let mut page = Vec::new();
    file.take(100).read_to_end(&mut page).map_err(io)?;
    if page.is_empty() {
        // Another program created it but has not written yet.
        return Ok(false);
    }
    if page.len() < 100 || !page.starts_with(b"SQLite format 3\0") {
        return foreign("a file that is not SQLite");
    }
    let number = |at: usize| {
        page[at..at + 4]
            .iter()
            .fold(0, |all, byte| all << 8 | u32::from(*byte))
    };
    let (version, application) = (number(60), number(68));
    if application != HISTORY_APPLICATION_ID {
        return foreign("another SQLite file");
    }
    if version > HISTORY_SCHEMA_VERSION {
        return Err(HistoryError::Newer {
            path: path.to_owned(),
            found: version,
            supported: HISTORY_SCHEMA_VERSION,
        });
    }
    Ok(true)
}
