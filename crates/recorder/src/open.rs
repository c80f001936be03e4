//! Opening session files for reading, after checking that they are sessions and hold plain data.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::time::{Duration, Instant};

use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection};
use sqlx::{ConnectOptions, Connection, Row};
use tokio::runtime::Runtime;

use crate::error::RecorderError;
use crate::migrations::SCHEMA_VERSION;
use crate::object::{self, OBJECTS_VFS, SessionReference};
use crate::query::{Fault, each_row};
use crate::schema::{APPLICATION_ID, BUSY_TIMEOUT, writable};
use crate::sidecar::{reject_special_files, reject_super_journal, sidecar_path};

/// Rolls back a transaction whose writer was killed; until then the file cannot be read.
async fn roll_back(path: &Path) -> Result<(), RecorderError> {
    let fault = |e: sqlx::Error| Fault::from(e).at(path, "rolling back an interrupted write");
    let mut conn = writable(path).connect().await.map_err(fault)?;
    sqlx::query("SELECT count(*) FROM sqlite_schema")
        .execute(&mut conn)
        .await
        .map_err(fault)?;
    conn.close().await.map_err(fault)
}

/// How long a reader waits for sealing: slightly longer than the writer waits for readers.
const SEAL_WAIT: Duration = Duration::from_secs(90);
/// Interval at which a reader checks whether sealing has ended.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Most rows that SQLite's thread reads ahead: waking two threads for each row costs more than the row.
const ROWS_AHEAD: usize = 1024;

/// What a reader opens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Source {
    /// The file, which may still grow.
    Growing,
    /// The file, which never changes.
    Sealed,
    /// The object at this address, which never changes.
    Object(String),
}

/// Opens a session for reading, after checking that it is one.
pub(crate) async fn open(path: &Path) -> Result<(SqliteConnection, Source), RecorderError> {
    match SessionReference::of(path)? {
        None => open_file(path).await,
        Some(reference) => {
            let done = open_object(path, &reference).await;
            done.map_err(|e| object::explain(path, &reference.url, e))
        }
    }
}

/// Opens the session of a reference, after checking that the object is that session.
async fn open_object(
    path: &Path,
    reference: &SessionReference,
) -> Result<(SqliteConnection, Source), RecorderError> {
    reference.check_size(path)?;
    let source = Source::Object(reference.url.clone());
    let mut conn = connect(path, &source).await?;
    let found = check_object(&mut conn).await;
    let found = found.map_err(|fault| fault.at(path, "reading its seal"))?;
    let expected = [&reference.session_id, &reference.content_sha256];
    match found {
        Some((id, seal)) if [&id, &seal] == expected => Ok((conn, source)),
        Some((id, seal)) => Err(reference.other(path, format!("session {id}, sealed as {seal}"))),
        None => Err(reference.other(path, "no sealed session of this version".to_owned())),
    }
}

/// Identifier and seal of a sealed session whose schema this build reads; `None` for anything else.
pub(crate) async fn check_object(
    conn: &mut SqliteConnection,
) -> Result<Option<(String, String)>, Fault> {
    let application: i64 = sqlx::query_scalar("PRAGMA application_id")
        .fetch_one(&mut *conn)
        .await?;
    let version: i64 = sqlx::query_scalar("PRAGMA user_version")
        .fetch_one(&mut *conn)
        .await?;
    if application != i64::from(APPLICATION_ID)
        || version > i64::from(SCHEMA_VERSION)
        || !check_schema(conn).await?
    {
        return Ok(None);
    }
    let sql = "SELECT session.session_id, lower(hex(seal.tree_sha256)) FROM session, seal";
    let row = sqlx::query(sql).fetch_optional(conn).await?;
    row.map(|row| Ok((row.try_get(0)?, row.try_get(1)?)))
        .transpose()
}

/// Opens a session file for reading, after checking its first page.
async fn open_file(path: &Path) -> Result<(SqliteConnection, Source), RecorderError> {
    reject_special_files(path)?;
    let from = Instant::now();
    while crate::lock::is_being_sealed(path) && from.elapsed() < SEAL_WAIT {
        std::thread::sleep(POLL_INTERVAL);
    }
    reject_super_journal(path)?;
    let mut mode = check_first_page(path)?;
    // Also while the journal mode changes, when the first page may already give the new mode.
    if sidecar_path(path, "-journal").exists() && crate::lock::writer_of(path).is_none() {
        roll_back(path).await?;
        mode = check_first_page(path)?;
    }
    // A sealed file is in rollback mode, has no files beside it and never changes, unless it is just being sealed.
    let is_sealed = mode == JournalMode::Rollback
        && crate::lock::writer_of(path).is_none()
        && !["-wal", "-journal"]
            .iter()
            .any(|end| sidecar_path(path, end).exists());
    let source = match is_sealed {
        true => Source::Sealed,
        false => Source::Growing,
    };
    let mut conn = connect(path, &source).await?;
    let schema = check_schema(&mut conn).await;
    let has_schema = schema.map_err(|fault| fault.at(path, "reading its schema"))?;
    if has_schema {
        Ok((conn, source))
    } else {
        Err(empty(path))
    }
}

/// Opens a session for reading, beside a connection that checked it; `source` as returned by [`open`].
pub(crate) async fn connect(
    path: &Path,
    source: &Source,
) -> Result<SqliteConnection, RecorderError> {
    let options = match source {
        Source::Object(url) => SqliteConnectOptions::new().filename(url).vfs(OBJECTS_VFS),
        Source::Growing | Source::Sealed => SqliteConnectOptions::new().filename(path),
    };
    options
        .read_only(true)
        .immutable(*source != Source::Growing)
        .foreign_keys(true)
        .busy_timeout(BUSY_TIMEOUT)
        .row_buffer_size(ROWS_AHEAD)
        .thread_name(|_| "session-reader".to_owned())
        .connect()
        .await
        .map_err(|e| Fault::from(e).at(path, "opening it"))
}

fn empty(path: &Path) -> RecorderError {
    RecorderError::Empty {
        path: path.to_owned(),
    }
}

/// Whether the schema exists: a writer that ends early leaves a file without tables.
async fn check_schema(conn: &mut SqliteConnection) -> Result<bool, Fault> {
    check_schema_text(conn).await?;
    check_schema_is_data(conn).await?;
    let sql = "SELECT EXISTS (SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name <> '_sqlx_migrations')";
    Ok(sqlx::query_scalar(sql).fetch_one(conn).await?)
}

/// Whether the run has written its header.
pub(crate) async fn has_header(conn: &mut SqliteConnection) -> Result<bool, Fault> {
    let sql = "SELECT EXISTS (SELECT 1 FROM session)";
    Ok(sqlx::query_scalar(sql).fetch_one(conn).await?)
}

/// Whether no row was ever written: the file holds only the schema.
pub(crate) async fn is_blank(conn: &mut SqliteConnection) -> Result<bool, Fault> {
    let sql =
        "SELECT NOT EXISTS (SELECT 1 FROM session) AND NOT EXISTS (SELECT 1 FROM robot_from_skin)
           AND NOT EXISTS (SELECT 1 FROM press) AND NOT EXISTS (SELECT 1 FROM attempt)
           AND NOT EXISTS (SELECT 1 FROM device) AND NOT EXISTS (SELECT 1 FROM command)
           AND NOT EXISTS (SELECT 1 FROM pose_block) AND NOT EXISTS (SELECT 1 FROM mark)
           AND NOT EXISTS (SELECT 1 FROM chunk) AND NOT EXISTS (SELECT 1 FROM trigger_edge)
           AND NOT EXISTS (SELECT 1 FROM interruption) AND NOT EXISTS (SELECT 1 FROM note)
           AND NOT EXISTS (SELECT 1 FROM run_end) AND NOT EXISTS (SELECT 1 FROM table_digest)
           AND NOT EXISTS (SELECT 1 FROM seal)";
    Ok(sqlx::query_scalar(sql).fetch_one(conn).await?)
}

/// Checks that names in the schema are valid text; the SQLite client panics otherwise.
async fn check_schema_text(conn: &mut SqliteConnection) -> Result<(), Fault> {
    let sql = "SELECT CAST(sql AS BLOB) AS sql FROM sqlite_schema WHERE sql IS NOT NULL";
    each_row(sqlx::query(sql), conn, |row| {
        let text: &[u8] = row.try_get("sql")?;
        match std::str::from_utf8(text) {
            Ok(_) => Ok(()),
            Err(_) => Err(Fault::bad("schema", "UTF-8 text", "other bytes")),
        }
    })
    .await
}

/// Checks that the schema has only tables and their indices. Views, triggers, virtual tables and computed columns of an untrusted
/// file would run code when it is read or written, for unlimited time or memory.
async fn check_schema_is_data(conn: &mut SqliteConnection) -> Result<(), Fault> {
    let runs = "SELECT type, CAST(name AS BLOB) AS name FROM sqlite_schema
         WHERE type NOT IN ('table', 'index') OR coalesce(rootpage, 0) = 0
         UNION ALL SELECT 'column', CAST(x.name AS BLOB) FROM sqlite_schema s JOIN pragma_table_xinfo(s.name) x
         WHERE s.type = 'table' AND x.hidden <> 0
         LIMIT 1";
    match sqlx::query(runs).fetch_optional(conn).await? {
        None => Ok(()),
        Some(row) => {
            let (kind, name): (&[u8], &[u8]) =
                (row.try_get_unchecked("type")?, row.try_get("name")?);
            let kind = String::from_utf8_lossy(kind);
            let found = format!("{kind} `{}`", String::from_utf8_lossy(name).escape_debug());
            Err(Fault::bad(
                "schema",
                "plain tables and their indices",
                found,
            ))
        }
    }
}

/// Journal mode according to the first page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum JournalMode {
    Rollback,
    Log,
}

/// Layout: sqlite.org/fileformat.html sections 1.3 and 1.6.
fn check_first_page(path: &Path) -> Result<JournalMode, RecorderError> {
    let io = |source: std::io::Error| {
        if source.kind() == std::io::ErrorKind::NotFound {
            RecorderError::Missing {
                path: path.to_owned(),
            }
        } else {
            RecorderError::Io {
                path: path.to_owned(),
                doing: "reading it",
                source,
            }
        }
    };
    let not = |found: &str| {
        Err(RecorderError::NotASession {
            path: path.to_owned(),
            found: found.to_owned(),
        })
    };
    let mut file = File::open(path).map_err(io)?;
    let metadata = file.metadata().map_err(io)?;
    // The writer creates the file first; its first pages may still be in the log or the journal beside it.
    if metadata.len() == 0 {
        return Err(empty(path));
    }
    let mut page = [0u8; 108];
    if let Err(e) = file.read_exact(&mut page) {
        return match e.kind() {
            std::io::ErrorKind::UnexpectedEof => not("a file of less than 108 bytes"),
            _ => Err(io(e)),
        };
    }
    if &page[..16] != b"SQLite format 3\0" {
        return not(
            "a file that is not an SQLite database; if it was a session, `skinrig salvage` copies its intact part",
        );
    }
    // Before the first checkpoint of a running session, the schema is only in the log.
    let number =
        |at: usize| u32::from_be_bytes([page[at], page[at + 1], page[at + 2], page[at + 3]]);
    let (version, application) = (number(60), number(68));
    if application != APPLICATION_ID && !(application == 0 && sidecar_path(path, "-wal").exists()) {
        // An empty leaf as root of the schema: there is no table.
        if application == 0 && page[100] == 0x0d && page[103..105] == [0, 0] {
            return Err(empty(path));
        }
        return not("an SQLite database of another program");
    }
    if version > SCHEMA_VERSION {
        return Err(RecorderError::NewerSchema {
            path: path.to_owned(),
            found: version,
            supported: SCHEMA_VERSION,
        });
    }
    Ok(match (page[18], page[19]) {
        (1, 1) => JournalMode::Rollback,
        _ => JournalMode::Log,
    })
}

/// Async runtime of one connection.
pub(crate) fn runtime(path: &Path) -> Result<Runtime, RecorderError> {
    tokio::runtime::Builder::new_current_thread()
        .build()
        .map_err(|source| RecorderError::Io {
            path: path.to_owned(),
            doing: "starting to read it",
            source,
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::schema::tests::NullScanner;
    use crate::schema::{PAGE_BYTES, create, reopen};
    use crate::sidecar::SUPER_JOURNAL_END;

    #[cfg(unix)]
    #[test]
    fn links_beside_a_session_are_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let victim = folder.path().join("victim");
        std::fs::write(&victim, "precious").unwrap();
        for ending in ["-wal", "-shm", "-journal", "-lock"] {
            let path = folder.path().join(format!("of{ending}.session.sqlite"));
            let link = sidecar_path(&path, ending);
            std::os::unix::fs::symlink(&victim, &link).unwrap();
            assert!(crate::SessionWriter::create(&path).is_err(), "{ending}");
            std::fs::remove_file(&link).unwrap();
            drop(crate::SessionWriter::create(&path).unwrap());
            std::os::unix::fs::symlink(&victim, &link).unwrap();
            for refused in [
                crate::SessionReader::open(&path).map(drop),
                crate::SessionWriter::resume::<NullScanner>(&path).map(drop),
                crate::SessionWriter::open_ended::<NullScanner>(&path).map(drop),
            ] {
                let refused = refused.unwrap_err().to_string();
                assert!(refused.contains("a link beside it"), "{refused}");
            }
            assert_eq!(std::fs::read_to_string(&victim).unwrap(), "precious");
        }
    }

    /// A hot journal of a transaction that changed nothing, with the name of a super-journal at its end.
    fn journal_naming(name: &str, pages: u32) -> Vec<u8> {
        let mut journal = SUPER_JOURNAL_END.to_vec();
        for number in [0, 1, pages, 512, PAGE_BYTES] {
            journal.extend(u32::to_be_bytes(number));
        }
        journal.resize(512, 0);
        let lock_page = 0x4000_0000 / PAGE_BYTES + 1;
        journal.extend(lock_page.to_be_bytes());
        journal.extend(name.as_bytes());
        let sum: u32 = name.bytes().map(u32::from).sum();
        for number in [name.len() as u32, sum] {
            journal.extend(number.to_be_bytes());
        }
        journal.extend(SUPER_JOURNAL_END);
        journal
    }

    #[test]
    fn a_journal_that_names_another_file_is_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let victim = folder.path().join("victim");
        let path = folder.path().join("a.session.sqlite");
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .unwrap();
        let unprotected = |path: &Path| {
            runtime.block_on(async {
                let mut conn = writable(path).connect().await.unwrap();
                let count = "SELECT count(*) FROM sqlite_schema";
                sqlx::query(count).execute(&mut conn).await.unwrap();
                conn.close().await.unwrap();
            });
        };
        let forge = || {
            std::fs::write(&victim, "precious").unwrap();
            let pages = std::fs::metadata(&path).unwrap().len() / u64::from(PAGE_BYTES);
            let journal = journal_naming(victim.to_str().unwrap(), pages as u32);
            std::fs::write(sidecar_path(&path, "-journal"), journal).unwrap();
        };
        for mode in ["PRAGMA journal_mode = DELETE", "PRAGMA journal_mode = WAL"] {
            let _ = std::fs::remove_file(&path);
            runtime.block_on(async {
                let mut conn = create(&path).await.unwrap();
                sqlx::query(mode).execute(&mut conn).await.unwrap();
                conn.close().await.unwrap();
            });
            forge();
            for refused in [
                crate::SessionReader::open(&path).map(drop),
                crate::SessionWriter::resume::<NullScanner>(&path).map(drop),
                crate::SessionWriter::open_ended::<NullScanner>(&path).map(drop),
                runtime.block_on(reopen(&path)).map(drop),
            ] {
                let refused = refused.unwrap_err().to_string();
                assert!(refused.contains("a journal beside it"), "{refused}");
                assert_eq!(std::fs::read_to_string(&victim).unwrap(), "precious");
            }
            #[cfg(unix)]
            {
                let link = folder.path().join("link.session.sqlite");
                std::os::unix::fs::symlink(&path, &link).unwrap();
                assert!(crate::SessionReader::open(&link).is_err());
                std::fs::remove_file(&link).unwrap();
            }
            // The reason for the rejection: SQLite itself does delete it.
            unprotected(&path);
            assert!(!victim.exists(), "{mode}");
        }
    }

    #[test]
    fn a_schema_with_code_is_rejected() {
        let folder = tempfile::tempdir().unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .unwrap();
        for (name, found, hostile) in [
            (
                "view",
                "view `note`",
                [
                    "DROP TABLE note",
                    "CREATE VIEW note AS WITH RECURSIVE n(t_ns) AS (SELECT 1 UNION ALL SELECT t_ns + 1 FROM n)
                     SELECT t_ns AS id, t_ns, 'x' AS text FROM n",
                ],
            ),
            (
                "column",
                "column `text`",
                [
                    "DROP TABLE note",
                    "CREATE TABLE note (id INTEGER PRIMARY KEY, t_ns, text AS (hex(zeroblob(400000000))))",
                ],
            ),
            (
                "trigger",
                "trigger `more`",
                [
                    "SELECT 1",
                    "CREATE TRIGGER more AFTER UPDATE ON attempt BEGIN DELETE FROM chunk; END",
                ],
            ),
        ] {
            let path = folder.path().join(name);
            runtime.block_on(async {
                let mut conn = create(&path).await.unwrap();
                for statement in hostile {
                    sqlx::query(statement).execute(&mut conn).await.unwrap();
                }
                conn.close().await.unwrap();
            });
            let refused = crate::SessionReader::open(&path).unwrap_err().to_string();
            assert!(refused.contains(found), "{refused}");
        }
    }
}
