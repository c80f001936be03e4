//! A folder of small recorded sessions, and the rows of a catalogue.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use skinrig_catalogue::{Access, Address, CATALOGUE_FILE, Catalogue};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{Column, ConnectOptions, Row, ValueRef};
use tempfile::TempDir;

use crate::common;

/// Long enough for any other program of a test.
pub(crate) const WAIT: Duration = Duration::from_secs(60);

/// A folder with sessions.
pub(crate) struct Lab(TempDir);

impl Lab {
    /// A folder with the sessions `0.session.sqlite`, `1.session.sqlite`, ..., of 3, 4, ... presses.
    pub(crate) fn with_sessions(count: u32) -> Self {
        let lab = Self(tempfile::tempdir().unwrap());
        for n in 0..count {
            common::sealed(&lab.session(n), 3 + n % 4);
        }
        lab
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    pub(crate) fn session(&self, n: u32) -> PathBuf {
        self.0.path().join(format!("{n}.session.sqlite"))
    }

    pub(crate) fn file(&self) -> PathBuf {
        self.0.path().join(CATALOGUE_FILE)
    }

    pub(crate) fn open(&self) -> Catalogue {
        let address = Address::of_folder(self.path());
        Catalogue::open(address, Access::Write, WAIT).unwrap()
    }

    /// Every row of every table but the migrations, as text, sorted.
    pub(crate) fn dump(&self) -> String {
        dump(&self.file())
    }
}

/// All tables of a catalogue but that of the migrations.
pub(crate) const TABLES: [&str; 17] = [
    "SELECT * FROM session",
    "SELECT * FROM session_file",
    "SELECT * FROM unreadable_file",
    "SELECT * FROM leg",
    "SELECT * FROM press_fault",
    "SELECT * FROM device",
    "SELECT * FROM analysis",
    "SELECT * FROM clock_fit",
    "SELECT * FROM calibration",
    "SELECT * FROM calibration_value",
    "SELECT * FROM press",
    "SELECT * FROM tag",
    "SELECT * FROM note",
    "SELECT * FROM night",
    "SELECT * FROM night_value",
    "SELECT * FROM night_acceptance",
    "SELECT * FROM prototype",
];

/// Every row of every table of a catalogue but the migrations, as text, sorted.
pub(crate) fn dump(file: &Path) -> String {
    let sql = "SELECT count(*) FROM sqlite_schema
               WHERE type = 'table' AND name NOT LIKE '!_%' ESCAPE '!' AND name NOT LIKE 'sqlite%'";
    assert_eq!(column(file, sql), [TABLES.len().to_string()]);
    let mut text = String::new();
    for table in TABLES {
        let mut rows = rows(file, table);
        rows.sort();
        for row in rows {
            writeln!(text, "{table} {row}").unwrap();
        }
    }
    text
}

/// The first column of a query on a catalogue file, as text.
pub(crate) fn column(file: &Path, sql: &'static str) -> Vec<String> {
    let rows = rows(file, sql).into_iter();
    rows.map(|row| {
        row.split('|')
            .next()
            .unwrap()
            .split_once('=')
            .unwrap()
            .1
            .to_owned()
    })
    .collect()
}

/// Rows of a query on a catalogue file, each as `column=value|...`.
pub(crate) fn rows(file: &Path, sql: &'static str) -> Vec<String> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_time()
        .build()
        .unwrap();
    runtime.block_on(async {
        let mut conn = SqliteConnectOptions::new()
            .filename(file)
            .connect()
            .await
            .unwrap();
        let found = sqlx::query(sql).fetch_all(&mut conn).await;
        let text = |row: &sqlx::sqlite::SqliteRow| {
            let cells = row.columns().iter().map(|column| {
                let at = column.ordinal();
                let value = match row.try_get_raw(at).unwrap().is_null() {
                    true => "null".to_owned(),
                    false => row
                        .try_get::<String, _>(at)
                        .or_else(|_| row.try_get::<i64, _>(at).map(|v| v.to_string()))
                        .or_else(|_| row.try_get::<f64, _>(at).map(|v| v.to_string()))
                        .unwrap(),
                };
                format!("{}={value}", column.name())
            });
            cells.collect::<Vec<_>>().join("|")
        };
        found.unwrap().iter().map(text).collect()
    })
}
