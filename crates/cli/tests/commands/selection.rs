//! Selections stand for sessions: exclusions with reasons, stated before the headline, never silent.

use std::path::Path;

use serde_json::Value;

use crate::online::USUAL;
use crate::support::{Lab, SMALL, files, only, read_json, skinrig, text};

/// A recorded and analysed session.
fn recorded(lab: &Lab, folder: &str, more: &[&str]) -> String {
    let sessions = lab.text(folder);
    skinrig(&[&["run", SMALL, "--sessions", &sessions], more].concat()).code(0);
    text(&only(&lab.path(folder), ".session.sqlite"))
}

/// Selects presses of a session; returns the selection's path.
fn select(lab: &Lab, name: &str, session: &str, exclude: &[&str]) -> String {
    let out = lab.text(&format!("{name}.selection.yaml"));
    let mut arguments = vec!["select", session, "--name", name, "--out", &out];
    for exclude in exclude {
        arguments.extend(["--exclude", exclude]);
    }
    if !exclude.is_empty() {
        arguments.extend(["--decided-by", "A. Person"]);
    }
    skinrig(&arguments).code(0);
    out
}

fn edit(path: &str, from: &str, to: &str) {
    let before = std::fs::read_to_string(path).unwrap();
    let after = before.replacen(from, to, 1);
    assert_ne!(before, after, "{from}");
    std::fs::write(path, after).unwrap();
}

fn press(document: &Value, number: u32) -> &Value {
    &document["analysis"]["presses"][number as usize - 1]
}

#[test]
fn an_excluded_press_shows_who_excluded_it_and_why_and_what_it_changes() {
    let lab = Lab::new();
    let session = recorded(&lab, "s", &[]);
    let before = files(&lab.path("s"), ".results.json");
    let official = read_json(&before[0]);
    let chosen = select(
        &lab,
        "lamp",
        &session,
        &["4=the lamp \"failed\"", "5-6=hit"],
    );
    let shown = skinrig(&["analyze", &chosen]).code(0).out;
    let lines: Vec<&str> = shown.lines().collect();
    assert_eq!(
        lines[0],
        "selection `lamp`: 1 session(s), 3 press(es) excluded"
    );
    let hash = lines[1].trim_start_matches("SHA-256").trim();
    assert_eq!(
        hash,
        crate::support::sha256(&std::fs::read(&chosen).unwrap())
    );
    let at = |part: &str| {
        lines
            .iter()
            .position(|l| l.contains(part))
            .unwrap_or_else(|| panic!("{part} in {shown}"))
    };
    assert!(at("SELECTION `lamp` (SHA-256") < at("RMSE  "), "{shown}");
    assert_eq!(at("mm without the selection"), at("RMSE  ") + 1, "{shown}");

    let label = format!("selection-{}", &hash[..16]);
    let results = read_json(&only(
        &lab.path("s"),
        &format!(".analysis-{label}.results.json"),
    ));
    for number in [4, 5, 6] {
        let reason = if number == 4 {
            "the lamp \"failed\""
        } else {
            "hit"
        };
        let press = press(&results, number);
        assert_eq!(press["verdict"], "excluded");
        assert_eq!(press["cause"]["by_selection"]["reason"], reason);
        assert_eq!(
            press["reason"],
            format!("excluded by the selection: {reason} (A. Person)")
        );
    }
    let selection = &results["provenance"]["variant"]["selection"];
    assert_eq!(
        (&selection["name"], &selection["sha256"]),
        (&"lamp".into(), &hash.into())
    );
    let effect = &results["provenance"]["selection"];
    assert_eq!(effect["excluded"], 3);
    assert_eq!(
        effect["rmse_without_mm"],
        official["analysis"]["scored"]["rmse_mm"]
    );
    assert_eq!(&results["summary"]["selection"], effect);
    assert_eq!(results["analysis"]["scored"]["rmse_mm"]["n"], 5);
    let page = only(&lab.path("s"), &format!(".analysis-{label}.report.html"));
    let page = std::fs::read_to_string(page).unwrap();
    let first = &page[..page.find("<h2").unwrap()];
    assert!(first.contains("data-testid=\"selection\"") && first.contains("without the selection"));
    assert!(page.contains("excluded by the selection"));
    // Other programs get the same.
    let found = skinrig::library::analyze(Path::new(&chosen), Default::default(), false);
    let found = found.map_err(|e| e.message).unwrap();
    assert_eq!(found["summary"], results["summary"]);
    // The official results stay, and nothing takes the selection's for them.
    assert_eq!(read_json(&before[0]), official);
    let point = skinrig(&["--json", "prototypes", &lab.text("s")])
        .code(0)
        .json();
    let point = &point[0]["series"][0]["points"][0]["rmse_mm"];
    assert_eq!(point, &official["summary"]["rmse_mm"]);
    skinrig(&["report", &session, "--analysis", &label])
        .code(2)
        .expect_stderr(&["one of `lamp`", "skinrig report"]);
    skinrig(&["report", &chosen]).code(0);

    let out = lab.text("csv");
    let csv = [
        "export", &chosen, "--to", "csv", "--only", "presses", "--out", &out,
    ];
    skinrig(&csv).code(0);
    let csv = only(&lab.path("csv"), &format!(".{label}.presses.csv"));
    assert!(
        std::fs::read_to_string(csv)
            .unwrap()
            .contains("excluded by the selection: hit (A. Person)")
    );
    skinrig(&["export", &chosen, "--to", "bundle"])
        .code(2)
        .expect_stderr(&["skinrig publish"]);
}

#[test]
fn a_selection_of_several_sessions_is_used_wherever_a_session_is() {
    let lab = Lab::new();
    let sessions = [
        recorded(&lab, "a", &[]),
        recorded(&lab, "b", &["--seed", "6"]),
    ];
    let out = lab.text("both.selection.yaml");
    let arguments = [
        "select",
        &sessions[0],
        &sessions[1],
        "--name",
        "both",
        "--out",
        &out,
    ];
    let made = skinrig(&arguments).code(0);
    assert!(made.out.contains("2 session(s), 0 press(es)"), "{made:#?}");
    let all = skinrig(&["--json", "verify", &out]).code(0).json();
    assert_eq!(all["selection"]["name"], "both");
    assert_eq!(all["sessions"].as_array().unwrap().len(), 2);
    let all = skinrig(&["--json", "analyze", &out]).code(0).json();
    assert_eq!(all["sessions"][1]["provenance"]["seed"], 6);
    assert_eq!(all["sessions"][0]["provenance"]["selection"]["excluded"], 0);
    skinrig(&["tradeoff", &out])
        .code(2)
        .expect_stderr(&["a selection of one session, found 2"]);
    skinrig(&["analyze", &out, "--out", "x.json"]).code(2);

    let chosen = select(&lab, "one", &sessions[0], &["4=hit"]);
    let page = lab.text("page.html");
    let compare = ["compare", &chosen, &sessions[1], "--out", &page];
    let shown = skinrig(&compare).code(0).out;
    assert!(shown.starts_with("SELECTION A `one` (SHA-256"), "{shown}");
    let found = skinrig(&[&["--json"], &compare[..]].concat())
        .code(0)
        .json();
    assert_eq!(found["selections"][0]["selection"]["name"], "one");
    assert_eq!(found["selections"][0]["excluded"], 1);
    let without = &all["sessions"][0]["analysis"]["scored"]["rmse_mm"];
    assert_eq!(&found["selections"][0]["rmse_without_mm"], without);
    let page = std::fs::read_to_string(&page).unwrap();
    assert!(page.contains("selection `one` (SHA-256"));
    // A variant of the selection, and one of the other session, have one name.
    let variant = |of: &str| {
        skinrig(&[
            "analyze",
            of,
            "--set",
            "analysis.min_samples=12",
            "--name",
            "v",
        ])
        .code(0)
    };
    skinrig(&[&compare[..], &["--analysis", "v"]].concat())
        .code(2)
        .expect_stderr(&["named `v`"]);
    variant(&sessions[1]);
    variant(&sessions[0]);
    skinrig(&[&compare[..], &["--analysis", "v"]].concat())
        .code(2)
        .expect_stderr(&[
            "expected a variant of `one`",
            "one of the whole session",
            "--name NAME",
        ]);
    variant(&chosen);
    let found = skinrig(&[&["--json"], &compare[..], &["--analysis", "v"]].concat())
        .code(0)
        .json();
    assert_eq!(found["selections"][0]["excluded"], 1);
    skinrig(&["compare", &sessions[0], &sessions[1], "--analysis", "v"])
        .code(2)
        .expect_stderr(&["one of `one`", "skinrig compare", "one.selection.yaml"]);
    let shown = skinrig(&["tradeoff", &chosen, "--repeats", "1"]).code(0);
    assert!(shown.out.contains("the selection `one`"), "{shown:#?}");
}

#[test]
fn a_selection_that_does_not_fit_is_rejected_where_it_is_wrong() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    let chosen = select(&lab, "x", &session, &["4=hit"]);
    let good = std::fs::read_to_string(&chosen).unwrap();
    let rejected = |from: &str, to: &str, parts: &[&str]| {
        edit(&chosen, from, to);
        skinrig(&["analyze", &chosen]).code(2).expect_stderr(parts);
        std::fs::write(&chosen, &good).unwrap();
    };
    rejected(
        "content_sha256: ",
        "content_sha256: 0",
        &["x.selection.yaml:5:21", "not a hash"],
    );
    let hash = good
        .split("content_sha256: ")
        .nth(1)
        .unwrap()
        .lines()
        .next()
        .unwrap();
    let other = "0".repeat(64);
    rejected(
        hash,
        &other,
        &[":5:21", "another content", hash, "skinrig select"],
    );
    rejected("[4]", "[4, 99]", &[":7:22", "no such press", "1 to 10"]);
    rejected("[4]", "[1]", &[":7:19", "sync press"]);
    rejected(
        "        reason: \"hit\"\n",
        "",
        &[":7:", "a required key is missing", "`reason`"],
    );
    rejected(
        "        decided_by: \"A. Person\"\n",
        "",
        &[":7:", "`decided_by`"],
    );

    // It moves with its session, to one folder.
    let moved = lab.path("moved");
    std::fs::create_dir(&moved).unwrap();
    std::fs::rename(&chosen, moved.join("x.selection.yaml")).unwrap();
    let moved_to = text(&moved.join("x.selection.yaml"));
    skinrig(&["verify", &moved_to])
        .code(2)
        .expect_stderr(&["the session is missing"]);
    let name = Path::new(&session).file_name().unwrap();
    std::fs::rename(&session, moved.join(name)).unwrap();
    skinrig(&["verify", &moved_to]).code(0);

    let inside = text(&moved.join(name));
    let out = lab.text("y.yaml");
    let select = |more: &[&str]| {
        skinrig(&[&["select", &inside, "--name", "y", "--out", &out], more].concat())
    };
    select(&["--exclude", "4=hit"])
        .code(2)
        .expect_stderr(&["--decided-by"]);
    select(&["--exclude", "4", "--decided-by", "p"])
        .code(2)
        .expect_stderr(&["PRESSES=REASON"]);
    select(&["--exclude", "77=hit", "--decided-by", "p"])
        .code(2)
        .expect_stderr(&["no such press"]);
    assert!(!Path::new(&out).exists());
    select(&[]).code(0);
    select(&[]).code(2).expect_stderr(&["expected a new file"]);
}

/// `online` and `challenge` leave out what a selection excludes, and state it with the RMSE without the selection.
#[test]
fn selections_of_one_session_are_replayed_and_given_away() {
    let lab = Lab::new();
    let session = recorded(&lab, "s", &USUAL);
    let official = read_json(&only(&lab.path("s"), ".results.json"));
    let presses = official["analysis"]["presses"].as_array().unwrap();
    let scored: Vec<u64> = presses
        .iter()
        .filter(|p| p["role"] == "score")
        .map(|p| p["press"].as_u64().unwrap())
        .collect();
    assert_eq!(scored.len(), 4);
    let exclude = format!("{}=hit", scored[1]);
    let chosen = select(&lab, "lamp", &session, &[&exclude]);
    let hash = crate::support::sha256(&std::fs::read(&chosen).unwrap());
    let states = |selection: &Value| {
        assert_eq!(selection["selection"]["sha256"], hash.as_str());
        assert_eq!(selection["excluded"], 1);
        let without = &official["analysis"]["scored"]["rmse_mm"];
        assert_eq!(&selection["rmse_without_mm"], without);
        assert_ne!(&selection["rmse_mm"], without);
    };
    let summary = |of: &str| -> Value {
        let lines = skinrig(&["--json", "online", of]).code(0).out;
        serde_json::from_str::<Value>(lines.lines().last().unwrap()).unwrap()["summary"].clone()
    };
    let (plain, selected) = (summary(&session), summary(&chosen));
    assert_eq!(plain.get("selection"), None);
    states(&selected["selection"]);
    let count = |of: &Value| of["felt"]["presses"].as_u64().unwrap();
    assert_eq!(count(&selected) + 1, count(&plain));
    assert_eq!(selected["windows"], selected["windows_equal_to_analysis"]);
    let words = skinrig(&["online", &chosen]).code(0).out;
    assert!(words.starts_with("SELECTION `lamp` (SHA-256 "), "{words}");

    let folder = lab.text("challenge");
    let made = skinrig(&["--json", "challenge", "make", &chosen, "--out", &folder]);
    let made = made.code(0).json();
    assert_eq!(
        (&made["calibrating"], &made["scored"]),
        (&12.into(), &3.into())
    );
    states(&made["selection"]);
    let answers = made["answers"].as_str().unwrap().to_owned();
    assert!(answers.contains(&hash[..16]), "{answers}");
    let sealed = read_json(Path::new(&answers));
    let own: Vec<u64> = sealed["presses"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p["session_press"].as_u64().unwrap())
        .collect();
    assert!(!own.contains(&scored[1]), "{own:?}");
    let description = read_json(&lab.path("challenge/challenge.json"));
    for stated in [&sealed["selection"], &description["selection"]] {
        assert_eq!(
            (&stated["name"], &stated["sha256"]),
            (&"lamp".into(), &hash.as_str().into())
        );
    }
    // Estimates of the selected presses are scored under its name.
    let mut table = "press,x_mm,y_mm\n".to_owned();
    for press in sealed["presses"].as_array().unwrap() {
        table += &format!("{},{},{}\n", press["press"], press["x_mm"], press["y_mm"]);
    }
    std::fs::write(lab.path("table.csv"), table).unwrap();
    let score = [
        "challenge",
        "score",
        &folder,
        &lab.text("table.csv"),
        "--answers",
        &answers,
    ];
    let score = skinrig(&[&["--json"][..], &score].concat()).code(0).json();
    assert_eq!(
        (&score["presses"], &score["selection"]["sha256"]),
        (&3.into(), &hash.as_str().into())
    );

    // One session: a selection of two is refused, an invalid one with its findings.
    let both = lab.text("both.selection.yaml");
    let other = recorded(&lab, "t", &["--seed", "6"]);
    skinrig(&["select", &session, &other, "--name", "both", "--out", &both]).code(0);
    edit(&chosen, "content_sha256: ", "content_sha256: 0");
    for wrong in [&both, &chosen] {
        let expected = if *wrong == both {
            "a selection of one session"
        } else {
            "content_sha256"
        };
        for command in [
            &["online", wrong.as_str()][..],
            &["challenge", "make", wrong, "--out", &lab.text("c2")],
            &["challenge", "run", wrong, "--", "true"],
        ] {
            skinrig(command).code(2).expect_stderr(&[expected]);
        }
    }
}
