//! Variants, copies of sessions and repeated exports never change the official result.

use serde_json::Value;

use crate::support::{Lab, SMALL, files, only, read_json, show, skinrig, text};

const CHANGE: &str = "analysis.min_samples=5";

fn best(folder: &str, more: &[&str]) -> Value {
    let all = skinrig(&[&["--json", "prototypes", folder], more].concat())
        .code(0)
        .json();
    all[0]["series"][0].clone()
}

#[test]
fn a_variant_is_stored_beside_the_official_analysis_and_used_only_on_request() {
    let lab = Lab::new();
    let folder = lab.text("s");
    skinrig(&["run", SMALL, "--sessions", &folder]).code(0);
    let session = only(&lab.path("s"), ".session.sqlite");
    let s = text(&session);
    let official = only(&lab.path("s"), ".results.json");
    let report = only(&lab.path("s"), ".report.html");
    let before = (
        std::fs::read(&official).unwrap(),
        std::fs::read(&report).unwrap(),
    );
    let rmse = best(&folder, &[])["best"].clone();

    // Unchanged settings are official; a change makes a variant, named by the user or by the change.
    skinrig(&["analyze", &s]).code(0);
    let output = skinrig(&["analyze", &s, "--set", CHANGE]).code(0);
    assert!(
        output.out.contains("VARIANT   analysis `min_samples=5`"),
        "{output:#?}"
    );
    skinrig(&[
        "analyze",
        &s,
        "--set",
        "analysis.centroid=all_clusters",
        "--name",
        "all",
    ])
    .code(0);
    // Eight presses are too few for the public code's calibration, and its windows give hardly more than a guess: no fault of the
    // session.
    let output = skinrig(&["analyze", &s, "--reference-code"]).code(0);
    assert!(
        output.out.contains("settings do not suit this recording")
            && output.out.contains("unknown"),
        "{output:#?}"
    );
    let after = (
        std::fs::read(&official).unwrap(),
        std::fs::read(&report).unwrap(),
    );
    assert!(before == after, "the official files are what they were");
    for name in ["min_samples=5", "all", "reference-code"] {
        let results = read_json(&only(
            &lab.path("s"),
            &format!(".analysis-{name}.results.json"),
        ));
        assert_eq!(results["provenance"]["variant"]["name"], name);
        assert_eq!(results["summary"]["variant"]["name"], name);
        let page = only(&lab.path("s"), &format!(".analysis-{name}.report.html"));
        let page = std::fs::read_to_string(page).unwrap();
        let first = &page[..page.find("<h2").unwrap()];
        assert!(
            first.contains("data-testid=\"variant\""),
            "not on the first screen"
        );
    }
    assert!(!String::from_utf8_lossy(&after.1).contains("data-testid=\"variant\""));

    // `show` lists them, the official one first.
    let listed = show(&session)["analyses"].as_array().unwrap().clone();
    let names: Vec<&Value> = listed.iter().map(|a| &a["name"]).collect();
    assert_eq!(
        names,
        [
            &Value::Null,
            &"all".into(),
            &"min_samples=5".into(),
            &"reference-code".into()
        ]
    );
    let shown = skinrig(&["show", &s]).code(0).out;
    assert!(
        shown.contains("analysis   official  RMSE")
            && shown.contains("analysis.centroid=all_clusters"),
        "{shown}"
    );

    // `prototypes` and `report` use a variant on request, and say so.
    assert_eq!(best(&folder, &[])["best"], rmse);
    let requested = best(&folder, &["--analysis", "all"]);
    assert_eq!(
        requested["points"][0]["variant"]["changed"][0],
        "analysis.centroid=all_clusters"
    );
    let table = skinrig(&["prototypes", &folder, "--analysis", "all"])
        .code(0)
        .out;
    assert!(table.contains("analysis.centroid=all_clusters"), "{table}");
    skinrig(&["report", &s]).code(0);
    let repeated = (
        std::fs::read(&official).unwrap(),
        std::fs::read(&report).unwrap(),
    );
    assert!(before == repeated);
    let page = skinrig(&["report", &s, "--analysis", "all"]).code(0).out;
    assert!(
        page.trim_end().ends_with(".analysis-all.report.html"),
        "{page}"
    );
    skinrig(&["report", &s, "--analysis", "none-such"])
        .code(2)
        .expect_stderr(&["all, min_samples=5, reference-code"]);

    // No command writes a variant to the official path, and a variant found there does not count as official.
    skinrig(&["analyze", &s, "--set", CHANGE, "--out", &text(&official)])
        .code(2)
        .expect_stderr(&["expected another path for the variant"]);
    skinrig(&["analyze", &s, "--name", "official"]).code(2);
    let variant = only(&lab.path("s"), ".analysis-all.results.json");
    std::fs::copy(variant, &official).unwrap();
    let point = best(&folder, &[])["points"][0].clone();
    assert_eq!(point["rmse_mm"], Value::Null, "{point}");
    assert!(
        point["without"].as_str().unwrap().contains("`all`"),
        "{point}"
    );
}

#[test]
fn a_copy_of_a_session_counts_once() {
    let lab = Lab::new();
    let folder = lab.text("s");
    skinrig(&["run", SMALL, "--sessions", &folder]).code(0);
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    skinrig(&["salvage", &session]).code(0);
    let copy = text(&only(&lab.path("s"), ".salvaged.session.sqlite"));
    // Another one lies there without results.
    std::fs::copy(&session, lab.path("s").join("a.session.sqlite")).unwrap();
    let output = skinrig(&["--json", "prototypes", &folder]).code(0);
    assert!(
        output.err.contains("is a copy of the session"),
        "{output:#?}"
    );
    let all = output.json();
    assert_eq!(all[0]["sessions"], 1);
    let points = all[0]["series"][0]["points"].as_array().unwrap();
    assert_eq!(points.len(), 1);
    assert_eq!(
        points[0]["session"],
        session.as_str(),
        "the sealed and analysed one stands for all"
    );
    assert!(points[0]["rmse_mm"]["value"].is_number(), "{:#}", points[0]);
    skinrig(&["compare", &session, &copy])
        .code(2)
        .expect_stderr(&["or a copy of it"]);
}

#[test]
fn a_repeated_export_changes_nothing() {
    let lab = Lab::new();
    let folder = lab.text("s");
    skinrig(&["run", SMALL, "--sessions", &folder]).code(0);
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    let (out, bundle) = (lab.text("out"), lab.text("bundle"));
    let tables = ["export", &session, "--to", "all", "--out", &out];
    let whole = ["export", &session, "--to", "bundle", "--out", &bundle];
    for export in [&tables, &whole] {
        let first = skinrig(export).code(0).out;
        assert_eq!(skinrig(export).code(0).out, first);
    }
    assert!(files(&lab.path("out"), ".partial").is_empty());
    let csv = only(&lab.path("out"), ".presses.csv");
    std::fs::write(&csv, "mine").unwrap();
    skinrig(&tables)
        .code(1)
        .expect_stderr(&["another file exists", "--overwrite"]);
    assert_eq!(std::fs::read_to_string(&csv).unwrap(), "mine");

    // An edited table with a rewritten manifest does not match the sealed session.
    skinrig(&["verify", &bundle]).code(0);
    let table = only(&lab.path("bundle"), ".presses.csv");
    let edited = std::fs::read_to_string(&table)
        .unwrap()
        .replacen(",valid,", ",missed,", 1);
    std::fs::write(&table, &edited).unwrap();
    let name = table.file_name().unwrap().to_str().unwrap();
    let path = lab.path("bundle").join("manifest.json");
    let mut manifest = read_json(&path);
    for file in manifest["files"].as_array_mut().unwrap() {
        if file["name"] == name {
            file["bytes"] = edited.len().into();
            file["sha256"] = crate::support::sha256(edited.as_bytes()).into();
        }
    }
    std::fs::write(&path, manifest.to_string()).unwrap();
    let output = skinrig(&["verify", &bundle]).code(4);
    assert!(
        output
            .out
            .contains("expected the content that follows from the sealed session"),
        "{output:#?}"
    );
}

#[test]
fn a_folder_is_no_session_to_tag() {
    let lab = Lab::new();
    lab.record("s", &[]);
    let folder = lab.text("s");
    let shown = skinrig(&["show", &folder]).code(2);
    let tagged = skinrig(&["tag", &folder, "good"]).code(2);
    assert_eq!(shown.err, tagged.err);
    assert!(files(&lab.path("s"), ".tags.jsonl").is_empty());
}

#[test]
fn text_that_acts_is_written_out() {
    let lab = Lab::new();
    let folder = lab.text("s");
    let hostile = "prototype.id='=1+1 \u{202e}gpj \u{1b}[8m'";
    let output = skinrig(&["run", SMALL, "--sessions", &folder, "--set", hostile]).code(0);
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    let page = std::fs::read_to_string(only(&lab.path("s"), ".report.html")).unwrap();
    let shown = skinrig(&["show", &session]).code(0);
    let out = lab.text("out");
    skinrig(&[
        "export", &session, "--to", "csv", "--only", "presses", "--out", &out,
    ])
    .code(0);
    for text in [&output.out, &output.err, &shown.out, &page] {
        assert!(!text.contains(['\u{202e}', '\u{1b}']), "{text}");
    }
    assert!(shown.out.contains("\\u{202e}gpj \\u{1b}[8m"), "{shown:#?}");
    let csv = std::fs::read_to_string(only(&lab.path("out"), ".csv")).unwrap();
    assert!(csv.lines().nth(1).unwrap().contains(",'=1+1 "), "{csv}");
}
