//! Catalogues of earlier versions, with data in every table: nothing is lost, and whatever they lack is read again.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use skinrig_catalogue::{Access, Address, Catalogue, CatalogueError};
use skinrig_nightly::trend::Filter;
use sqlx::migrate::{Migration, MigrationType, Migrator};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection, Executor, SqlSafeStr};

use crate::support::{Lab, TABLES, WAIT, column, dump, rows};
use crate::{nights, sessions, synthetic};

/// The files of the migrations, oldest first.
fn files() -> Vec<PathBuf> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../migrations/catalogue");
    let entries = std::fs::read_dir(folder).unwrap();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// Statements of a test, which live as long as it.
fn fixed(text: String) -> &'static str {
    text.leak()
}

/// The first `count` migrations.
fn migrator(count: usize) -> Migrator {
    let migrations = files().into_iter().take(count).map(|file| {
        let name = file.file_stem().unwrap().to_string_lossy().into_owned();
        let (version, description) = name.split_once('_').unwrap();
        let sql = fixed(std::fs::read_to_string(&file).unwrap());
        Migration::new(
            version.parse().unwrap(),
            description.replace('_', " ").into(),
            MigrationType::Simple,
            sql.into_sql_str(),
            false,
        )
    });
    Migrator::with_migrations(migrations.collect())
}

/// How many of two sessions are stale after the migrations that follow the first `count`.
fn stale_after(count: usize) -> usize {
    let makes_stale = |file: &PathBuf| {
        let sql = std::fs::read_to_string(file).unwrap();
        sql.contains("UPDATE session_file SET fingerprint = ''")
    };
    2 * usize::from(files()[count..].iter().any(makes_stale))
}

/// A lab whose catalogue has rows in every table but that of unreadable files.
fn lab() -> Lab {
    let lab = Lab::with_sessions(2);
    sessions::write_results(&lab, 0);
    sessions::add_tag(&lab, 0);
    synthetic::write_prototypes(lab.path());
    synthetic::write_nights(&lab.path().join("nights"), 2);
    let mut catalogue = lab.open();
    catalogue.refresh(lab.path(), false).unwrap();
    let nights = lab.path().join("nights");
    catalogue.register_nights(&nights).unwrap();
    catalogue
        .replace_acceptances(&nights, &[nights::accepted(None)])
        .unwrap();
    catalogue.close().unwrap();
    lab
}

/// Statements that insert all rows of the catalogue `file`, without the columns that a table of `tables` does not have. `store` is the
/// name of its folder there.
fn inserts(file: &Path, tables: &[(String, Vec<String>)], store: &str) -> String {
    let mut text = String::new();
    let computer = store
        .split_once(':')
        .map_or(String::new(), |(name, _)| format!("{name}:"));
    for select in TABLES {
        let table = select.rsplit(' ').next().unwrap();
        let Some((_, columns)) = tables.iter().find(|(name, _)| name == table) else {
            continue;
        };
        for row in rows(file, select) {
            let cells = row.split('|').map(|cell| cell.split_once('=').unwrap());
            let own = cells.filter(|(name, _)| columns.iter().any(|c| c == name));
            let literal = |(name, value): (&str, &str)| match (name, value) {
                ("store", _) => format!("'{store}'"),
                ("folder", path) => format!("'{computer}{path}'"),
                (_, "null") => "NULL".to_owned(),
                (_, text) => format!("'{text}'"),
            };
            let (names, values): (Vec<_>, Vec<_>) = own.map(|c| (c.0, literal(c))).unzip();
            let (names, values) = (names.join(", "), values.join(", "));
            writeln!(text, "INSERT INTO {table} ({names}) VALUES ({values});").unwrap();
        }
    }
    text
}

/// Tables with their columns, of lines `table column`.
fn tables(lines: Vec<String>) -> Vec<(String, Vec<String>)> {
    let mut all: Vec<(String, Vec<String>)> = Vec::new();
    for line in lines {
        let (table, column) = line.split_once(' ').unwrap();
        match all.iter_mut().find(|(name, _)| name == table) {
            Some((_, columns)) => columns.push(column.to_owned()),
            None => all.push((table.to_owned(), vec![column.to_owned()])),
        }
    }
    all
}

fn block_on<T>(work: impl Future<Output = T>) -> T {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build();
    runtime.unwrap().block_on(work)
}

/// A catalogue whose schema is that of the first `count` migrations, with the rows of `from`.
fn write_earlier(file: &Path, count: usize, from: &Path) {
    let options = SqliteConnectOptions::new()
        .filename(file)
        .create_if_missing(true);
    block_on(async {
        let mut conn = options.connect().await.unwrap();
        conn.execute("PRAGMA application_id = 1936421475")
            .await
            .unwrap();
        migrator(count).run(&mut conn).await.unwrap();
        conn.close().await.unwrap();
    });
    let columns = "SELECT t.name || ' ' || c.name AS line FROM sqlite_schema t JOIN pragma_table_info(t.name) c WHERE t.type = 'table'";
    let text = inserts(from, &tables(column(file, columns)), "");
    block_on(async {
        let mut conn = SqliteConnectOptions::new()
            .filename(file)
            .connect()
            .await
            .unwrap();
        conn.execute(fixed(text)).await.unwrap();
        conn.close().await.unwrap();
    });
}

#[test]
fn earlier_catalogues_keep_their_data_and_read_the_rest_again() {
    let lab = lab();
    let current = lab.path().join("current.sqlite");
    std::fs::rename(lab.file(), &current).unwrap();
    let expected = dump(&current);
    for count in 1..files().len() {
        write_earlier(&lab.file(), count, &current);
        let address = Address::of_folder(lab.path());
        let reading = Catalogue::open(address, Access::Read, WAIT).unwrap_err();
        assert!(
            matches!(reading, CatalogueError::OtherSchema { .. })
                && reading.to_string().contains("skinrig catalogue rebuild"),
            "{reading}"
        );
        let mut catalogue = lab.open();
        for table in ["session", "analysis", "tag", "note", "night", "prototype"] {
            let of = |text: &str| text.matches(&format!("FROM {table} ")).count();
            assert_eq!(of(&lab.dump()), of(&expected), "{count}: {table}");
            assert_ne!(of(&expected), 0, "{table}");
        }
        // What they lack makes their sessions stale.
        let stale = stale_after(count);
        let status = catalogue.status(lab.path()).unwrap();
        assert_eq!(
            (status.current, status.stale.len()),
            (2 - stale, stale),
            "{count}"
        );
        let done = catalogue.refresh(lab.path(), false).unwrap();
        assert_eq!(done.registered.len(), stale, "{count}");
        // So do nights, which the trends leave out until then.
        assert_eq!(
            catalogue.nights(&Filter::default()).unwrap().outdated,
            2,
            "{count}"
        );
        let nights = lab.path().join("nights");
        assert_eq!(catalogue.register_nights(&nights).unwrap().registered, 2);
        catalogue
            .replace_acceptances(&nights, &[nights::accepted(None)])
            .unwrap();
        assert!(lab.dump() == expected, "{count}");
        catalogue.close().unwrap();
        std::fs::remove_file(lab.file()).unwrap();
    }
}

#[cfg(unix)]
#[test]
fn earlier_catalogues_of_a_server_do_so_too() {
    use sqlx::postgres::PgConnectOptions;

    let Some(server) = crate::server::Server::start() else {
        return;
    };
    let lab = lab();
    let mut current = server.open().unwrap();
    current.refresh(lab.path(), false).unwrap();
    let nights = lab.path().join("nights");
    current.register_nights(&nights).unwrap();
    current
        .replace_acceptances(&nights, &[nights::accepted(None)])
        .unwrap();
    let store = server.rows("postgres", "SELECT DISTINCT store FROM session_file");
    let store = store[0]
        .trim_start_matches("Some(\"")
        .trim_end_matches("\")")
        .to_owned();
    let expected = server.dump("postgres");
    for count in 1..files().len() {
        let name = format!("earlier{count}");
        server.create(&name);
        let options: PgConnectOptions = server.url(&name).parse().unwrap();
        block_on(async {
            let mut conn = options.clone().connect().await.unwrap();
            migrator(count).run(&mut conn).await.unwrap();
        });
        let columns = server.rows(
            &name,
            "SELECT table_name || ' ' || column_name FROM information_schema.columns WHERE table_schema = 'public'",
        );
        let plain = |line: String| {
            line.trim_start_matches("Some(\"")
                .trim_end_matches("\")")
                .to_owned()
        };
        let columns = tables(columns.into_iter().map(plain).collect());
        let text = inserts(&lab.file(), &columns, &store);
        block_on(async {
            let mut conn = options.connect().await.unwrap();
            conn.execute(fixed(text)).await.unwrap();
        });
        let address = Address::parse(server.url(&name).as_ref());
        let mut catalogue = Catalogue::open(address, Access::Write, WAIT).unwrap();
        let stale = stale_after(count);
        let status = catalogue.status(lab.path()).unwrap();
        assert_eq!(
            (status.current, status.stale.len()),
            (2 - stale, stale),
            "{count}"
        );
        catalogue.refresh(lab.path(), false).unwrap();
        catalogue.register_nights(&nights).unwrap();
        catalogue
            .replace_acceptances(&nights, &[nights::accepted(None)])
            .unwrap();
        assert!(server.dump(&name) == expected, "{count}");
    }
}
