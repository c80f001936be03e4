//! Rules for our source files, tests included: length, first line, unsafe code, and words that only some files may use.

use std::collections::BTreeSet;
use std::path::Path;

/// Maximum number of lines in a file.
const MAX_LINES: usize = 600;

/// Deviations of a file from the rules of length and first line.
fn form_faults(name: &str, source: &str) -> Vec<String> {
    let lines = source.lines().count();
    let mut faults = Vec::new();
    if lines > MAX_LINES {
        faults.push(format!(
            "{name}: {lines} lines, expected at most {MAX_LINES}"
        ));
    }
    if !source.starts_with("//! ") {
        faults.push(format!(
            "{name}: the first line must state what the file owns"
        ));
    }
    faults
}

#[test]
fn files_are_short_and_begin_with_their_purpose() {
    let files = all_rust_files();
    let faults: Vec<String> = files
        .iter()
        .flat_map(|(name, source)| form_faults(name, source))
        .collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let longest = "//! Owns.\n".repeat(MAX_LINES);
    assert!(form_faults("a.rs", &longest).is_empty());
    assert_eq!(form_faults("a.rs", &format!("{longest}\n")).len(), 1);
    assert_eq!(form_faults("a.rs", "fn f() {}\n").len(), 1);
}

/// Files that may contain `unsafe` code, all at the boundary to foreign functions, shared memory or the allocator.
const UNSAFE_HOMES: &[&str] = &[
    // The vendor's robot library: function types, loading, calling.
    "crates/drivers/drd_abi/src/functions.rs",
    "crates/drivers/drd_abi/src/version.rs",
    "crates/drivers/drd_abi/tests/table.rs",
    "crates/drivers/omega3/src/library.rs",
    "crates/drivers/omega3/src/load.rs",
    // SQLite's interface to file systems.
    "crates/objects/src/vfs.rs",
    // libusb's asynchronous transfers.
    "crates/drivers/evk1/src/usb/transfers.rs",
    // The emulated robot library: its exports, and the page that it shares with its firmware.
    "hil/emulated/libdrd/src/entry.rs",
    "hil/emulated/libdrd/src/exports/device.rs",
    "hil/emulated/libdrd/src/exports/library.rs",
    "hil/emulated/libdrd/src/exports/outcome.rs",
    "hil/emulated/libdrd/src/exports/reading.rs",
    "hil/emulated/libdrd/src/exports/regulation.rs",
    "hil/emulated/libdrd/src/exports/settings.rs",
    "hil/emulated/libdrd/src/host.rs",
    "hil/emulated/libdrd/src/journal.rs",
    "hil/emulated/libdrd/src/page.rs",
    "hil/emulated/libdrd/src/time.rs",
    "hil/emulated/libdrd/tests/arm/faults.rs",
    "hil/emulated/libdrd/tests/arm/host_death.rs",
    "hil/emulated/libdrd/tests/arm/motion.rs",
    "hil/emulated/libdrd/tests/arm/procedure.rs",
    "hil/emulated/libdrd/tests/arm/processes.rs",
    "hil/emulated/libdrd/tests/arm/strictness.rs",
    "hil/emulated/libdrd/tests/arm/support.rs",
    // The emulated USB bus: interposed C library functions.
    "hil/emulated/usbshim/src/interpose.rs",
    "hil/emulated/usbshim/src/wire.rs",
    // Counts the memory held by untrusted input: the allocator trait is unsafe.
    "tests/fuzz/tests/hostile/allocator.rs",
];

/// A line without comments and string contents.
fn code(line: &str) -> String {
    let line = line.split("//").next().unwrap_or_default();
    line.split('"').step_by(2).collect()
}

/// Lines of `source` whose `unsafe` block or implementation lacks a SAFETY comment.
fn without_reason(source: &str) -> Vec<usize> {
    let lines: Vec<&str> = source.lines().collect();
    let needs_reason = |line: &str| {
        let words = code(line);
        words.contains("unsafe {") || words.contains("unsafe impl ")
    };
    let reason_above = |at: usize| {
        // A statement may begin some lines above its block.
        let above = lines[at.saturating_sub(12)..at].iter().rev();
        let mut near = above.take_while(|l| !l.trim().is_empty() && !l.contains("unsafe {"));
        lines[at].contains("SAFETY:") || near.any(|l| l.trim().starts_with("// SAFETY:"))
    };
    (0..lines.len())
        .filter(|&at| needs_reason(lines[at]) && !reason_above(at))
        .map(|at| at + 1)
        .collect()
}

/// Rust files under `folder`, with paths relative to the workspace root.
pub(crate) fn rust_files(folder: &Path, root: &Path, to: &mut Vec<(String, String)>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("target") {
            rust_files(&path, root, to);
        } else if path.extension().is_some_and(|e| e == "rs") {
            let name = path.strip_prefix(root).unwrap().display().to_string();
            to.push((name, std::fs::read_to_string(&path).unwrap()));
        }
    }
}

#[test]
fn unsafe_code_lives_at_named_borders_and_gives_its_reason() {
    let files = all_rust_files();
    let mut faults = Vec::new();
    for (name, source) in &files {
        let home = UNSAFE_HOMES.contains(&name.as_str());
        let unsafe_word = |line: &str| {
            let code = code(line);
            let mut words = code.split(|c: char| !c.is_alphanumeric() && c != '_');
            words.any(|w| w == "unsafe")
        };
        let uses = source.lines().any(unsafe_word);
        match (home, uses) {
            (false, true) => faults.push(format!("{name}: unsafe code, and no home of it")),
            (true, false) => faults.push(format!("{name}: a home of unsafe code without any")),
            _ => {}
        }
        for line in without_reason(source) {
            faults.push(format!("{name}:{line}: unsafe without a SAFETY comment"));
        }
    }
    for home in UNSAFE_HOMES {
        if !files.iter().any(|(name, _)| name == home) {
            faults.push(format!("{home}: is not there"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    let block = ["fn f() {", "    unsafe", " { g() }", "}"];
    let bare = format!("{}\n{}{}\n{}", block[0], block[1], block[2], block[3]);
    assert_eq!(without_reason(&bare), [2]);
    let with = bare.replacen("    ", "    // SAFETY: g asks for nothing.\n    ", 1);
    assert!(without_reason(&with).is_empty());
}

/// Files that may name a boxed robot: its trait, the rig that owns it, the guard, and those who pass it to the guard.
const ROBOT_HOMES: [&str; 6] = [
    "crates/cli/src/jog/mod.rs",
    "crates/cli/src/rig/bench.rs",
    "crates/controller/src/guard.rs",
    "crates/controller/src/jog.rs",
    "crates/device/src/contract/indenter.rs",
    "crates/device/src/rig.rs",
];

#[test]
fn the_guard_alone_holds_the_robot() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let mut files = Vec::new();
    rust_files(&root.join("crates"), root, &mut files);
    let named: Vec<&str> = files
        .iter()
        .filter(|(name, source)| {
            name.contains("/src/") && source.lines().any(|l| code(l).contains("dyn Indenter"))
        })
        .map(|(name, _)| name.as_str())
        .collect();
    let named: BTreeSet<&str> = named.into_iter().collect();
    assert_eq!(
        named,
        BTreeSet::from(ROBOT_HOMES),
        "whoever moves the robot goes through `GuardedIndenter`"
    );
}

/// Our Rust files, including tests.
fn all_rust_files() -> Vec<(String, String)> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let mut files = Vec::new();
    for folder in ["crates", "hil", "tests", "benches"] {
        rust_files(&root.join(folder), root, &mut files);
    }
    files
}

/// Lines of `files` whose code, without comments and strings, contains one of `words`.
fn with_words(files: &[(String, String)], words: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    for (name, source) in files {
        for (line, text) in (1..).zip(source.lines()) {
            let code = code(text);
            if let Some(word) = words.iter().find(|w| code.contains(**w)) {
                found.push(format!("{name}:{line}: {word}"));
            }
        }
    }
    found
}

#[test]
fn no_sql_is_built_from_text() {
    // sqlx accepts static statements, or dynamic ones explicitly marked as safe; we mark none.
    let found = with_words(
        &all_rust_files(),
        &["AssertSqlSafe", "raw_sql", "QueryBuilder", "SqlStr::from"],
    );
    assert!(found.is_empty(), "{}", found.join("\n"));
    let vouched = (
        "x.rs".to_owned(),
        "query(Assert".to_owned() + "SqlSafe(sql))",
    );
    assert_eq!(with_words(&[vouched], &["AssertSqlSafe"]).len(), 1);
}

/// Code that opens or describes a network port. File system sockets (`UnixListener`, `UnixStream`) are allowed.
const NETWORK: [&str; 10] = [
    "TcpListener",
    "TcpStream",
    "TcpSocket",
    "UdpSocket",
    "SocketAddrV",
    "Ipv4Addr",
    "Ipv6Addr",
    "ToSocketAddrs",
    "AF_INET",
    "AddressFamily::INET",
];

#[test]
fn only_view_opens_a_network_port() {
    let mut files = all_rust_files();
    // The servers of the tests of messages, and of encrypted catalogues; a test that asks the page of a damaged session.
    const TESTS: [&str; 3] = [
        "crates/cli/tests/commands/damage.rs",
        "crates/notify/tests/it/servers.rs",
        "crates/catalogue/tests/register/server.rs",
    ];
    files.retain(|(name, _)| !name.starts_with("crates/view/") && !TESTS.contains(&name.as_str()));
    let found = with_words(&files, &NETWORK);
    assert!(found.is_empty(), "{}", found.join("\n"));
    let open = (
        "x.rs".to_owned(),
        "std::net::Tcp".to_owned() + "Listener::bind(a)",
    );
    assert_eq!(with_words(&[open], &NETWORK).len(), 1);
}
