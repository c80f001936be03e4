//! Analyses of many sessions with other settings: the same results as one by one, nothing lost or repeated, bad sessions named.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::support::{Lab, ProgramOutput, SMALL, files, only, program, read_json, skinrig, text};

const SETTINGS: &str =
    "skinrig_settings: 1\nanalysis:\n  min_samples: 5\n  centroid: all_clusters\n";
const RESULTS: &str = ".analysis-wider.results.json";
const REPORT: &str = ".analysis-wider.report.html";

/// Records and analyses `count` sessions in the folder `s`; returns their paths.
fn recorded(lab: &Lab, count: u32) -> Vec<PathBuf> {
    let folder = lab.text("s");
    for seed in 1..=count {
        let seed = seed.to_string();
        skinrig(&["run", SMALL, "--sessions", &folder, "--seed", &seed]).code(0);
    }
    files(&lab.path("s"), ".session.sqlite")
}

/// Writes settings; returns their path.
fn settings(lab: &Lab, content: &str) -> String {
    std::fs::write(lab.path("wider.yaml"), content).unwrap();
    lab.text("wider.yaml")
}

fn reanalyze(settings: &str, sessions: &[&str]) -> ProgramOutput {
    skinrig(
        &[
            &[
                "reanalyze",
                "--settings",
                settings,
                "--name",
                "wider",
                "--json",
            ],
            sessions,
        ]
        .concat(),
    )
}

fn count(document: &Value, state: &str) -> u64 {
    document["counts"][state].as_u64().unwrap()
}

/// Results and reports of the variant, with the time of their last change.
fn written(folder: &Path) -> Vec<(PathBuf, Vec<u8>, std::time::SystemTime)> {
    let all = files(folder, RESULTS)
        .into_iter()
        .chain(files(folder, REPORT));
    let read = |path: PathBuf| {
        let time = path.metadata().unwrap().modified().unwrap();
        (path.clone(), std::fs::read(path).unwrap(), time)
    };
    all.map(read).collect()
}

#[test]
fn results_are_those_of_analyze_and_in_the_catalogue() {
    let lab = Lab::new();
    let sessions = recorded(&lab, 2);
    let (file, folder) = (settings(&lab, SETTINGS), lab.text("s"));
    let official = read_json(&files(&lab.path("s"), ".results.json")[0]);
    // A session that is named again, in another way, counts once.
    let again = format!(
        "{folder}/../s/{}",
        sessions[0].file_name().unwrap().to_str().unwrap()
    );
    let found = reanalyze(&file, &[&folder, &again]).code(0).json();
    assert_eq!(count(&found, "done"), 2, "{found}");
    let rows = found["sessions"].as_array().unwrap();
    assert_eq!(rows.len(), 2, "{found}");
    assert_eq!(
        rows[0]["official_rmse_mm"],
        official["summary"]["rmse_mm"]["value"]
    );
    let results = read_json(&files(&lab.path("s"), RESULTS)[0]);
    assert_eq!(rows[0]["rmse_mm"], results["summary"]["rmse_mm"]["value"]);

    let query = [
        "catalogue",
        "query",
        "variants",
        "--folder",
        &folder,
        "--json",
    ];
    let listed = skinrig(&query).code(0).json().to_string();
    assert!(listed.contains("wider"), "{listed}");
    let status = ["catalogue", "status", &folder, "--json"];
    let status = skinrig(&status).code(0).json();
    assert_eq!(status["status"]["stale"], Value::Array(vec![]), "{status}");

    // Nothing is left to do.
    let before = written(&lab.path("s"));
    let found = reanalyze(&file, &[&folder]).code(0).json();
    assert_eq!(count(&found, "there"), 2, "{found}");
    assert!(before == written(&lab.path("s")));

    let shown = skinrig(&["reanalyze", "--settings", &file, &folder])
        .code(0)
        .out;
    assert!(shown.contains("RMSE before -> after, mm"), "{shown}");
    assert!(shown.lines().count() <= 12, "{shown}");

    // One by one with `analyze`: the same bytes.
    for session in &sessions {
        let [a, b] = ["analysis.min_samples=5", "analysis.centroid=all_clusters"];
        let session = text(session);
        skinrig(&[
            "analyze", &session, "--set", a, "--set", b, "--name", "wider",
        ])
        .code(0);
    }
    let bytes = |all: Vec<(PathBuf, Vec<u8>, _)>| -> Vec<(PathBuf, Vec<u8>)> {
        all.into_iter()
            .map(|(path, bytes, _)| (path, bytes))
            .collect()
    };
    assert!(bytes(before) == bytes(written(&lab.path("s"))));
}

#[test]
fn a_killed_command_is_finished_by_the_next_one() {
    let lab = Lab::new();
    recorded(&lab, 3);
    let (file, folder) = (settings(&lab, SETTINGS), lab.path("s"));
    let mut command = program(&[
        "reanalyze",
        "--settings",
        &file,
        "--jobs",
        "1",
        &text(&folder),
    ]);
    let mut child = command.stdout(std::process::Stdio::null()).spawn().unwrap();
    while files(&folder, REPORT).is_empty() && child.try_wait().unwrap().is_none() {
        std::thread::yield_now();
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let report = files(&folder, REPORT)[0].clone();
    let before = std::fs::read(&report).unwrap();
    let time = report.metadata().unwrap().modified().unwrap();
    let found = reanalyze(&file, &[&text(&folder)]).code(0).json();
    assert!(count(&found, "there") >= 1, "{found}");
    let [done, replaced, there] = ["done", "replaced", "there"].map(|state| count(&found, state));
    assert_eq!(done + replaced + there, 3, "{found}");
    assert_eq!(files(&folder, RESULTS).len(), 3);
    assert_eq!(files(&folder, REPORT).len(), 3);
    let all = files(&folder, "");
    assert!(
        !all.iter().any(|path| text(path).contains(".partial-")),
        "{all:?}"
    );
    assert!(before == std::fs::read(&report).unwrap());
    assert_eq!(time, report.metadata().unwrap().modified().unwrap());

    // Results without their report, or with that of other results, are not complete.
    let reports = files(&folder, REPORT);
    std::fs::remove_file(&reports[0]).unwrap();
    std::fs::copy(&reports[2], &reports[1]).unwrap();
    let found = reanalyze(&file, &[&text(&folder)]).code(0).json();
    assert_eq!(
        (count(&found, "replaced"), count(&found, "there")),
        (2, 1),
        "{found}"
    );
    // Other settings replace them.
    let file = settings(&lab, "skinrig_settings: 1\nanalysis: {min_samples: 6}\n");
    let found = reanalyze(&file, &[&text(&folder)]).code(0).json();
    assert_eq!(count(&found, "replaced"), 3, "{found}");
}

#[test]
fn invalid_settings_are_refused_before_anything_runs() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    for (content, place) in [
        ("skinrig_settings: 1\nanalysis:\n  min_sample: 5\n", ":3:3"),
        (
            "skinrig_settings: 1\nanalysis:\n  min_samples: many\n",
            ":3:16",
        ),
        ("skinrig_settings: 1\nanalysis: {}\n", ":2:11"),
    ] {
        let file = settings(&lab, content);
        let at = format!("wider.yaml{place}");
        reanalyze(&file, &[&session]).code(2).expect_stderr(&[&at]);
    }
    let missing = lab.text("missing.yaml");
    reanalyze(&missing, &[&session])
        .code(2)
        .expect_stderr(&["missing.yaml"]);
    assert!(files(&lab.path("s"), ".results.json").is_empty());
}

#[test]
fn a_damaged_session_does_not_stop_the_others() {
    let lab = Lab::new();
    let sessions = recorded(&lab, 3);
    std::fs::write(&sessions[1], b"no session").unwrap();
    let file = settings(&lab, SETTINGS);
    let output = reanalyze(&file, &[&lab.text("s")]).code(2);
    let name = sessions[1].file_name().unwrap().to_str().unwrap();
    let failed = output
        .err
        .lines()
        .filter(|line| line.starts_with("failed "));
    let failed: Vec<&str> = failed.collect();
    assert_eq!(failed.len(), 1, "{output:#?}");
    assert!(failed[0].contains(name), "{output:#?}");
    assert!(output.err.contains("1 of 3 sessions failed"), "{output:#?}");
    let found = output.json();
    assert_eq!((count(&found, "done"), count(&found, "failed")), (2, 1));
    assert_eq!(found["sessions"][1]["state"], "failed");
    assert_eq!(files(&lab.path("s"), RESULTS).len(), 2);
    assert!(!text(&files(&lab.path("s"), RESULTS)[0]).contains(name));
}

#[test]
fn a_selection_names_sessions_and_its_exclusions_hold() {
    let lab = Lab::new();
    let sessions = recorded(&lab, 1);
    let session = text(&sessions[0]);
    let chosen = lab.text("lamp.selection.yaml");
    let select = [
        "select",
        &session,
        "--name",
        "lamp",
        "--out",
        &chosen,
        "--exclude",
        "4=lamp",
        "--decided-by",
        "A. Person",
    ];
    skinrig(&select).code(0);
    let file = settings(&lab, SETTINGS);
    reanalyze(&file, &[&chosen]).code(0);
    let results = read_json(&only(&lab.path("s"), RESULTS));
    assert_eq!(results["provenance"]["selection"]["excluded"], 1);
    assert_eq!(results["analysis"]["presses"][3]["verdict"], "excluded");
    // A variant has one selection or none.
    reanalyze(&file, &[&chosen, &session])
        .code(2)
        .expect_stderr(&["each session with one selection"]);
}
