//! Missing, foreign, damaged and locked catalogue files.

use std::time::Duration;

use skinrig_catalogue::{Access, Address, Catalogue, CatalogueError};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection};

use crate::support::{Lab, WAIT};

fn open(lab: &Lab, access: Access) -> Result<Catalogue, CatalogueError> {
    Catalogue::open(Address::of_folder(lab.path()), access, WAIT)
}

/// Runs statements on a file that is no session.
fn execute(file: &std::path::Path, statements: &[&'static str]) {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .unwrap();
    runtime.block_on(async {
        let options = SqliteConnectOptions::new()
            .filename(file)
            .create_if_missing(true);
        let mut conn = options.connect().await.unwrap();
        for statement in statements {
            sqlx::query(*statement).execute(&mut conn).await.unwrap();
        }
        conn.close().await.unwrap();
    });
}

#[test]
fn only_a_catalogue_is_opened() {
    let lab = Lab::with_sessions(0);
    assert!(matches!(
        open(&lab, Access::Read),
        Err(CatalogueError::Missing { .. })
    ));
    assert!(!lab.file().exists());
    for content in [b"no SQLite file".repeat(20), vec![0; 4096]] {
        std::fs::write(lab.file(), &content).unwrap();
        for access in [Access::Read, Access::Write] {
            assert!(matches!(
                open(&lab, access),
                Err(CatalogueError::Foreign { .. })
            ));
        }
        assert_eq!(std::fs::read(lab.file()).unwrap(), content);
        std::fs::remove_file(lab.file()).unwrap();
    }
    // Another program's database, with and without a mark of its own.
    for mark in [
        "PRAGMA application_id = 1936421479",
        "PRAGMA application_id = 0",
    ] {
        execute(&lab.file(), &[mark, "CREATE TABLE precious (x)"]);
        assert!(matches!(
            open(&lab, Access::Write),
            Err(CatalogueError::Foreign { .. })
        ));
        std::fs::remove_file(lab.file()).unwrap();
    }
    std::fs::create_dir(lab.file()).unwrap();
    assert!(matches!(
        open(&lab, Access::Write),
        Err(CatalogueError::Foreign { .. })
    ));
}

#[test]
fn a_catalogue_that_would_run_code_is_rejected() {
    for statement in [
        "CREATE TRIGGER t AFTER INSERT ON session BEGIN DELETE FROM tag; END",
        "CREATE VIEW v AS SELECT 1",
        "CREATE TABLE x (\"a\u{fffd}\" TEXT)",
    ] {
        let lab = Lab::with_sessions(1);
        open(&lab, Access::Write).unwrap().close().unwrap();
        execute(&lab.file(), &[statement]);
        // Text that is not UTF-8 in a name.
        let mut bytes = std::fs::read(lab.file()).unwrap();
        let mark = "\u{fffd}".as_bytes();
        while let Some(at) = bytes.windows(3).position(|w| w == mark) {
            bytes[at..at + 3].fill(0xff);
        }
        std::fs::write(lab.file(), &bytes).unwrap();
        for access in [Access::Read, Access::Write] {
            let found = open(&lab, access);
            assert!(
                matches!(found, Err(CatalogueError::Foreign { .. })),
                "{statement}: {found:?}"
            );
        }
    }
}

#[test]
fn another_schema_is_rejected() {
    let lab = Lab::with_sessions(0);
    drop(open(&lab, Access::Write).unwrap());
    drop(open(&lab, Access::Read).unwrap());
    execute(
        &lab.file(),
        &["UPDATE _sqlx_migrations SET version = version + 1"],
    );
    for access in [Access::Read, Access::Write] {
        assert!(matches!(
            open(&lab, access),
            Err(CatalogueError::OtherSchema { .. })
        ));
    }
}

#[test]
fn a_damaged_catalogue_is_reported() {
    let lab = Lab::with_sessions(2);
    let mut catalogue = open(&lab, Access::Write).unwrap();
    catalogue.refresh(lab.path(), false).unwrap();
    catalogue.close().unwrap();
    let mut bytes = std::fs::read(lab.file()).unwrap();
    bytes[108..].fill(0x55);
    std::fs::write(lab.file(), bytes).unwrap();
    let error = open(&lab, Access::Write).unwrap_err();
    assert!(matches!(error, CatalogueError::Damaged { .. }), "{error:?}");
    let address = Address::of_folder(lab.path());
    let (catalogue, done) = Catalogue::rebuild(address, lab.path(), WAIT).unwrap();
    drop(catalogue);
    assert_eq!(done.registered.len(), 2);
    let status = open(&lab, Access::Read).unwrap().status(lab.path());
    assert_eq!(status.unwrap().current, 2);
}

#[test]
fn a_locked_catalogue_is_busy_and_not_waited_for() {
    let lab = Lab::with_sessions(1);
    drop(open(&lab, Access::Write).unwrap());
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .unwrap();
    let options = SqliteConnectOptions::new().filename(lab.file());
    let mut other = runtime.block_on(options.connect()).unwrap();
    let lock = sqlx::query("BEGIN EXCLUSIVE").execute(&mut other);
    runtime.block_on(lock).unwrap();
    let address = Address::of_folder(lab.path());
    let mut catalogue = Catalogue::open(address, Access::Write, Duration::ZERO).unwrap();
    // Readers go on.
    assert_eq!(catalogue.status(lab.path()).unwrap().stale.len(), 1);
    let busy = catalogue.register(&[lab.session(0)]).unwrap_err();
    assert!(matches!(busy, CatalogueError::Busy { .. }), "{busy:?}");
    drop(other);
    assert_eq!(
        catalogue
            .register(&[lab.session(0)])
            .unwrap()
            .registered
            .len(),
        1
    );
}
