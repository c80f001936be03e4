//! The schema of a catalogue, one text for both databases, and its migrations.

use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::{Connection, SqlSafeStr};

use crate::db::Db;

/// All migrations, oldest first: version, description and SQL.
pub(crate) const MIGRATIONS: [(i64, &str, &str); 4] = [
    (
        20261127000000,
        "catalogue",
        include_str!("../../../migrations/catalogue/20261127000000_catalogue.sql"),
    ),
    (
        20261128000000,
        "presses",
        include_str!("../../../migrations/catalogue/20261128000000_presses.sql"),
    ),
    (
        20261129000000,
        "left out",
        include_str!("../../../migrations/catalogue/20261129000000_left_out.sql"),
    ),
    (
        20261130000000,
        "trends",
        include_str!("../../../migrations/catalogue/20261130000000_trends.sql"),
    ),
];

/// `skrc` in ASCII (`PRAGMA application_id`): distinguishes a catalogue from any other SQLite file.
pub(crate) const APPLICATION_ID: u32 = u32::from_be_bytes(*b"skrc");

/// Version of the schema that this build reads and writes: that of the last migration.
pub(crate) const SCHEMA: i64 = MIGRATIONS[MIGRATIONS.len() - 1].0;

/// Marks a file as a catalogue.
const MARK: &str = "PRAGMA application_id = 1936421475";

fn migrator() -> Migrator {
    let migrations = MIGRATIONS.into_iter().map(|(version, description, sql)| {
        let kind = MigrationType::Simple;
        Migration::new(version, description.into(), kind, sql.into_sql_str(), false)
    });
    Migrator::with_migrations(migrations.collect())
}

/// Brings the schema up to this build, in one transaction: of two programs that create a catalogue at once, one waits.
pub(crate) async fn migrate(db: &mut Db) -> Result<(), sqlx::Error> {
    match db {
        Db::Sqlite(conn) => {
            let mut all = conn.begin_with("BEGIN IMMEDIATE").await?;
            sqlx::query(MARK).execute(&mut *all).await?;
            migrator().run(&mut *all).await.map_err(sqlx::Error::from)?;
            all.commit().await
        }
        #[cfg(feature = "postgres")]
        // The migrator itself excludes others.
        Db::Postgres(conn) => migrator().run(conn).await.map_err(sqlx::Error::from),
    }
}

/// The version of the schema; `None` without one.
pub(crate) async fn version(db: &mut Db) -> Result<Option<i64>, sqlx::Error> {
    let there = match db {
        Db::Sqlite(_) => {
            "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name = '_sqlx_migrations'"
        }
        #[cfg(feature = "postgres")]
        Db::Postgres(_) => {
            "SELECT count(*) FROM pg_tables
             WHERE schemaname = current_schema() AND tablename = '_sqlx_migrations'"
        }
    };
    let found = db.fetch(there, &[]).await?;
    if found.rows.first().and_then(|row| row[0].as_integer()) == Some(0) {
        return Ok(None);
    }
    let newest = db
        .fetch("SELECT max(version) FROM _sqlx_migrations", &[])
        .await?;
    Ok(newest.rows.first().and_then(|row| row[0].as_integer()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_file_is_marked() {
        assert!(MARK.ends_with(&format!("= {APPLICATION_ID}")));
    }

    #[test]
    fn every_file_of_the_folder_is_a_migration() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../migrations/catalogue");
        let mut files: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        files.sort();
        let name = |(version, description, _): (i64, &str, &str)| {
            format!("{version}_{}.sql", description.replace(' ', "_"))
        };
        assert_eq!(files, MIGRATIONS.map(name));
    }
}
