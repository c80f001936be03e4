//! Opens catalogues: kind of file, schema version, and locking between programs.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;
use std::time::{Duration, Instant};

use sqlx::ConnectOptions;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqliteSynchronous};

use crate::address::Address;
use crate::db::Db;
use crate::error::CatalogueError;
use crate::schema::{self, APPLICATION_ID, SCHEMA};

/// Pause between two tries to open a file that another program is creating.
const RETRY: Duration = Duration::from_millis(5);

/// What a catalogue is opened for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// To answer questions: it must exist.
    Read,
    /// To register: created, and its schema brought up to date, if needed.
    Write,
}

/// Opens the catalogue at `address`; waits for other writers for up to `wait`.
pub(crate) async fn open(
    address: &Address,
    access: Access,
    wait: Duration,
) -> Result<Db, CatalogueError> {
    let place = address.to_string();
    let mut db = match address {
        Address::File(path) => {
            let is_there = is_catalogue(path)?;
            if !is_there && access == Access::Read {
                return Err(CatalogueError::Missing { place });
            }
            let mut db = file(path, access, wait).await?;
            check_schema(&mut db, &place).await?;
            db
        }
        #[cfg(feature = "postgres")]
        Address::Server(url) => server(url).await?,
        #[cfg(not(feature = "postgres"))]
        Address::Server(_) => {
            return Err(CatalogueError::Address {
                place,
                expected: "the path of a file",
                found: "a PostgreSQL server: this build has no support for it; build skinrig with `--features postgres`"
                    .to_owned(),
            });
        }
    };
    let sql = |doing, e| CatalogueError::sql(&place, doing, e);
    let found = schema::version(&mut db)
        .await
        .map_err(|e| sql("reading its schema", e))?;
    match found {
        Some(SCHEMA) => Ok(db),
        Some(found) if found > SCHEMA => Err(CatalogueError::OtherSchema {
            place,
            found,
            supported: SCHEMA,
            next: "use the newer skinrig that wrote it",
        }),
        _ if access == Access::Write => {
            let done = schema::migrate(&mut db).await;
            done.map_err(|e| sql("creating its schema", e))?;
            Ok(db)
        }
        None => Err(CatalogueError::Missing { place }),
        Some(found) => Err(CatalogueError::OtherSchema {
            place,
            found,
            supported: SCHEMA,
            next: "`skinrig catalogue rebuild` updates it",
        }),
    }
}

/// Opens a file. Creating one needs it for itself for an instant, for which SQLite does not always wait.
async fn file(path: &Path, access: Access, wait: Duration) -> Result<Db, CatalogueError> {
    let since = Instant::now();
    loop {
        let options = SqliteConnectOptions::new()
            .filename(path)
            .create_if_missing(access == Access::Write)
            .read_only(false)
            // Readers and one writer do not block each other. A power cut may lose the last transactions, whose sessions are then
            // stale; a killed program loses nothing.
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Normal)
            .foreign_keys(true)
            .busy_timeout(wait)
            .pragma("cache_size", "-16384")
            .pragma("trusted_schema", "OFF")
            .row_buffer_size(1024)
            .thread_name(|_| "catalogue-sqlite".to_owned());
        match options.connect().await {
            Ok(conn) => return Ok(Db::Sqlite(conn)),
            Err(e) => {
                let error = CatalogueError::sql(&path.display().to_string(), "opening it", e);
                let is_busy = matches!(error, CatalogueError::Busy { .. });
                if !is_busy || since.elapsed() >= wait {
                    return Err(error);
                }
                tokio::time::sleep(RETRY).await;
            }
        }
    }
}

/// Rejects what a catalogue never has: views and triggers of an untrusted file would run when it is read or written, for unlimited
/// time. The SQLite client panics on names that are not UTF-8.
async fn check_schema(db: &mut Db, place: &str) -> Result<(), CatalogueError> {
    let sql = "SELECT type IN ('table', 'index') AND rootpage > 0, hex(coalesce(sql, '')) FROM sqlite_schema";
    let found = db.fetch(sql, &[]).await;
    let found = found.map_err(|e| CatalogueError::sql(place, "reading its schema", e))?;
    let foreign = |found: &str| CatalogueError::Foreign {
        place: place.to_owned(),
        found: found.to_owned(),
    };
    for row in &found.rows {
        if row[0].as_integer() != Some(1) {
            return Err(foreign("a file with views or triggers"));
        }
        let bytes = row[1].as_text().map(bytes_of).unwrap_or_default();
        if std::str::from_utf8(&bytes).is_err() {
            return Err(foreign("a schema that is not UTF-8"));
        }
    }
    Ok(())
}

/// The bytes of hexadecimal digits.
fn bytes_of(hex: &str) -> Vec<u8> {
    let pairs = hex.as_bytes().chunks(2);
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok();
    pairs.filter_map(byte).collect()
}

#[cfg(feature = "postgres")]
async fn server(url: &crate::address::ServerUrl) -> Result<Db, CatalogueError> {
    use std::str::FromStr;

    let place = url.to_string();
    let options = sqlx::postgres::PgConnectOptions::from_str(url.as_str()).map_err(|_| {
        CatalogueError::Address {
            place: place.clone(),
            expected: "postgres://USER@HOST/DATABASE",
            found: "another form".to_owned(),
        }
    })?;
    let opened = options.application_name("skinrig").connect().await;
    Ok(Db::Postgres(
        opened.map_err(|e| CatalogueError::connection(&place, e))?,
    ))
}

/// True for a catalogue, false for a missing or empty file. Layout: sqlite.org/fileformat.html section 1.3.
pub(crate) fn is_catalogue(path: &Path) -> Result<bool, CatalogueError> {
    let io = |source| CatalogueError::Io {
        path: path.to_owned(),
        doing: "reading it",
        source,
    };
    let foreign = |found: &str| {
        Err(CatalogueError::Foreign {
            place: path.display().to_string(),
            found: found.to_owned(),
        })
    };
    match std::fs::symlink_metadata(path) {
        Ok(m) if !m.is_file() => return foreign("a folder, a link or a device"),
        Ok(_) => {}
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(false),
        Err(e) => return Err(io(e)),
    }
    let mut page = Vec::new();
    let file = File::open(path).map_err(io)?;
    file.take(108).read_to_end(&mut page).map_err(io)?;
    if page.is_empty() {
        // Another program has created it and not written yet.
        return Ok(false);
    }
    if page.len() < 108 || !page.starts_with(b"SQLite format 3\0") {
        return foreign("a file that is not SQLite");
    }
    let application = u32::from_be_bytes([page[68], page[69], page[70], page[71]]);
    // At first its content is in the log beside it, and the file has no table.
    let is_blank = page[100] == 0x0d && page[103..105] == [0, 0];
    match application {
        APPLICATION_ID => Ok(true),
        0 if is_blank => Ok(true),
        _ => foreign("an SQLite file of another program"),
    }
}

/// Deletes a catalogue file and those that SQLite keeps beside it.
pub(crate) fn remove(path: &Path) -> Result<(), CatalogueError> {
    for ending in ["-wal", "-shm", ""] {
        let mut file = path.as_os_str().to_owned();
        file.push(ending);
        match std::fs::remove_file(&file) {
            Err(e) if e.kind() != ErrorKind::NotFound => {
                return Err(CatalogueError::Io {
                    path: file.into(),
                    doing: "deleting it",
                    source: e,
                });
            }
            _ => {}
        }
    }
    Ok(())
}
