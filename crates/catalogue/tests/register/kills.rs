//! Eight programs register the same sessions while they are killed: no session is lost, none is doubled.

use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Mutex;

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use skinrig_catalogue::{Access, Address, Catalogue, CatalogueError};

use crate::support::{Lab, WAIT, column, dump};

const PROGRAMS: u64 = 8;
const SESSIONS: u32 = 24;
/// Names the folder for [`a_program`], the seed of its order, and the catalogue on a server.
const FOLDER: &str = "SKINRIG_TEST_FOLDER";
const SEED: &str = "SKINRIG_TEST_SEED";
const URL: &str = "SKINRIG_TEST_URL";

/// Registers sessions in a random order until it is killed; prints each one that is registered.
#[test]
#[ignore = "run as a process by the tests below, by name"]
fn a_program() {
    let Ok(folder) = std::env::var(FOLDER) else {
        return;
    };
    let seed = std::env::var(SEED).unwrap().parse().unwrap();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let folder = Path::new(&folder);
    let url = std::env::var_os(URL);
    let address = url.as_deref().map(Address::parse);
    let address = address.unwrap_or_else(|| Address::of_folder(folder));
    loop {
        let done = register_some(&address, folder, &mut random);
        // Only a server may fail, because it is killed.
        assert!(done.is_ok() || url.is_some(), "{done:?}");
    }
}

#[expect(clippy::print_stdout, reason = "tells the test what is registered")]
fn register_some(
    address: &Address,
    folder: &Path,
    random: &mut Xoshiro256PlusPlus,
) -> Result<(), CatalogueError> {
    let mut catalogue = Catalogue::open(address.clone(), Access::Write, WAIT)?;
    for _ in 0..4 {
        let n = random.next_u64() % u64::from(SESSIONS);
        let session = folder.join(format!("{n}.session.sqlite"));
        // Even if it is known: its rows are written anew.
        if random.next_u64().is_multiple_of(2) {
            catalogue.register(&[session])?;
        } else {
            catalogue.refresh(folder, true)?;
        }
        println!("registered {n}");
        std::io::stdout().flush().unwrap();
    }
    Ok(())
}

/// Starts the program, kills it after some lines, and returns the sessions that it registered.
fn run_and_kill(folder: &Path, url: Option<&str>, seed: u64, lines: usize) -> BTreeSet<u32> {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["kills::a_program", "--exact", "--ignored", "--nocapture"])
        .env(FOLDER, folder)
        .env(SEED, seed.to_string())
        .stdout(Stdio::piped());
    if let Some(url) = url {
        command.env(URL, url);
    }
    let mut child = command.spawn().unwrap();
    let output = BufReader::new(child.stdout.take().unwrap());
    let mut registered = BTreeSet::new();
    // Without a line: killed while it opens or creates the catalogue.
    let found = output.lines().map(Result::unwrap);
    let found = found.filter_map(|l| l.strip_prefix("registered ").map(|n| n.parse().unwrap()));
    for n in found.take(lines) {
        registered.insert(n);
    }
    child.kill().unwrap();
    let status = child.wait().unwrap();
    assert_eq!(status.code(), None, "killed, not ended by itself");
    registered
}

/// Kills programs `count` times, `between` after each kill of the first of them; returns the registered sessions.
fn kill_all(
    lab: &Lab,
    url: Option<&str>,
    (count, seed): (u64, u64),
    between: impl Fn() + Sync,
) -> BTreeSet<u32> {
    let acknowledged = Mutex::new(BTreeSet::new());
    std::thread::scope(|scope| {
        for program in 0..PROGRAMS {
            let (acknowledged, between) = (&acknowledged, &between);
            scope.spawn(move || {
                let mut random = Xoshiro256PlusPlus::seed_from_u64(seed + program);
                for _ in 0..count / PROGRAMS {
                    let lines = (random.next_u64() % 4) as usize;
                    let own = run_and_kill(lab.path(), url, random.next_u64(), lines);
                    acknowledged.lock().unwrap().extend(own);
                    if program == 0 {
                        between();
                    }
                }
            });
        }
    });
    acknowledged.into_inner().unwrap()
}

fn numbers<'a>(files: impl IntoIterator<Item = &'a String>) -> BTreeSet<u32> {
    let number = |name: &String| name.split('.').next().unwrap().parse().unwrap();
    files.into_iter().map(number).collect()
}

fn kills(count: u64, seed: u64) {
    let lab = Lab::with_sessions(SESSIONS);
    let acknowledged = kill_all(&lab, None, (count, seed), || ());
    // What was acknowledged is there, before anything else is registered.
    let there = numbers(&column(&lab.file(), "SELECT name FROM session_file"));
    assert!(acknowledged.is_subset(&there), "{acknowledged:?} {there:?}");
    assert_eq!(column(&lab.file(), "PRAGMA integrity_check"), ["ok"]);
    let broken = "SELECT count(*) FROM pragma_foreign_key_check";
    assert_eq!(column(&lab.file(), broken), ["0"]);
    // Afterwards it equals the catalogue of one program that nobody kills.
    lab.open().refresh(lab.path(), false).unwrap();
    let alone = lab.path().join("alone.sqlite");
    let mut other = Catalogue::open(Address::File(alone.clone()), Access::Write, WAIT).unwrap();
    other.refresh(lab.path(), false).unwrap();
    drop(other);
    assert_eq!(lab.dump(), dump(&alone));
    assert_eq!(
        column(&alone, "SELECT count(*) FROM session"),
        [SESSIONS.to_string()]
    );
}

/// As [`kills`], on a server that is killed, too.
#[cfg(unix)]
fn kills_with_a_server(count: u64, seed: u64) -> bool {
    let Some(server) = crate::server::Server::start() else {
        return false;
    };
    let lab = Lab::with_sessions(SESSIONS);
    let url = server.url("postgres");
    let acknowledged = kill_all(&lab, Some(&url), (count, seed), || {
        server.kill();
        server.run_again();
    });
    let files = server.rows("postgres", "SELECT name FROM session_file");
    let files: Vec<String> = files
        .iter()
        .map(|f| f.replace(['"', '('], "").replace("Some", ""))
        .collect();
    let there = numbers(&files);
    assert!(acknowledged.is_subset(&there), "{acknowledged:?} {there:?}");
    server.open().unwrap().refresh(lab.path(), false).unwrap();
    server.create("alone");
    let alone = Address::parse(server.url("alone").as_ref());
    let mut other = Catalogue::open(alone, Access::Write, WAIT).unwrap();
    assert_eq!(
        other.refresh(lab.path(), false).unwrap().registered.len(),
        SESSIONS as usize
    );
    assert_eq!(server.dump("postgres"), server.dump("alone"));
    true
}

#[test]
fn killed_programs_lose_and_double_nothing() {
    kills(16, 1);
}

#[cfg(unix)]
#[test]
fn a_killed_server_loses_and_doubles_nothing() {
    kills_with_a_server(16, 1);
}

#[test]
#[ignore = "ten seconds: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig-catalogue -- --ignored --nocapture"]
fn two_hundred_kills() {
    kills(200, 2);
    println!("200 kills of {PROGRAMS} programs: {SESSIONS} sessions, 0 lost, 0 doubled");
}

#[cfg(unix)]
#[test]
#[ignore = "a minute: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig-catalogue -- --ignored --nocapture"]
fn two_hundred_kills_with_a_server() {
    if kills_with_a_server(200, 2) {
        println!(
            "200 kills of {PROGRAMS} programs, 25 of the server: {SESSIONS} sessions, 0 lost, 0 doubled"
        );
    }
}
