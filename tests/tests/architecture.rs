//! Holds the house in order: which crate may use which, and under which licences we stand.
#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot read the workspace must fail"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use serde_json::Value;

/// Who may use whom among our own crates, besides tests. Twin of the table in `ARCHITECTURE.md`.
const ALLOWED: &[(&str, &[&str])] = &[
    ("skinrig-model", &[]),
    ("skinrig-formats", &["skinrig-model"]),
    ("skinrig-protocol", &["skinrig-model"]),
    ("skinrig-device", &["skinrig-model"]),
    ("skinrig-drd-abi", &[]),
    (
        "skinrig-omega3",
        &["skinrig-device", "skinrig-model", "skinrig-drd-abi"],
    ),
    (
        "skinrig-evk1",
        &["skinrig-device", "skinrig-model", "skinrig-formats"],
    ),
    (
        "skinrig-evk4",
        &["skinrig-device", "skinrig-model", "skinrig-formats"],
    ),
    ("skinrig-trigger-box", &["skinrig-device", "skinrig-model"]),
    (
        "skinrig-sim",
        &["skinrig-device", "skinrig-model", "skinrig-formats"],
    ),
    (
        "skinrig-controller",
        &["skinrig-protocol", "skinrig-device", "skinrig-model"],
    ),
    ("skinrig-recorder", &["skinrig-model"]),
    ("skinrig-analysis", &["skinrig-model"]),
    ("skinrig-report", &["skinrig-analysis", "skinrig-model"]),
    (
        "skinrig",
        &[
            "skinrig-model",
            "skinrig-formats",
            "skinrig-protocol",
            "skinrig-device",
            "skinrig-omega3",
            "skinrig-evk1",
            "skinrig-evk4",
            "skinrig-trigger-box",
            "skinrig-sim",
            "skinrig-controller",
            "skinrig-recorder",
            "skinrig-analysis",
            "skinrig-report",
        ],
    ),
];

/// Crates of other people that only some of our crates may know.
const RESTRICTED: &[(&str, &[&str])] = &[
    ("sqlx", &["skinrig-recorder"]),
    ("tokio", &["skinrig-recorder", "skinrig"]),
    ("serde_yaml", &["skinrig-protocol"]),
    ("serde-saphyr", &["skinrig-protocol"]),
    ("rust-hdf5", &["skinrig-formats"]),
    ("clap", &["skinrig"]),
    ("indicatif", &["skinrig"]),
    ("chrono", &["skinrig", "skinrig-recorder"]),
    ("rusb", &["skinrig-evk1"]),
    ("neuromorphic-drivers", &["skinrig-evk4"]),
    ("libloading", &["skinrig-omega3"]),
    ("serialport", &["skinrig-trigger-box"]),
];

/// Members that only test, measure or stand in for hardware.
const HARNESSES: &[&str] = &[
    "skinrig-tests",
    "skinrig-bench",
    "skinrig-emulated-libdrd",
    "skinrig-emulated-bench",
    "skinrig-emulated-camera",
    "skinrig-emulated-trigger-box",
    "skinrig-usbshim",
];

/// Licences that go with MIT OR Apache-2.0 for a program that people download.
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

/// Crates that ship the text of their licence and name none: what the text is.
const LICENCE_BY_TEXT: &[(&str, &str)] = &[
    ("neuromorphic-drivers", "MIT"),
    ("neuromorphic-types", "MIT"),
];

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
    let allowed: BTreeMap<_, _> = ALLOWED.iter().copied().collect();
    let mut faults = Vec::new();
    for package in members(&metadata) {
        let name = package["name"].as_str().unwrap();
        if HARNESSES.contains(&name) {
            continue;
        }
        let Some(may_use) = allowed.get(name) else {
            faults.push(format!("{name}: not in the table of who may use whom"));
            continue;
        };
        for dependency in package["dependencies"].as_array().unwrap() {
            let on = dependency["name"].as_str().unwrap();
            if dependency["kind"] == "dev" {
                continue;
            }
            if on.starts_with("skinrig") && !may_use.contains(&on) {
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
        // `A OR B AND C`, old style `A/B`: one of the alternatives must be all acceptable.
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
