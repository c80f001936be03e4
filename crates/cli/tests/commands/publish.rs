//! Published crates: complete, described, derived again bit by bit, and rejected after any change.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::support::{Lab, SMALL, files, only, read_json, sha256, skinrig, text};

pub(crate) const ABOUT: &str = "skinrig_publication: 1\ntitle: Presses on a test skin\ndescription: Simulated presses, to test publications.\n\
    license: CC-BY-4.0\npublished_on: 2026-01-31\npeople:\n  - {name: A. Person, orcid: 0000-0002-1825-0097, affiliation: {name: A \
    Laboratory, url: https://example.org/}}\npublisher: {name: A Laboratory, \
    url: https://example.org/}\nknown_limits: [nothing was measured on hardware]\n";

/// Publishes the small campaign, with a selection of it; returns the crate.
fn published(lab: &Lab, with_selection: bool) -> PathBuf {
    skinrig(&["run", SMALL, "--sessions", &lab.text("s")]).code(0);
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    let about = lab.text("publication.yaml");
    std::fs::write(&about, ABOUT).unwrap();
    let selection = lab.text("lamp.selection.yaml");
    let select = [
        "select",
        &session,
        "--name",
        "lamp",
        "--exclude",
        "4=hit",
        "--decided-by",
        "A. Person",
        "--out",
        &selection,
    ];
    skinrig(&select).code(0);
    let subject = if with_selection { &selection } else { &session };
    let out = lab.text("crate");
    let made = skinrig(&["publish", subject, "--about", &about, "--out", &out]).code(0);
    assert_eq!(
        made.out.starts_with("SELECTION `lamp`"),
        with_selection,
        "{made:#?}"
    );
    // It stands alone, elsewhere.
    std::fs::remove_dir_all(lab.path("s")).unwrap();
    let moved = lab.path("elsewhere");
    std::fs::rename(&out, &moved).unwrap();
    moved
}

fn reproduce(folder: &Path) -> crate::support::ProgramOutput {
    skinrig(&["reproduce", &text(folder)])
}

/// Replaces text in a file and its hash and size in the description, as somebody does who hides an edit.
fn forge(folder: &Path, name: &str, from: &str, to: &str) {
    let path = folder.join(name);
    let before = std::fs::read_to_string(&path).unwrap();
    let after = before.replacen(from, to, 1);
    assert_ne!(before, after, "{from}");
    std::fs::write(&path, &after).unwrap();
    let metadata = folder.join("ro-crate-metadata.json");
    let mut document = read_json(&metadata);
    let graph = document["@graph"].as_array_mut().unwrap();
    let entity = graph.iter_mut().find(|e| e["@id"] == name).unwrap();
    entity["contentSize"] = after.len().to_string().into();
    entity["sha256"] = sha256(after.as_bytes()).into();
    std::fs::write(&metadata, document.to_string()).unwrap();
}

#[test]
fn a_published_selection_is_derived_again_elsewhere_and_any_edit_fails() {
    let lab = Lab::new();
    let folder = published(&lab, true);
    let again = reproduce(&folder).code(0).out;
    assert!(!again.contains("FAIL"), "{again}");
    let numbers = &read_json(&folder.join("headline.json"))["sessions"][0]["numbers"];
    let numbers = numbers.as_array().unwrap();
    for number in numbers {
        let value = number["value"]
            .as_f64()
            .map_or("none".to_owned(), |v| v.to_string());
        let line = format!(
            "{} {}: {value}",
            number["set"].as_str().unwrap(),
            number["metric"].as_str().unwrap()
        );
        assert!(again.contains(&line), "{line} in {again}");
    }
    assert!(numbers.iter().any(|n| n["set"] == "without_selection"));
    let card = std::fs::read_to_string(folder.join("README.md")).unwrap();
    for part in [
        "https://orcid.org/0000-0002-1825-0097",
        "CC-BY-4.0",
        "SIMULATED",
        "nothing was measured on hardware",
        "uncalibrated, as configured",
        "presses [4] excluded: hit (decided by A. Person)",
    ] {
        assert!(card.contains(part), "{part} in {card}");
    }
    let metadata = std::fs::read_to_string(folder.join("ro-crate-metadata.json")).unwrap();
    assert!(metadata.contains(".bundle, selection lamp\""), "{metadata}");
    for ending in [
        ".protocol.yaml",
        "publication.yaml",
        "lamp.selection.yaml",
        "reproduce.sh",
    ] {
        only(&folder, ending);
    }
    assert_eq!(files(&folder.join("selected"), "").len(), 6);

    // A number changed in its last digit, with a description that fits.
    let stored = std::fs::read_to_string(folder.join("headline.json")).unwrap();
    let metadata = std::fs::read(folder.join("ro-crate-metadata.json")).unwrap();
    let value = numbers[0]["value"].to_string();
    let other = f64::from_bits(numbers[0]["value"].as_f64().unwrap().to_bits() + 1).to_string();
    forge(&folder, "headline.json", &value, &other);
    let failed = reproduce(&folder).code(4);
    assert_eq!(failed.out.matches("FAIL").count(), 1, "{failed:#?}");
    assert!(
        failed
            .out
            .contains(&format!("scored rmse: expected {other}")),
        "{failed:#?}"
    );
    std::fs::write(folder.join("headline.json"), &stored).unwrap();
    std::fs::write(folder.join("ro-crate-metadata.json"), &metadata).unwrap();

    // A crate that states nothing has nothing that could fail.
    let (head, _) = stored.split_once("\"sessions\": [").unwrap();
    forge(
        &folder,
        "headline.json",
        &stored,
        &format!("{head}\"sessions\": []}}"),
    );
    reproduce(&folder)
        .code(2)
        .expect_stderr(&["found no number"]);
    std::fs::write(folder.join("headline.json"), &stored).unwrap();
    std::fs::write(folder.join("ro-crate-metadata.json"), &metadata).unwrap();

    // The reason of an exclusion reworded, and a table edited, with descriptions that fit.
    forge(&folder, "lamp.selection.yaml", "\"hit\"", "\"struck\"");
    let failed = skinrig(&["--json", "reproduce", &text(&folder)]).code(4);
    assert_eq!(failed.json()["reproduced"], false);
    forge(&folder, "lamp.selection.yaml", "\"struck\"", "\"hit\"");
    let bundle = only(&folder, ".bundle");
    let name = bundle.file_name().unwrap().to_str().unwrap().to_owned();
    let table = only(&bundle, ".presses.csv");
    let table = format!("{name}/{}", table.file_name().unwrap().to_str().unwrap());
    forge(&folder, &table, ",valid,", ",missed,");
    std::fs::write(folder.join("more"), "x").unwrap();
    std::fs::remove_file(only(&bundle, ".camera1.raw")).unwrap();
    // A link to the same bytes is no file of the crate.
    let about = folder.join("publication.yaml");
    std::fs::rename(&about, lab.path("elsewhere.yaml")).unwrap();
    std::os::unix::fs::symlink(lab.path("elsewhere.yaml"), &about).unwrap();
    let failed = reproduce(&folder).code(4).out;
    for part in [
        "publication.yaml: expected a file of the crate itself, found a symbolic link",
        ".presses.csv: expected",
        "FAIL  more: expected",
        ".camera1.raw: expected a file, found none",
    ] {
        assert!(failed.contains(part), "{part} in {failed}");
    }
    assert!(
        failed.contains("scored rmse: 2"),
        "the session is sound: {failed}"
    );
    std::fs::remove_file(folder.join("ro-crate-metadata.json")).unwrap();
    reproduce(&folder)
        .code(2)
        .expect_stderr(&["expected an RO-Crate 1.1"]);
}

/// What people read is derived again, too: the data card, the numbers in the description, the protocol; and nothing else is there.
#[test]
fn the_card_and_the_description_follow_from_the_sessions() {
    let lab = Lab::new();
    let folder = published(&lab, true);
    let metadata = folder.join("ro-crate-metadata.json");
    let whole = std::fs::read(&metadata).unwrap();
    let fails = |part: &str| {
        let failed = reproduce(&folder).code(4).out;
        assert!(failed.contains(part), "{part} in {failed}");
        std::fs::write(&metadata, &whole).unwrap();
    };
    let protocol = only(&folder, ".protocol.yaml");
    let protocol = protocol.file_name().unwrap().to_str().unwrap();
    for (name, from, to) in [
        (
            "README.md",
            "SIMULATED, not measured on hardware",
            "bench 4",
        ),
        ("README.md", "| scored rmse | ", "| scored rmse | 0."),
        ("reproduce.sh", "exec skinrig", "exec true"),
        (protocol, "operator: ", "operator: B. "),
    ] {
        let before = std::fs::read(folder.join(name)).unwrap();
        forge(&folder, name, from, to);
        fails(&format!("FAIL  {name}: expected the content that follows"));
        std::fs::write(folder.join(name), before).unwrap();
    }

    let edit = |change: &dyn Fn(&mut Vec<Value>)| {
        let mut document = read_json(&metadata);
        change(document["@graph"].as_array_mut().unwrap());
        std::fs::write(&metadata, document.to_string()).unwrap();
    };
    let value = |graph: &mut Vec<Value>| {
        let entity = graph.iter_mut().find(|e| e["@id"] == "#number-1");
        entity.unwrap()["value"] = 0.125.into();
    };
    edit(&value);
    fails("FAIL  ro-crate-metadata.json: #number-1: expected {");
    edit(&|graph| graph.push(serde_json::json!({"@id": "#number-99", "@type": "PropertyValue"})));
    fails("FAIL  ro-crate-metadata.json: #number-99: expected no such entity");

    // A file that nothing derives, with a description that fits.
    for name in ["more.csv", "selected/more.csv"] {
        std::fs::write(folder.join(name), "x").unwrap();
        edit(&|graph| {
            graph.push(serde_json::json!({
                "@id": name, "@type": "File", "contentSize": "1", "sha256": sha256(b"x"),
            }));
        });
        fails(&format!("FAIL  {name}: expected only "));
        std::fs::remove_file(folder.join(name)).unwrap();
    }
    reproduce(&folder).code(0);
}

/// No file of a crate replaces another one.
#[test]
fn a_selection_named_like_another_file_is_not_published() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    let (about, selection) = (lab.text("about.yaml"), lab.text("publication.yaml"));
    std::fs::write(&about, ABOUT).unwrap();
    skinrig(&["select", &session, "--name", "all", "--out", &selection]).code(0);
    let out = lab.text("crate");
    let publish =
        |selection: &str| skinrig(&["publish", selection, "--about", &about, "--out", &out]);
    publish(&selection)
        .code(2)
        .expect_stderr(&["expected a selection with another name", "rename it"]);
    let renamed = lab.text("all.selection.yaml");
    std::fs::rename(&selection, &renamed).unwrap();
    publish(&renamed).code(0);
}

#[test]
fn other_programs_accept_the_crate() {
    let Ok(python) = std::env::var("SKINRIG_PYTHON") else {
        eprintln!("skipped: no SKINRIG_PYTHON, an interpreter with tests/python/requirements.txt");
        return;
    };
    let lab = Lab::new();
    let folder = published(&lab, false);
    reproduce(&folder).code(0);
    let mut validate = Command::new(python);
    validate
        .arg(format!(
            "{}/tests/python/validate_crate.py",
            crate::support::ROOT
        ))
        .arg(&folder);
    let output = validate.output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let checks: u32 = said.split(' ').next().unwrap().parse().unwrap();
    assert!(checks > 50, "{said}");
}

#[test]
fn nothing_is_published_that_is_not_stated() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    let about = lab.text("publication.yaml");
    let out = lab.text("crate");
    let publish = |sessions: &[&str]| {
        skinrig(&[&["publish"], sessions, &["--about", &about, "--out", &out]].concat())
    };
    for (from, to, part) in [
        (
            "0000-0002-1825-0097",
            "0000-0002-1825-0098",
            "a digit of the ORCID is wrong",
        ),
        ("0000-0002-1825-0097", "A. Person", "not an ORCID"),
        ("license: CC-BY-4.0\n", "", "`license`"),
        ("CC-BY-4.0", "free for all", "SPDX"),
        ("2026-01-31", "2026-02-30", "not a day"),
        (
            "known_limits: [nothing was measured on hardware]\n",
            "",
            "`known_limits`",
        ),
        (
            "known_limits: [nothing was measured on hardware]",
            "known_limits: []",
            "too short",
        ),
        ("https://example.org/", "example.org", "https://"),
    ] {
        std::fs::write(&about, ABOUT.replace(from, to)).unwrap();
        publish(&[&session])
            .code(2)
            .expect_stderr(&["publication.yaml:", part]);
        assert!(!Path::new(&out).exists());
    }
    std::fs::write(&about, ABOUT).unwrap();
    publish(&[&session, &session])
        .code(2)
        .expect_stderr(&["another file name"]);
    std::fs::create_dir(&out).unwrap();
    std::fs::write(lab.path("crate").join("mine"), "x").unwrap();
    publish(&[&session])
        .code(2)
        .expect_stderr(&["a new or empty folder"]);
    let document: Value = skinrig(&["schema", "publication"]).code(0).json();
    assert_eq!(document["title"], "skinrig publication");
}
