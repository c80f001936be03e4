//! A PostgreSQL server of one test: unprivileged, in a temporary folder, reachable by a socket in the file system alone.
#![expect(clippy::print_stderr, reason = "says what was skipped")]

use std::ffi::OsString;
use std::os::unix::fs::{MetadataExt, PermissionsExt, chown};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use skinrig_catalogue::{Access, Address, Catalogue, CatalogueError};
use sqlx::postgres::{PgConnectOptions, PgRow};
use sqlx::{ConnectOptions, Row};
use tempfile::TempDir;

use crate::support::{TABLES, WAIT};

/// The server does not run as root: then it runs as `nobody`.
const NOBODY: u32 = 65_534;

/// A running server; it ends with the test.
pub(crate) struct Server {
    folder: TempDir,
    programs: PathBuf,
    /// Options of the server process beside its socket.
    options: String,
    /// Also part of the name of its socket.
    port: u16,
}

impl Server {
    /// Starts a server; `None`, with a message, where PostgreSQL is not installed.
    pub(crate) fn start() -> Option<Self> {
        let Some(programs) = programs() else {
            eprintln!("skipped: no PostgreSQL server (initdb): install Debian's `postgresql`");
            return None;
        };
        let folder = tempfile::tempdir_in("/tmp").unwrap();
        std::fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o755)).unwrap();
        let own = folder.path().join("own");
        std::fs::create_dir(&own).unwrap();
        let server = Self {
            folder,
            programs,
            options: "-c listen_addresses=''".to_owned(),
            port: 5432,
        };
        if is_root() {
            chown(&own, Some(NOBODY), Some(NOBODY)).unwrap();
        }
        let data = own.join("data");
        let users = [
            "--username=skinrig",
            "--auth=trust",
            "--no-sync",
            "--encoding=UTF8",
            "--no-locale",
            "--pgdata",
        ];
        server.run(
            "initdb",
            users.map(OsString::from).into_iter().chain([data.into()]),
        );
        server.run_again();
        Some(server)
    }

    fn own(&self) -> PathBuf {
        self.folder.path().join("own")
    }

    /// Starts the server, for the first time or after a kill, and waits until it answers.
    pub(crate) fn run_again(&self) {
        let own = self.own();
        let options = format!("-k {} {}", own.display(), self.options);
        let words = [
            "-w".into(),
            "-D".into(),
            own.join("data").into_os_string(),
            "-l".into(),
            own.join("log").into_os_string(),
            "-o".into(),
            options.into(),
            "start".into(),
        ];
        self.run("pg_ctl", words);
    }

    /// Ends all processes of the server at once, as a power cut would.
    pub(crate) fn kill(&self) {
        let words = ["-D".into(), self.own().join("data").into_os_string()];
        let tail = ["-m", "immediate", "stop"].map(OsString::from);
        self.run("pg_ctl", words.into_iter().chain(tail));
    }

    /// Starts it again, on a port of this computer that takes encrypted connections alone; returns the port.
    #[cfg(feature = "tls")]
    pub(crate) fn encrypt(&mut self) -> u16 {
        let own = self.own();
        for (name, mode) in [("server.pem", 0o644), ("server.key", 0o600)] {
            let to = own.join(name);
            let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/register/tls");
            std::fs::copy(from.join(name), &to).unwrap();
            std::fs::set_permissions(&to, PermissionsExt::from_mode(mode)).unwrap();
            if is_root() {
                chown(&to, Some(NOBODY), Some(NOBODY)).unwrap();
            }
        }
        let allowed = "local all all trust\nhostssl all all 127.0.0.1/32 trust\nhostssl all all ::1/128 trust\n";
        std::fs::write(own.join("data/pg_hba.conf"), allowed).unwrap();
        let free = std::net::TcpListener::bind(("127.0.0.1", 0)).unwrap();
        let port = free.local_addr().unwrap().port();
        drop(free);
        self.port = port;
        self.options = format!(
            "-c listen_addresses=localhost -c port={port} -c ssl=on -c ssl_cert_file={own}/server.pem \
             -c ssl_key_file={own}/server.key",
            own = own.display()
        );
        self.kill();
        self.run_again();
        port
    }

    /// Starts it again without encryption, on the same port.
    #[cfg(feature = "tls")]
    pub(crate) fn unencrypt(&mut self) {
        self.options = self.options.replace("ssl=on", "ssl=off");
        self.kill();
        self.run_again();
    }

    fn run(&self, program: &str, words: impl IntoIterator<Item = OsString>) {
        let output = self.command(program, words).output().unwrap();
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        let log = std::fs::read_to_string(self.own().join("log")).unwrap_or_default();
        assert!(output.status.success(), "{program}: {err}\n{log}");
    }

    fn command(&self, program: &str, words: impl IntoIterator<Item = OsString>) -> Command {
        let mut command = Command::new(self.programs.join(program));
        command
            .args(words)
            .current_dir(self.folder.path())
            .stdin(Stdio::null());
        if is_root() {
            command.uid(NOBODY).gid(NOBODY);
        }
        command
    }

    /// URL of a database; `postgres` is there from the start.
    pub(crate) fn url(&self, database: &str) -> String {
        self.url_of("skinrig", database)
    }

    fn url_of(&self, user: &str, database: &str) -> String {
        format!(
            "postgres://{user}@localhost:{}/{database}?host={}",
            self.port,
            self.own().display()
        )
    }

    /// Opens the catalogue of the first database as another user.
    pub(crate) fn open_as(&self, user: &str, access: Access) -> Result<Catalogue, CatalogueError> {
        let address = Address::parse(self.url_of(user, "postgres").as_ref());
        Catalogue::open(address, access, WAIT)
    }

    pub(crate) fn address(&self) -> Address {
        Address::parse(self.url("postgres").as_ref())
    }

    /// Creates another database.
    pub(crate) fn create(&self, database: &str) {
        let words = ["-h", &text(&self.own()), "-U", "skinrig", database].map(OsString::from);
        self.run("createdb", words);
    }

    /// Executes statements as the owner.
    pub(crate) fn execute(&self, statements: &[&'static str]) {
        for statement in statements {
            self.rows("postgres", statement);
        }
    }

    /// Every row of every table of a database but the migrations, as text, sorted.
    pub(crate) fn dump(&self, database: &str) -> String {
        let mut dump = String::new();
        for table in TABLES {
            let mut rows = self.rows(database, table);
            rows.sort();
            rows.iter()
                .for_each(|row| dump += &format!("{table} {row}\n"));
        }
        dump
    }

    /// Rows of a query, each as text.
    pub(crate) fn rows(&self, database: &str, sql: &'static str) -> Vec<String> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .unwrap();
        let found = runtime.block_on(async {
            let options: PgConnectOptions = self.url(database).parse().unwrap();
            let mut conn = options.connect().await.unwrap();
            sqlx::query(sql).fetch_all(&mut conn).await.unwrap()
        });
        let cell = |row: &PgRow, at: usize| -> String {
            let value = row.try_get::<Option<String>, _>(at);
            value.map(|v| format!("{v:?}")).unwrap_or_else(|_| {
                let value = row.try_get::<Option<i64>, _>(at).map(|v| format!("{v:?}"));
                value.unwrap_or_else(|_| format!("{:?}", row.get::<Option<f64>, _>(at)))
            })
        };
        let text = |row: &PgRow| {
            let cells: Vec<String> = (0..row.len()).map(|at| cell(row, at)).collect();
            cells.join("|")
        };
        found.iter().map(text).collect()
    }

    pub(crate) fn open(&self) -> Result<Catalogue, CatalogueError> {
        Catalogue::open(self.address(), Access::Write, WAIT)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let words = ["-D".into(), self.own().join("data").into_os_string()];
        let tail = ["-m", "immediate", "stop"].map(OsString::from);
        // It may have been killed.
        let _ = self
            .command("pg_ctl", words.into_iter().chain(tail))
            .output();
    }
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

fn is_root() -> bool {
    std::fs::metadata("/proc/self").is_ok_and(|m| m.uid() == 0)
}

/// Folder of the server's programs: Debian keeps them out of `PATH`.
fn programs() -> Option<PathBuf> {
    let versions = std::fs::read_dir("/usr/lib/postgresql")
        .into_iter()
        .flatten();
    let debian = versions.flatten().map(|entry| entry.path().join("bin"));
    let path = std::env::var_os("PATH").unwrap_or_default();
    let all: Vec<PathBuf> = debian.chain(std::env::split_paths(&path)).collect();
    let has = |folder: &PathBuf| {
        let has = |program: &str| Path::new(folder).join(program).is_file();
        has("initdb") && has("pg_ctl") && has("postgres")
    };
    all.into_iter().find(has)
}
