//! Creating session files, and opening them for writing; versions of the schema.

use std::fs::File;
use std::path::Path;
use std::time::Duration;

use sqlx::sqlite::{SqliteConnectOptions, SqliteConnection, SqliteJournalMode, SqliteSynchronous};
use sqlx::{ConnectOptions, Connection, Sqlite, Transaction};

use crate::error::RecorderError;
use crate::migrations::MIGRATOR;
use crate::query::Fault;
use crate::sidecar::{reject_special_files, reject_super_journal};

/// `skrg` in ASCII (`PRAGMA application_id`).
pub(crate) const APPLICATION_ID: u32 = u32::from_be_bytes(*b"skrg");

/// Page size in bytes, the largest that SQLite supports. Each page of camera bytes costs three system calls on its way
/// through the log: 64 KiB pages sustained 500 MB/s, 16 KiB pages 380 (`cargo bench -p skinrig-bench --bench ingest`).
/// The cost: an empty session has 1.4 MB, and a commit of one small row writes 128 KiB.
pub(crate) const PAGE_BYTES: u32 = 65536;

/// Log pages that trigger a checkpoint: 16 MiB, which fit in the system's cache. A longer log was no faster.
/// Checkpoints on a thread of their own made ingest 6 % faster, which is not worth a thread.
const CHECKPOINT_PAGES: u32 = 256;

/// How long to wait for a lock of another program.
pub(crate) const BUSY_TIMEOUT: Duration = Duration::from_secs(10);

/// Creates a session file with an empty schema.
pub(crate) async fn create(path: &Path) -> Result<SqliteConnection, RecorderError> {
    create_file(path)?;
    create_schema(path).await
}

/// Creates an empty file.
pub(crate) fn create_file(path: &Path) -> Result<(), RecorderError> {
    reject_special_files(path)?;
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

/// Creates the schema in an empty file.
pub(crate) async fn create_schema(path: &Path) -> Result<SqliteConnection, RecorderError> {
    let fault = |e: sqlx::Error| Fault::from(e).at(path, "creating the schema");
    let mut conn = new_file(path).await.map_err(fault)?;
    // One transaction: each costs two waits for the disk.
    let mut all = conn.begin_with("BEGIN IMMEDIATE").await.map_err(fault)?;
    let done = migrate(&mut all).await;
    done.map_err(|fault| fault.at(path, "creating the schema"))?;
    all.commit().await.map_err(fault)?;
    Ok(conn)
}

async fn new_file(path: &Path) -> sqlx::Result<SqliteConnection> {
    writable(path)
        .page_size(PAGE_BYTES)
        .journal_mode(SqliteJournalMode::Wal)
        // Measured: after a power cut NORMAL lost acknowledged rows, FULL none.
        .synchronous(SqliteSynchronous::Full)
        .connect()
        .await
}

/// Creates a file with the schema of an older version of skinrig.
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

pub(crate) fn writable(path: &Path) -> SqliteConnectOptions {
    SqliteConnectOptions::new()
        .filename(path)
        .pragma("wal_autocheckpoint", CHECKPOINT_PAGES.to_string())
        .foreign_keys(true)
        .busy_timeout(BUSY_TIMEOUT)
        .thread_name(|_| "session-sqlite".to_owned())
}

/// Opens an existing session for writing, in its current journal mode: sealed sessions are in rollback mode.
pub(crate) async fn reopen(path: &Path) -> Result<SqliteConnection, RecorderError> {
    reject_super_journal(path)?;
    allow_writing(path).map_err(|source| RecorderError::Io {
        path: path.to_owned(),
        doing: "making it writable",
        source,
    })?;
    writable(path)
        // In rollback mode a transaction is durable only if its folder is synchronised too.
        .synchronous(SqliteSynchronous::Extra)
        .connect()
        .await
        .map_err(|e| Fault::from(e).at(path, "opening it for writing"))
}

/// Migrates the schema to this build's version within a transaction. Data that an older schema lacks stay empty.
pub(crate) async fn migrate(all: &mut Transaction<'_, Sqlite>) -> Result<(), Fault> {
    let done = MIGRATOR.run(&mut **all).await;
    done.map_err(|e| Fault::from(sqlx::Error::from(e)))
}

/// Switches to a write-ahead log, as in a new session.
pub(crate) async fn enable_wal(conn: &mut SqliteConnection) -> Result<(), Fault> {
    let mode: String = sqlx::query_scalar("PRAGMA journal_mode = WAL")
        .fetch_one(&mut *conn)
        .await?;
    if mode != "wal" {
        return Err(Fault::bad("journal mode", "wal", mode));
    }
    sqlx::query("PRAGMA synchronous = FULL")
        .execute(&mut *conn)
        .await?;
    // Creates the log and its index.
    sqlx::query("SELECT count(*) FROM sqlite_schema")
        .execute(conn)
        .await?;
    Ok(())
}

/// Makes a sealed, read-only session writable.
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

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    use crate::digest::EarlierState;
    use crate::migrations::SCHEMA_VERSION;

    pub(crate) struct NullScanner;
    impl crate::ChunkScanner for NullScanner {
        fn new(_: skinrig_model::StreamFormat) -> Self {
            Self
        }
        fn restart(&mut self, _: u64) {}
        fn lost(&mut self, _: u64) {}
        fn scan(
            &mut self,
            _: &[u8],
        ) -> (skinrig_model::ChunkFacts, Vec<skinrig_model::TriggerEdge>) {
            Default::default()
        }
    }

    #[test]
    fn the_version_counts_the_migrations() {
        assert_eq!(MIGRATOR.iter().count(), SCHEMA_VERSION as usize);
    }

    /// Schema 10 recreates the table of legs, although archived seals refer to its rows.
    #[test]
    fn legs_and_their_references_survive_the_migration() {
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

            let mut conn = reopen(&path).await.unwrap();
            let mut all = conn.begin_with("BEGIN IMMEDIATE").await.unwrap();
            migrate(&mut all).await.unwrap();
            let of_completed = "UPDATE leg SET previous_status = 'completed', previous_reason = NULL WHERE number = ?";
            all.commit().await.unwrap();
            // Schema 11 added a column to it.
            let earlier = EarlierState {
                leg: i64::MAX,
                schema: 9,
                last_seq: [-1; 2],
                tables: std::slice::from_ref(&before),
            };
            let tables = crate::digest::digest_earlier(&mut conn, &earlier).await.unwrap();
            assert!(tables.contains(&before));
            sqlx::query(of_completed).bind(3).execute(&mut conn).await.unwrap();
            // References to the legs are still enforced.
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

    /// A sealed session of schema 1 can be read and verified as before: later tables are not part of it.
    #[test]
    fn sessions_of_the_first_schema_stay_valid() {
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
                "DROP TABLE notification",
                "DROP TABLE touch",
                "DROP TABLE previous_table_digest",
                "DROP TABLE previous_seal",
                "ALTER TABLE attempt DROP COLUMN leg",
                "ALTER TABLE attempt DROP COLUMN touched_mm",
                "ALTER TABLE attempt DROP COLUMN faults",
                "ALTER TABLE attempt DROP COLUMN cause",
                "ALTER TABLE interruption DROP COLUMN cause",
                "ALTER TABLE run_end DROP COLUMN cause",
                "DELETE FROM _sqlx_migrations WHERE version > 20261121000000",
                "PRAGMA user_version = 1",
                "PRAGMA journal_mode = DELETE",
            ] {
                sqlx::query(undo).execute(&mut conn).await.unwrap();
            }
            crate::digest::digest_tables(&mut conn).await.unwrap()
        });
        let later = [
            "box_report",
            "preflight",
            "leg",
            "gap",
            "notification",
            "touch",
        ];
        assert!(digests.iter().all(|d| !later.contains(&d.name.as_str())));
        assert_eq!(digests.len(), 15);
        let reader = crate::SessionReader::open(&path).unwrap();
        assert_eq!(reader.box_reports().unwrap(), []);
        assert_eq!(reader.preflight().unwrap(), []);
        // Without a header.
        let empty = crate::verify::<NullScanner>(&path);
        assert!(
            matches!(empty, Err(RecorderError::Empty { .. })),
            "{empty:?}"
        );
    }
}
