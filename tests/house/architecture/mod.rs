//! Checks the architecture: dependencies between crates, and licences of dependencies. No manifest skips tests that exist.
#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot read the workspace must fail"
)]

mod source;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use source::rust_files;

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
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
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
    (
        "sqlx",
        &["skinrig-recorder", "skinrig-hil", "skinrig-catalogue"],
    ),
    (
        "tokio",
        &[
            "skinrig-recorder",
            "skinrig-hil",
            "skinrig-catalogue",
            "skinrig-view",
            "skinrig-objects",
            "skinrig",
        ],
    ),
    ("object_store", &["skinrig-objects"]),
    ("libsqlite3-sys", &["skinrig-objects"]),
    ("axum", &["skinrig-view"]),
    ("fearless_simd", &["skinrig-simd"]),
    ("lettre", &["skinrig-notify"]),
    ("ureq", &["skinrig-notify"]),
    ("rustls", &["skinrig-notify", "skinrig-objects"]),
    ("serde_yaml", &["skinrig-settings"]),
    ("serde-saphyr", &["skinrig-settings"]),
    ("rust-hdf5", &["skinrig-formats"]),
    ("parquet", &["skinrig-export"]),
    ("zip", &["skinrig-export"]),
    ("pyo3", &["skinrig-python"]),
    ("clap", &["skinrig"]),
    ("indicatif", &["skinrig"]),
    (
        "chrono",
        &[
            "skinrig",
            "skinrig-recorder",
            "skinrig-hil",
            "skinrig-catalogue",
        ],
    ),
    ("rusb", &["skinrig-evk1"]),
    ("neuromorphic-drivers", &["skinrig-evk4"]),
    ("libloading", &["skinrig-omega3"]),
    ("serialport", &["skinrig-trigger-box"]),
];

/// Members that only test, measure or emulate hardware.
const HARNESSES: &[&str] = &[
    "skinrig-tests",
    "skinrig-analysis-tests",
    "skinrig-house",
    "skinrig-bench",
    "skinrig-browser",
    "skinrig-certified",
    "skinrig-machines",
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
    // Root certificates, which are data.
    "CDLA-Permissive-2.0",
];

/// Crates that ship a licence text without naming it, and the licence of that text.
const LICENCE_BY_TEXT: &[(&str, &str)] = &[
    ("neuromorphic-drivers", "MIT"),
    ("neuromorphic-types", "MIT"),
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

/// The program runs on any x86-64; crate `simd` uses what the processor has.
#[test]
fn no_build_flag_asks_for_a_processor() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let config = std::fs::read_to_string(root.join(".cargo/config.toml")).unwrap();
    for flag in ["rustflags", "target-cpu", "target-feature"] {
        assert!(!config.contains(flag), "{flag}");
    }
}

#[test]
fn no_networking_library_is_linked() {
    // The program without optional features, and without those that only tests use.
    let output = Command::new(env!("CARGO"))
        .args([
            "tree",
            "--locked",
            "--package",
            "skinrig",
            "--edges",
            "normal",
        ])
        .args(["--prefix", "none", "--format", "{p}"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let tree = String::from_utf8(output.stdout).unwrap();
    let names: BTreeSet<&str> = tree.lines().filter_map(|l| l.split(' ').next()).collect();
    assert!(names.len() > 100 && names.contains("sqlx"), "{names:?}");
    let linked: Vec<&&str> = names
        .iter()
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
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.lock")).unwrap();
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
