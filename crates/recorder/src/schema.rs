//! How a session file is opened, for writing and for reading, and which schema it has.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::time::{Duration, Instant};

use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection, SqliteJournalMode, SqliteSynchronous};
use sqlx::{ConnectOptions, Connection, Row, Sqlite, Transaction};

use crate::beside::{beside, refuse_special_files, refuse_super_journal};
use crate::error::RecorderError;
use crate::migrations::{MIGRATOR, SCHEMA_VERSION};
use crate::query::{Fault, each_row};

/// `skrg` in ASCII (`PRAGMA application_id`).
pub(crate) const APPLICATION_ID: u32 = u32::from_be_bytes(*b"skrg");

/// Bytes of a page, the largest that SQLite knows. Every page of camera bytes costs three system calls on its way
/// through the log: 64 KiB took in 500 MB/s where 16 KiB took in 380 (`cargo bench -p skinrig-bench --bench ingest`).
/// Its price: an empty session has 1.4 MB, and a commit of one small row writes 128 KiB.
const PAGE_BYTES: u32 = 65536;

/// Pages in the log that start a checkpoint: 16 MiB, which stay in the system's cache. A longer log was no faster.
const CHECKPOINT_PAGES: u32 = 256;

/// How long to wait for another program's lock.
const BUSY: Duration = Duration::from_secs(10);

/// Makes a new session file with an empty schema.
pub async fn create(path: &Path) -> Result<SqliteConnection, RecorderError> {
    create_file(path)?;
    fill(path).await
}

/// Makes a new, empty file.
pub(crate) fn create_file(path: &Path) -> Result<(), RecorderError> {
    refuse_special_files(path)?;
    match File::create_new(path) {
        Ok(_) => Ok(()),
        Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => Err(RecorderError::Exists {
            path: path.to_owned(),
        }),
        Err(source) => Err(RecorderError::Io {
            path: path.to_owned(),
            doing: "creating it",
            source,
        }),
    }
}

/// Makes the schema in an empty file.
pub async fn fill(path: &Path) -> Result<SqliteConnection, RecorderError> {
    let fault = |e: sqlx::Error| Fault::from(e).at(path, "creating the schema");
    let mut conn = new_file(path).await.map_err(fault)?;
    MIGRATOR.run(&mut conn).await.map_err(|e| fault(e.into()))?;
    Ok(conn)
}

async fn new_file(path: &Path) -> sqlx::Result<SqliteConnection> {
    writable(path)
        .page_size(PAGE_BYTES)
        .journal_mode(SqliteJournalMode::Wal)
        // Feasibility measurement: after a power cut NORMAL lost acknowledged rows, FULL none.
        .synchronous(SqliteSynchronous::Full)
        .connect()
        .await
}

/// A new file with the schema of an older version of skinrig.
#[cfg(test)]
pub(crate) async fn create_version(path: &Path, version: u32) -> sqlx::Result<SqliteConnection> {
    File::create_new(path)?;
    let mut conn = new_file(path).await?;
    let first = MIGRATOR.iter().take(version as usize).cloned().collect();
    sqlx::migrate::Migrator::with_migrations(first)
        .run(&mut conn)
        .await?;
    Ok(conn)
}

fn writable(path: &Path) -> SqliteConnectOptions {
    SqliteConnectOptions::new()
        .filename(path)
        .pragma("wal_autocheckpoint", CHECKPOINT_PAGES.to_string())
        .foreign_keys(true)
        .busy_timeout(BUSY)
        .thread_name(|_| "session-sqlite".to_owned())
}

/// Opens an existing session for writing, in the journal mode that it is in: a sealed one is in rollback mode.
pub(crate) async fn open_again(path: &Path) -> Result<SqliteConnection, RecorderError> {
    refuse_super_journal(path)?;
    allow_writing(path).map_err(|source| RecorderError::Io {
        path: path.to_owned(),
        doing: "making it writable",
        source,
    })?;
    writable(path)
        // In rollback mode a transaction is durable only with its folder synchronised too.
        .synchronous(SqliteSynchronous::Extra)
        .connect()
        .await
        .map_err(|e| Fault::from(e).at(path, "opening it for writing"))
}

/// Brings the schema up to this build's, within a transaction. What a session of an older schema does not know stays empty.
pub async fn migrate(all: &mut Transaction<'_, Sqlite>) -> Result<(), Fault> {
    let done = MIGRATOR.run(&mut **all).await;
    done.map_err(|e| Fault::from(sqlx::Error::from(e)))
}

/// From here on a write-ahead log, as in a new session.
pub(crate) async fn log_ahead(conn: &mut SqliteConnection) -> Result<(), Fault> {
    let mode: String = sqlx::query_scalar("PRAGMA journal_mode = WAL")
        .fetch_one(&mut *conn)
        .await?;
    if mode != "wal" {
        return Err(Fault::bad("journal mode", "wal", mode));
    }
    sqlx::query("PRAGMA synchronous = FULL")
        .execute(&mut *conn)
        .await?;
    // Makes the log and its index.
    sqlx::query("SELECT count(*) FROM sqlite_schema")
        .execute(conn)
        .await?;
    Ok(())
}

/// A sealed session is read-only.
fn allow_writing(path: &Path) -> std::io::Result<()> {
    let mut permissions = std::fs::metadata(path)?.permissions();
    if !permissions.readonly() {
        return Ok(());
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        permissions.set_mode(permissions.mode() | 0o200);
    }
    #[cfg(not(unix))]
    permissions.set_readonly(false);
    std::fs::set_permissions(path, permissions)
}

/// Undoes a transaction in rollback mode in the middle of which a writer was ended: until then nobody can read the file.
async fn roll_back(path: &Path) -> Result<(), RecorderError> {
    let fault = |e: sqlx::Error| Fault::from(e).at(path, "undoing a write that was cut off");
    let mut conn = writable(path).connect().await.map_err(fault)?;
    sqlx::query("SELECT count(*) FROM sqlite_schema")
        .execute(&mut conn)
        .await
        .map_err(fault)?;
    conn.close().await.map_err(fault)
}

/// How long a reader stays away from a session that is being sealed: a bit longer than its writer waits for those before it.
const SEALED_WITHIN: Duration = Duration::from_secs(90);
/// Between two looks whether it is.
const LOOK_AGAIN: Duration = Duration::from_millis(10);

/// Opens a session file for reading, after a look at its first page.
pub async fn open(path: &Path) -> Result<SqliteConnection, RecorderError> {
    refuse_special_files(path)?;
    let from = Instant::now();
    while crate::lock::is_being_sealed(path) && from.elapsed() < SEALED_WITHIN {
        std::thread::sleep(LOOK_AGAIN);
    }
    refuse_super_journal(path)?;
    let mut mode = check_first_page(path)?;
    // Also of a change into or out of the log, whose first page may already say the other mode.
    if beside(path, "-journal").exists() && crate::lock::writer_of(path).is_none() {
        roll_back(path).await?;
        mode = check_first_page(path)?;
    }
    // A sealed file is in rollback mode, has nothing beside it and does not change; one that is being sealed still does.
    let immutable = mode == Mode::Rollback
        && crate::lock::writer_of(path).is_none()
        && !["-wal", "-journal"]
            .iter()
            .any(|end| beside(path, end).exists());
    let mut conn = SqliteConnectOptions::new()
        .filename(path)
        .read_only(true)
        .immutable(immutable)
        .foreign_keys(true)
        .busy_timeout(BUSY)
        .thread_name(|_| "session-reader".to_owned())
        .connect()
        .await
        .map_err(|e| Fault::from(e).at(path, "opening it"))?;
    let schema = check_schema(&mut conn).await;
    let made = schema.map_err(|fault| fault.at(path, "reading its schema"))?;
    if made { Ok(conn) } else { Err(empty(path)) }
}

fn empty(path: &Path) -> RecorderError {
    RecorderError::Empty {
        path: path.to_owned(),
    }
}

/// Whether the schema was made: a writer that ends before that leaves a file without any table of a session.
async fn check_schema(conn: &mut SqliteConnection) -> Result<bool, Fault> {
    check_schema_text(conn).await?;
    check_schema_is_data(conn).await?;
    let sql = "SELECT EXISTS (SELECT 1 FROM sqlite_schema WHERE type = 'table' AND name <> '_sqlx_migrations')";
    Ok(sqlx::query_scalar(sql).fetch_one(conn).await?)
}

/// Whether no row was ever written: nothing but the schema is there.
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

/// The schema of a damaged file may hold names that are no text, over which the SQLite client would panic.
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

/// A session is data: tables and their indices. A stranger's file may hold what runs when it is read or written, for ever or out of
/// all memory: views, triggers, virtual tables, columns that are computed.
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

/// The journal mode that the first page says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mode {
    Rollback,
    Log,
}

/// Layout: sqlite.org/fileformat.html sections 1.3 and 1.6.
fn check_first_page(path: &Path) -> Result<Mode, RecorderError> {
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
    // A writer makes the file first; what it then writes may still be in the log or the journal beside it.
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
        return not("a file that is not SQLite");
    }
    // Before the first checkpoint of a session under way the schema is still in the log alone.
    let number =
        |at: usize| u32::from_be_bytes([page[at], page[at + 1], page[at + 2], page[at + 3]]);
    let (version, application) = (number(60), number(68));
    if application != APPLICATION_ID && !(application == 0 && beside(path, "-wal").exists()) {
        // A leaf of the tree of tables that has no cell: there is no table.
        if application == 0 && page[100] == 0x0d && page[103..105] == [0, 0] {
            return Err(empty(path));
        }
        return not("another program's SQLite file");
    }
    if version > SCHEMA_VERSION {
        return Err(RecorderError::NewerSchema {
            path: path.to_owned(),
            found: version,
            supported: SCHEMA_VERSION,
        });
    }
    Ok(match (page[18], page[19]) {
        (1, 1) => Mode::Rollback,
        _ => Mode::Log,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::beside::SUPER_JOURNAL_END;

    struct NoBytes;
    impl crate::ChunkScanner for NoBytes {
        fn restart(&mut self, _: skinrig_model::CameraId, _: skinrig_model::StreamFormat, _: u64) {}
        fn lost(&mut self, _: skinrig_model::CameraId, _: skinrig_model::StreamFormat, _: u64) {}
        fn scan(
            &mut self,
            _: skinrig_model::CameraId,
            _: skinrig_model::StreamFormat,
            _: &[u8],
        ) -> (skinrig_model::ChunkFacts, Vec<skinrig_model::TriggerEdge>) {
            Default::default()
        }
    }

    #[test]
    fn the_version_counts_the_migrations() {
        assert_eq!(MIGRATOR.iter().count(), SCHEMA_VERSION as usize);
    }

    /// Schema 10 makes the table of legs anew, although the rows of kept seals refer to it.
    #[test]
    fn legs_and_what_refers_to_them_survive_their_new_table() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("old.session.sqlite");
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .unwrap();
        runtime.block_on(async {
            let mut conn = create_version(&path, 9).await.unwrap();
            for number in [2, 3] {
                let insert = "INSERT INTO leg VALUES (?1, 'o', 's', 'h', 's', 'c', ?1, ?1, 0, 1, 2, 3, 4, 'stopped', 'r', ?1, zeroblob(32))";
                sqlx::query(insert).bind(number).execute(&mut conn).await.unwrap();
                let insert = "INSERT INTO previous_seal (leg, tree_sha256) VALUES (?, zeroblob(32))";
                sqlx::query(insert).bind(number).execute(&mut conn).await.unwrap();
            }
            let digest = async |conn: &mut SqliteConnection| {
                let all = crate::digest::digest_tables(conn).await.unwrap();
                all.into_iter().find(|t| t.name == "leg").unwrap()
            };
            let before = digest(&mut conn).await;
            conn.close().await.unwrap();

            let mut conn = open_again(&path).await.unwrap();
            let mut all = conn.begin_with("BEGIN IMMEDIATE").await.unwrap();
            migrate(&mut all).await.unwrap();
            let of_completed = "UPDATE leg SET previous_status = 'completed', previous_reason = NULL WHERE number = ?";
            all.commit().await.unwrap();
            assert_eq!(digest(&mut conn).await, before);
            sqlx::query(of_completed).bind(3).execute(&mut conn).await.unwrap();
            // What refers to the legs still does.
            for refused in [
                "DELETE FROM leg WHERE number = 2",
                "INSERT INTO previous_seal (leg, tree_sha256) VALUES (4, zeroblob(32))",
                "UPDATE leg SET previous_reason = 'x' WHERE number = 3",
                "UPDATE leg SET previous_reason = NULL WHERE number = 2",
                "UPDATE leg SET previous_status = NULL, previous_reason = NULL WHERE number = 2",
            ] {
                let done = sqlx::query(refused).execute(&mut conn).await;
                assert!(done.is_err(), "{refused}");
            }
            conn.close().await.unwrap();
        });
    }

    /// A sealed session of schema 1 is read and verified as before: the tables that came later are no part of it.
    #[test]
    fn sessions_of_the_first_schema_stay_sound() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("old.session.sqlite");
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .unwrap();
        let digests = runtime.block_on(async {
            let mut conn = create(&path).await.unwrap();
            for undo in [
                "DROP TABLE box_report",
                "DROP TABLE preflight",
                "DROP TABLE leg",
                "DROP TABLE gap",
                "DROP TABLE previous_table_digest",
                "DROP TABLE previous_seal",
                "ALTER TABLE attempt DROP COLUMN leg",
                "ALTER TABLE attempt DROP COLUMN touched_mm",
                "ALTER TABLE attempt DROP COLUMN faults",
                "DELETE FROM _sqlx_migrations WHERE version > 20261121000000",
                "PRAGMA user_version = 1",
                "PRAGMA journal_mode = DELETE",
            ] {
                sqlx::query(undo).execute(&mut conn).await.unwrap();
            }
            crate::digest::digest_tables(&mut conn).await.unwrap()
        });
        let later = ["box_report", "preflight", "leg", "gap"];
        assert!(digests.iter().all(|d| !later.contains(&d.name.as_str())));
        assert_eq!(digests.len(), 15);
        let reader = crate::SessionReader::open(&path).unwrap();
        assert_eq!(reader.box_reports().unwrap(), []);
        assert_eq!(reader.preflight().unwrap(), []);
        // Nobody wrote a header.
        let empty = crate::verify(&path, &mut NoBytes);
        assert!(
            matches!(empty, Err(RecorderError::Empty { .. })),
            "{empty:?}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn links_beside_a_session_lead_nowhere() {
        let folder = tempfile::tempdir().unwrap();
        let victim = folder.path().join("victim");
        std::fs::write(&victim, "precious").unwrap();
        for ending in ["-wal", "-shm", "-journal", "-lock"] {
            let path = folder.path().join(format!("of{ending}.session.sqlite"));
            let link = beside(&path, ending);
            std::os::unix::fs::symlink(&victim, &link).unwrap();
            assert!(crate::SessionWriter::create(&path).is_err(), "{ending}");
            std::fs::remove_file(&link).unwrap();
            drop(crate::SessionWriter::create(&path).unwrap());
            std::os::unix::fs::symlink(&victim, &link).unwrap();
            for refused in [
                crate::SessionReader::open(&path).map(drop),
                crate::SessionWriter::resume(&path, &mut NoBytes).map(drop),
                crate::SessionWriter::ended(&path, &mut NoBytes).map(drop),
            ] {
                let refused = refused.unwrap_err().to_string();
                assert!(refused.contains("a link beside it"), "{refused}");
            }
            assert_eq!(std::fs::read_to_string(&victim).unwrap(), "precious");
        }
    }

    /// A journal that SQLite would play, of a transaction that changed nothing, with a super-journal's name at its end.
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
    fn a_journal_that_names_another_file_is_not_played() {
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
            std::fs::write(beside(&path, "-journal"), journal).unwrap();
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
                crate::SessionWriter::resume(&path, &mut NoBytes).map(drop),
                crate::SessionWriter::ended(&path, &mut NoBytes).map(drop),
                runtime.block_on(open_again(&path)).map(drop),
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
            // What the refusal is for: SQLite itself does delete it.
            unprotected(&path);
            assert!(!victim.exists(), "{mode}");
        }
    }

    #[test]
    fn a_schema_that_runs_is_refused() {
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
