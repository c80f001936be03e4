//! Bundles: created, moved, modified, and from untrusted sources.

use serde_json::Value;

use crate::support::{Lab, SMALL, files, only, read_json, sha256, skinrig, text};

#[test]
fn a_moved_bundle_verifies_and_detects_any_change() {
    let lab = Lab::new();
    let s = lab.text("s");
    skinrig(&["run", SMALL, "--sessions", &s]).code(0);
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    skinrig(&["tag", &session, "good"]).code(0);
    let before = files(&lab.path("s"), "").len();
    let created = lab.text("made");
    let export = ["export", &session, "--to", "bundle", "--out", &created];
    skinrig(&export).code(0);
    assert_eq!(
        files(&lab.path("s"), "").len(),
        before,
        "nothing is written elsewhere"
    );

    let moved = lab.path("elsewhere");
    std::fs::rename(lab.path("made"), &moved).unwrap();
    std::fs::remove_dir_all(lab.path("s")).unwrap();
    let verify = || skinrig(&["verify", &text(&moved)]);
    assert!(verify().code(0).out.contains("sound"), "{:?}", verify());
    let manifest = read_json(&moved.join("manifest.json"));
    let listed = manifest["files"].as_array().unwrap();
    for file in listed {
        let bytes = std::fs::read(moved.join(file["name"].as_str().unwrap())).unwrap();
        assert_eq!(file["bytes"], bytes.len());
        assert_eq!(file["sha256"], sha256(&bytes).as_str());
    }
    for ending in [
        ".session.sqlite",
        ".results.json",
        ".report.html",
        ".tags.jsonl",
        ".camera1.raw",
        ".camera2.raw",
        ".presses.parquet",
        ".results.parquet",
        ".pose.parquet",
        ".presses.csv",
        ".results.csv",
    ] {
        only(&moved, ending);
    }
    assert_eq!(files(&moved, "").len(), listed.len() + 1);

    // One changed byte, an extra file, a missing file.
    for file in listed {
        let path = moved.join(file["name"].as_str().unwrap());
        let good = std::fs::read(&path).unwrap();
        let mut bad = good.clone();
        bad[good.len() / 2] ^= 1;
        // A session is read-only.
        std::fs::remove_file(&path).unwrap();
        std::fs::write(&path, bad).unwrap();
        assert!(verify().code(4).out.contains("SHA-256"));
        std::fs::remove_file(&path).unwrap();
        assert!(verify().code(4).out.contains("found none"));
        std::fs::write(&path, good).unwrap();
    }
    std::fs::write(moved.join("more"), "x").unwrap();
    assert!(
        verify()
            .code(4)
            .out
            .contains("only files listed in the manifest")
    );
    std::fs::remove_file(moved.join("more")).unwrap();
    verify().code(0);

    // An untrusted manifest cannot read files outside the bundle.
    for (key, name) in [
        ("name", "../x"),
        ("name", "/etc/passwd"),
        ("name", "a/b"),
        ("name", ""),
    ] {
        let mut hostile = manifest.clone();
        hostile["files"][1][key] = Value::from(name);
        std::fs::write(moved.join("manifest.json"), hostile.to_string()).unwrap();
        verify().code(2).expect_stderr(&["expected a bundle"]);
    }
    std::fs::write(moved.join("manifest.json"), "{}").unwrap();
    verify().code(2).expect_stderr(&["expected a bundle"]);
}

#[test]
fn a_bundle_is_exported_alone() {
    let export = ["export", "README.md", "--to", "bundle", "--to", "csv"];
    skinrig(&export).code(2);
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    let export = ["export", &session, "--to", "bundle", "--to", "csv"];
    skinrig(&export).code(2).expect_stderr(&["no other format"]);
    let session_and_catalogue = 2;
    assert_eq!(files(&lab.path("s"), "").len(), session_and_catalogue);
    // Beside other files it would not verify.
    let folder = lab.text("b");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(lab.path("b/other.txt"), "mine").unwrap();
    let export = ["export", &session, "--to", "bundle", "--out", &folder];
    skinrig(&export)
        .code(2)
        .expect_stderr(&["for the bundle alone, found other.txt"]);
    assert_eq!(files(&lab.path("b"), "").len(), 1);
    std::fs::remove_file(lab.path("b/other.txt")).unwrap();
    skinrig(&export).code(0);
    skinrig(&["verify", &folder]).code(0);
    let status = skinrig(&["status", &session]).code(0).out;
    assert!(status.contains("8 planned: 8 valid"), "{status}");
    assert!(status.contains("0 excluded; 2 of 2 sync"), "{status}");
}
