//! Untrusted input: names in it never lead outside the requested folders.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::support::{Lab, SMALL, only, skinrig, text};

/// Prototype or protocol names that try to write elsewhere, by intent or by accident.
fn names() -> [String; 3] {
    [
        "../../../x".to_owned(),
        "/etc/x".to_owned(),
        "long ".repeat(100),
    ]
}

/// Every file below `folder`, links not followed.
fn everything(folder: &Path, to: &mut BTreeSet<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.is_symlink() {
            everything(&path, to);
        } else {
            to.insert(path);
        }
    }
}

#[test]
fn names_from_a_file_stay_in_the_folders_that_were_asked_for() {
    let lab = Lab::new();
    let protocol = std::fs::read_to_string(Path::new(crate::support::ROOT).join(SMALL)).unwrap();
    for (n, name) in names().iter().enumerate() {
        // Nested deeply, so that `..` would still end in this test's folder.
        let (inner, sessions) = (format!("a/b/c/{n}"), format!("a/b/c/{n}/sessions"));
        std::fs::create_dir_all(lab.path(&inner)).unwrap();
        let file = lab.path(&format!("{inner}/x.yaml"));
        let named = protocol
            .replace("name: small", &format!("name: \"{name}\""))
            .replace("id: test skin", &format!("id: \"{name}\""));
        std::fs::write(&file, named).unwrap();
        let ran = skinrig(&[
            "run",
            &text(&file),
            "--sessions",
            &lab.text(&sessions),
            "--no-analysis",
        ]);
        ran.code(0);
        let session = text(&only(&lab.path(&sessions), ".session.sqlite"));
        let out = lab.text(&format!("{inner}/out"));
        skinrig(&["export", &session, "--to", "all", "--out", &out]).code(0);
        skinrig(&["report", &session]);
        skinrig(&["salvage", &session]).code(0);
    }
    let mut found = BTreeSet::new();
    everything(&lab.path(""), &mut found);
    let strays: Vec<&PathBuf> = found
        .iter()
        .filter(|path| {
            let folder = path.parent().unwrap();
            let requested = folder.ends_with("sessions") || folder.ends_with("out");
            let name = path.file_name().unwrap().to_str().unwrap();
            let plain = name
                .chars()
                .all(|c| c.is_ascii_alphanumeric() || "._-".contains(c));
            !(requested && plain && name.len() < 200 || path.ends_with("x.yaml"))
        })
        .collect();
    assert!(strays.is_empty(), "{strays:?}");
    // Protocol, session, salvaged session, report, results, fifteen exports; nothing from rejected runs.
    assert!(found.len() >= 20 * names().len(), "{found:?}");
}

#[cfg(unix)]
#[test]
fn links_in_a_strangers_folder_are_not_written_through() {
    let lab = Lab::new();
    let session = lab.record("s", &[]);
    let victim = lab.path("victim");
    std::fs::write(&victim, "precious").unwrap();
    let stem = text(&session);
    let stem = stem.strip_suffix(".session.sqlite").unwrap();
    for ending in [
        ".report.html.partial",
        ".results.json.partial",
        ".report.html",
        ".tags.jsonl",
        ".salvaged.session.sqlite",
    ] {
        std::os::unix::fs::symlink(&victim, format!("{stem}{ending}")).unwrap();
    }
    let folder = lab.path("e");
    std::fs::create_dir(&folder).unwrap();
    let name = Path::new(stem).file_name().unwrap();
    let inside = text(&folder.join(name));
    for ending in [".pose.csv", ".camera1.raw", ".camera2.hdf5", ".npz.partial"] {
        std::os::unix::fs::symlink(&victim, format!("{inside}{ending}")).unwrap();
    }
    std::os::unix::fs::symlink(&folder, format!("{stem}.export")).unwrap();
    let session = text(&session);
    skinrig(&["report", &session]).code(0);
    for kind in ["raw", "hdf5", "csv"] {
        for more in [&[][..], &["--out", &text(&folder)]] {
            let export = ["export", &session, "--to", kind, "--only", "pose"];
            skinrig(&[&export[..], more].concat())
                .code(1)
                .expect_stderr(&["next:"]);
        }
    }
    let npz = ["export", &session, "--to", "npz", "--only", "pose"];
    skinrig(&[&npz[..], &["--out", &text(&folder)]].concat()).code(0);
    skinrig(&["tag", &session, "good"]).code(2);
    skinrig(&["salvage", &session]).code(2);
    assert_eq!(std::fs::read_to_string(&victim).unwrap(), "precious");
}
