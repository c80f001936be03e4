//! The data lake: sessions are added once, in partitions that other programs read and skip.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::{Lab, SMALL, files, read_json, skinrig, text};

/// Sessions of two prototypes in one folder.
fn recorded(lab: &Lab) -> String {
    let folder = lab.text("s");
    for (prototype, seed) in [("mold 3/a", "5"), ("mold 3/a", "6"), ("mold 4", "7")] {
        let prototype = format!("prototype.id={prototype}");
        let run = [
            "run",
            SMALL,
            "--sessions",
            &folder,
            "--seed",
            seed,
            "--set",
            &prototype,
        ];
        skinrig(&[&run[..], &["--no-analysis"]].concat()).code(0);
    }
    folder
}

/// All files below a folder, with their content.
fn content(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for item in std::fs::read_dir(folder).unwrap() {
        let path = item.unwrap().path();
        if path.is_dir() {
            found.extend(content(&path));
        } else {
            let bytes = std::fs::read(&path).unwrap();
            found.push((path, bytes));
        }
    }
    found.sort();
    found
}

#[test]
fn a_session_is_added_once_and_other_programs_read_it() {
    let lab = Lab::new();
    let sessions = recorded(&lab);
    let lake = lab.text("lake");
    let add = || skinrig(&["lake", &sessions, "--to", &lake]);
    let first = add().code(0).out;
    assert!(
        first.contains("3 sessions added, 0 already there"),
        "{first}"
    );
    let before = content(&lab.path("lake"));
    // Five tables and a commit for each session.
    assert_eq!(before.len(), 3 * 6, "{before:?}");
    let second = add().code(0).out;
    assert!(
        second.contains("0 sessions added, 3 already there"),
        "{second}"
    );
    assert!(content(&lab.path("lake")) == before);

    // Cut off before the commit, with a table missing: the next call completes it with the same bytes.
    let commits = files(&lab.path("lake").join("_commits"), ".json");
    let (table, _) = before
        .iter()
        .find(|(path, _)| path.ends_with(commit_file(&commits[0])))
        .unwrap();
    std::fs::remove_file(table).unwrap();
    std::fs::remove_file(&commits[0]).unwrap();
    let third = add().code(0).out;
    assert!(
        third.contains("1 sessions added, 2 already there"),
        "{third}"
    );
    assert!(content(&lab.path("lake")) == before);

    // A commit whose table is gone, cut off or changed, and a commit that is cut off itself.
    let bytes = std::fs::read(table).unwrap();
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 1;
    for damaged in [None, Some(&bytes[..bytes.len() / 2]), Some(&flipped[..])] {
        match damaged {
            None => std::fs::remove_file(table).unwrap(),
            Some(damaged) => std::fs::write(table, damaged).unwrap(),
        }
        let mended = add()
            .code(0)
            .expect_stderr(&["written again", ".parquet was missing or damaged"]);
        assert!(
            mended
                .out
                .contains("0 sessions added, 1 damaged ones written again, 2 already there"),
            "{mended:#?}"
        );
        assert!(content(&lab.path("lake")) == before);
    }
    let commit = std::fs::read(&commits[0]).unwrap();
    std::fs::write(&commits[0], &commit[..commit.len() / 2]).unwrap();
    add()
        .code(0)
        .expect_stderr(&["written again", ".json was missing or damaged"]);
    assert!(content(&lab.path("lake")) == before);

    if let Ok(python) = std::env::var("SKINRIG_PYTHON") {
        // The second one overwrites files.
        for reader in ["read_lake_cluster.py", "read_lake.py"] {
            let script = format!("{}/tests/python/{reader}", crate::support::ROOT);
            let mut read = Command::new(&python);
            let output = read.arg(script).arg(lab.path("lake")).output().unwrap();
            assert!(
                output.status.success(),
                "{reader}: {}",
                String::from_utf8_lossy(&output.stderr)
            );
        }
    } else {
        eprintln!(
            "not read by others: no SKINRIG_PYTHON, an interpreter with tests/python/requirements.txt"
        );
    }

    // The same session with another content.
    let mut commit = read_json(&commits[0]);
    commit["content_sha256"] = "0".repeat(64).into();
    std::fs::write(&commits[0], commit.to_string()).unwrap();
    add()
        .code(2)
        .expect_stderr(&["another", "next: choose another lake"]);
}

/// Name of the tables of the session with this commit.
fn commit_file(commit: &Path) -> String {
    let name = commit.file_name().unwrap().to_str().unwrap();
    format!("{}.parquet", name.split('.').next().unwrap())
}

#[test]
fn a_session_that_may_not_be_used_is_left_out_loudly() {
    let lab = Lab::new();
    let good = text(&lab.record("s", &[]));
    let unsealed = lab.text("unsealed.session.sqlite");
    skinrig(&["salvage", &good, "--out", &unsealed]).code(0);
    let lake = lab.text("lake");
    let both = ["lake", &unsealed, &good, "--to", &lake];
    let added = skinrig(&both)
        .code(4)
        .expect_stderr(&["left out: it is not sealed", "skinrig resume"]);
    assert!(added.out.contains("1 sessions added"), "{added:#?}");

    // One that cannot be read, or whose folder no file system can name, does not keep the others out.
    let broken = lab.text("broken.session.sqlite");
    std::fs::write(&broken, "no session").unwrap();
    let name = format!("prototype.id={}", "x".repeat(300));
    let long = text(&lab.record("long", &["--set", &name]));
    let lake = lab.text("another");
    let all = ["lake", &broken, &long, &good, "--to", &lake];
    let added = skinrig(&all).code(2).expect_stderr(&[
        "broken.session.sqlite: left out",
        "File name too long",
        "2 sessions left out",
    ]);
    assert!(added.out.contains("1 sessions added"), "{added:#?}");
}
