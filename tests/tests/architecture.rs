//! Checks the architecture: dependencies between crates, and licences of dependencies. No manifest skips tests that exist.
#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot read the workspace must fail"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// Packages of the row `drivers`, which may all use the last one.
const DRIVERS: [&str; 5] = [
    "skinrig-omega3",
    "skinrig-evk1",
    "skinrig-evk4",
    "skinrig-trigger-box",
    "skinrig-drd-abi",
];

/// Dependencies between our crates, except in tests, as allowed by the table of `ARCHITECTURE.md`.
fn allowed_dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let text = std::fs::read_to_string(root.join("ARCHITECTURE.md")).unwrap();
    let table = text.lines().filter(|line| line.starts_with("| "));
    let rows: Vec<(&str, &str)> = table
        .filter_map(|line| {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            let [owner, _, uses] = cells[..] else {
                panic!("expected three columns: {line}");
            };
            Some((owner.split(' ').next()?, uses))
        })
        .filter(|(owner, _)| *owner != "crate")
        .collect();
    let packages = |name: &str| -> Vec<String> {
        match name {
            "-" => Vec::new(),
            "drivers" => DRIVERS.map(str::to_owned).to_vec(),
            "settings" => ["skinrig-settings", "skinrig-settings-derive"]
                .map(str::to_owned)
                .to_vec(),
            "cli" => vec!["skinrig".to_owned()],
            _ => vec![format!("skinrig-{name}")],
        }
    };
    let mut allowed = BTreeMap::new();
    for (row, (owner, uses)) in rows.iter().enumerate() {
        let above: Vec<&str> = rows[..row].iter().map(|(name, _)| *name).collect();
        let named: BTreeSet<String> = match uses.strip_prefix("all but ") {
            Some(left_out) => {
                let others = rows.iter().map(|(name, _)| *name);
                let used = others.filter(|name| *name != left_out && name != owner);
                used.flat_map(packages).collect()
            }
            None => {
                let used: Vec<&str> = uses.split(", ").collect();
                for name in &used {
                    assert!(
                        *name == "-" || above.contains(name),
                        "{owner}: {name} is no row above"
                    );
                }
                used.into_iter().flat_map(packages).collect()
            }
        };
        for package in packages(owner) {
            let mut own = named.clone();
            own.extend(packages(owner).pop());
            own.remove(&package);
            allowed.insert(package, own);
        }
    }
    allowed
}

/// External crates that only some of our crates may use.
const RESTRICTED: &[(&str, &[&str])] = &[
    ("sqlx", &["skinrig-recorder", "skinrig-hil"]),
    (
        "tokio",
        &["skinrig-recorder", "skinrig-hil", "skinrig-view", "skinrig"],
    ),
    ("axum", &["skinrig-view"]),
    ("lettre", &["skinrig-notify"]),
    ("ureq", &["skinrig-notify"]),
    ("rustls", &["skinrig-notify"]),
    ("serde_yaml", &["skinrig-settings"]),
    ("serde-saphyr", &["skinrig-settings"]),
    ("rust-hdf5", &["skinrig-formats"]),
    ("parquet", &["skinrig-export"]),
    ("zip", &["skinrig-export"]),
    ("pyo3", &["skinrig-python"]),
    ("clap", &["skinrig"]),
    ("indicatif", &["skinrig"]),
    ("chrono", &["skinrig", "skinrig-recorder", "skinrig-hil"]),
    ("rusb", &["skinrig-evk1"]),
    ("neuromorphic-drivers", &["skinrig-evk4"]),
    ("libloading", &["skinrig-omega3"]),
    ("serialport", &["skinrig-trigger-box"]),
];

/// Members that only test, measure or emulate hardware.
const HARNESSES: &[&str] = &[
    "skinrig-tests",
    "skinrig-bench",
    "skinrig-browser",
    "skinrig-fuzz",
    "skinrig-planted",
    "skinrig-wrong-inputs",
    "skinrig-emulated-libdrd",
    "skinrig-emulated-bench",
    "skinrig-emulated-camera",
    "skinrig-emulated-trigger-box",
    "skinrig-usbshim",
];

/// Licences compatible with MIT OR Apache-2.0 for a downloadable program.
const LICENCES: &[&str] = &[
    "MIT",
    "MIT-0",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-1-Clause",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "ISC",
    "Zlib",
    "0BSD",
    "CC0-1.0",
    "Unlicense",
    "Unicode-3.0",
    "MPL-2.0",
    "bzip2-1.0.6",
];

/// Crates that ship a licence text without naming it, and the licence of that text.
const LICENCE_BY_TEXT: &[(&str, &str)] = &[
    ("neuromorphic-drivers", "MIT"),
    ("neuromorphic-types", "MIT"),
];

/// Files that may contain `unsafe` code, all at the boundary to foreign functions, shared memory or the allocator.
const UNSAFE_HOMES: &[&str] = &[
    // The vendor's robot library: function types, loading, calling.
    "crates/drivers/drd_abi/src/functions.rs",
    "crates/drivers/drd_abi/src/version.rs",
    "crates/drivers/drd_abi/tests/table.rs",
    "crates/drivers/omega3/src/library.rs",
    "crates/drivers/omega3/src/load.rs",
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
fn rust_files(folder: &Path, root: &Path, to: &mut Vec<(String, String)>) {
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
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
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
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
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

/// Libraries for networking, except those of `skinrig view` (axum and hyper, HTTP/1.1 alone) and of messages (lettre and ureq, clients
/// alone).
const NETWORK_LIBRARIES: [&str; 11] = [
    "actix-web",
    "curl",
    "h2",
    "native-tls",
    "openssl",
    "quinn",
    "reqwest",
    "rustls",
    "tonic",
    "tungstenite",
    "zmq",
];

#[test]
fn only_view_opens_a_network_port() {
    let mut files = all_rust_files();
    // The servers of the tests of messages.
    const TEST_SERVERS: &str = "crates/notify/tests/it/servers.rs";
    files.retain(|(name, _)| !name.starts_with("crates/view/") && name != TEST_SERVERS);
    let found = with_words(&files, &NETWORK);
    assert!(found.is_empty(), "{}", found.join("\n"));
    let open = (
        "x.rs".to_owned(),
        "std::net::Tcp".to_owned() + "Listener::bind(a)",
    );
    assert_eq!(with_words(&[open], &NETWORK).len(), 1);
    let metadata = metadata();
    let linked: Vec<&str> = metadata["packages"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|p| p["name"].as_str())
        .filter(|name| NETWORK_LIBRARIES.contains(name))
        .collect();
    assert!(linked.is_empty(), "{linked:?}");
}

fn metadata() -> Value {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).unwrap()
}

fn members(metadata: &Value) -> Vec<&Value> {
    let ids: BTreeSet<&str> = metadata["workspace_members"]
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_str().unwrap())
        .collect();
    let packages = metadata["packages"].as_array().unwrap();
    packages
        .iter()
        .filter(|p| ids.contains(p["id"].as_str().unwrap()))
        .collect()
}

#[test]
fn crates_depend_in_one_direction() {
    let metadata = metadata();
    let allowed = allowed_dependencies();
    let mut faults = Vec::new();
    for package in members(&metadata) {
        let name = package["name"].as_str().unwrap();
        if HARNESSES.contains(&name) {
            continue;
        }
        let Some(may_use) = allowed.get(name) else {
            faults.push(format!("{name}: missing in the table of ARCHITECTURE.md"));
            continue;
        };
        for dependency in package["dependencies"].as_array().unwrap() {
            let on = dependency["name"].as_str().unwrap();
            if dependency["kind"] == "dev" {
                continue;
            }
            if on.starts_with("skinrig") && !may_use.contains(on) {
                faults.push(format!("{name} must not use {on}"));
            }
            for (library, users) in RESTRICTED {
                if on == *library && !users.contains(&name) {
                    faults.push(format!("{name} must not use {library}"));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Packages that ship: the program and the Python wheel.
const SHIPPED: [&str; 2] = ["skinrig", "skinrig-python"];

/// All packages that `roots` link or build with, without their test dependencies.
fn linked_packages<'a>(metadata: &'a Value, roots: &[&str]) -> Vec<&'a Value> {
    let by_id: BTreeMap<&str, &Value> = metadata["packages"]
        .as_array()
        .unwrap()
        .iter()
        .map(|package| (package["id"].as_str().unwrap(), package))
        .collect();
    let nodes: BTreeMap<&str, &Value> = metadata["resolve"]["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|node| (node["id"].as_str().unwrap(), node))
        .collect();
    let is_root = |package: &Value| roots.contains(&package["name"].as_str().unwrap());
    let mut pending: Vec<&str> = by_id
        .iter()
        .filter_map(|(id, package)| is_root(package).then_some(*id))
        .collect();
    let mut linked = BTreeSet::new();
    while let Some(id) = pending.pop() {
        if !linked.insert(id) {
            continue;
        }
        for dependency in nodes[id]["deps"].as_array().unwrap() {
            let kinds = dependency["dep_kinds"].as_array().unwrap();
            if kinds.iter().any(|k| k["kind"] != "dev") {
                pending.push(dependency["pkg"].as_str().unwrap());
            }
        }
    }
    linked.into_iter().map(|id| by_id[id]).collect()
}

#[test]
fn no_shipped_package_links_a_stand_in() {
    let metadata = metadata();
    let is_stand_in = |package: &&Value| {
        let manifest = package["manifest_path"].as_str().unwrap();
        manifest.contains("/hil/emulated/")
    };
    let all = metadata["packages"].as_array().unwrap();
    assert_eq!(all.iter().filter(is_stand_in).count(), 5);
    let linked = linked_packages(&metadata, &SHIPPED);
    assert!(linked.len() > 100, "{}", linked.len());
    let stand_ins: Vec<&Value> = linked.into_iter().filter(is_stand_in).collect();
    assert!(stand_ins.is_empty(), "{stand_ins:#?}");
}

#[test]
fn every_dependency_has_a_licence_we_accept() {
    let metadata = metadata();
    let mut faults = Vec::new();
    for package in metadata["packages"].as_array().unwrap() {
        let name = package["name"].as_str().unwrap();
        let by_text = LICENCE_BY_TEXT.iter().find(|(of, _)| *of == name);
        let named = package["license"].as_str();
        let Some(expression) = named.or(by_text.map(|(_, is)| *is)) else {
            faults.push(format!("{name}: no licence expression"));
            continue;
        };
        // `A OR B AND C`, old style `A/B`: all licences of one alternative must be acceptable.
        let flat = expression.replace(['(', ')'], "").replace('/', " OR ");
        let acceptable = flat.split(" OR ").any(|alternative| {
            alternative
                .split(" AND ")
                .all(|l| LICENCES.contains(&l.trim()))
        });
        if !acceptable {
            faults.push(format!("{name}: {expression}"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn only_the_published_registry_is_used() {
    let lock =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.lock")).unwrap();
    let foreign: Vec<&str> = lock
        .lines()
        .filter(|l| l.starts_with("source = "))
        .filter(|l| *l != r#"source = "registry+https://github.com/rust-lang/crates.io-index""#)
        .collect();
    assert!(foreign.is_empty(), "{foreign:?}");
}

/// Source of a target: of a library its crate's whole `src`, of a program its own file.
fn source_of(target: &Value) -> String {
    let main = Path::new(target["src_path"].as_str().unwrap());
    if target["kind"][0] == "bin" {
        return std::fs::read_to_string(main).unwrap();
    }
    let mut files = Vec::new();
    let folder = main.parent().unwrap();
    rust_files(folder, folder, &mut files);
    files.into_iter().map(|(_, text)| text).collect()
}

/// True if the documentation holds an example that rustdoc would run.
fn has_example(source: &str) -> bool {
    let mut fences = source.lines().filter_map(|line| {
        let line = line.trim_start();
        let text = line.strip_prefix("///").or(line.strip_prefix("//!"))?;
        text.trim_start().strip_prefix("```")
    });
    // Fences come in pairs; the first of each names the language.
    std::iter::from_fn(|| {
        let language = fences.next()?;
        fences.next();
        Some(language)
    })
    .any(|language| {
        let first = language.split([',', ' ']).next().unwrap_or_default();
        ["", "rust", "no_run", "should_panic", "compile_fail"].contains(&first)
    })
}

#[test]
fn a_manifest_leaves_out_no_test_that_exists() {
    let metadata = metadata();
    let mut left_out = Vec::new();
    for package in members(&metadata) {
        for target in package["targets"].as_array().unwrap() {
            let kind = target["kind"][0].as_str().unwrap();
            if !["lib", "cdylib", "proc-macro", "bin"].contains(&kind) {
                continue;
            }
            let source = source_of(target);
            let name = &target["name"];
            if target["test"] == false && source.contains("#[test]") {
                left_out.push(format!("{name}: test = false, but there are unit tests"));
            }
            if kind != "bin" && target["doctest"] == false && has_example(&source) {
                left_out.push(format!("{name}: doctest = false, but there is an example"));
            }
        }
    }
    assert!(left_out.is_empty(), "{left_out:#?}");
}
