//! The migrations of a session file, oldest first.

use std::sync::LazyLock;

use sqlx::SqlSafeStr;
use sqlx::migrate::{Migration, MigrationType, Migrator};

/// Schema version that this build writes, and the newest that it reads (`PRAGMA user_version`).
pub(crate) const SCHEMA_VERSION: u32 = 14;

/// All migrations, oldest first: version, description and SQL. Listed by hand, because the macro that reads the folder would
/// build SQLite a second time for the compiler.
const MIGRATIONS: [(i64, &str, &str); SCHEMA_VERSION as usize] = [
    (
        20261121000000,
        "session",
        include_str!("../../../migrations/20261121000000_session.sql"),
    ),
    (
        20261121120000,
        "box report",
        include_str!("../../../migrations/20261121120000_box_report.sql"),
    ),
    (
        20261121140000,
        "preflight",
        include_str!("../../../migrations/20261121140000_preflight.sql"),
    ),
    (
        20261121150000,
        "operator",
        include_str!("../../../migrations/20261121150000_operator.sql"),
    ),
    (
        20261121160000,
        "leg",
        include_str!("../../../migrations/20261121160000_leg.sql"),
    ),
    (
        20261121170000,
        "gap",
        include_str!("../../../migrations/20261121170000_gap.sql"),
    ),
    (
        20261121180000,
        "headline",
        include_str!("../../../migrations/20261121180000_headline.sql"),
    ),
    (
        20261122100000,
        "faults",
        include_str!("../../../migrations/20261122100000_faults.sql"),
    ),
    (
        20261122110000,
        "previous seal",
        include_str!("../../../migrations/20261122110000_previous_seal.sql"),
    ),
    (
        20261122120000,
        "completed leg",
        include_str!("../../../migrations/20261122120000_completed_leg.sql"),
    ),
    (
        20261125000000,
        "causes",
        include_str!("../../../migrations/20261125000000_causes.sql"),
    ),
    (
        20261125120000,
        "notification",
        include_str!("../../../migrations/20261125120000_notification.sql"),
    ),
    (
        20261127090000,
        "touch",
        include_str!("../../../migrations/20261127090000_touch.sql"),
    ),
    (
        20261130180000,
        "depth",
        include_str!("../../../migrations/20261130180000_depth.sql"),
    ),
];

pub(crate) static MIGRATOR: LazyLock<Migrator> = LazyLock::new(|| migrator(&MIGRATIONS));

/// Builds a migrator from version, description and SQL of each migration.
fn migrator(migrations: &[(i64, &'static str, &'static str)]) -> Migrator {
    let migrations = migrations.iter().map(|&(version, description, sql)| {
        let kind = MigrationType::Simple;
        Migration::new(version, description.into(), kind, sql.into_sql_str(), false)
    });
    Migrator::with_migrations(migrations.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_of_the_folder_is_a_migration() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../migrations");
        let mut files: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name.ends_with(".sql"))
            .collect();
        files.sort();
        let name = |(version, description, _): (i64, &str, &str)| {
            format!("{version}_{}.sql", description.replace(' ', "_"))
        };
        assert_eq!(files, MIGRATIONS.map(name));
    }
}
