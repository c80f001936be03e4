//! Overrides, limits, unwritable folders, existing names.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Stdio;

use crate::support::{
    Lab, ROOT, SMALL, files, only, program, read_json, sha256, show, skinrig, text,
};

#[test]
fn an_override_changes_the_plan_and_is_stored_with_the_base_text() {
    let lab = Lab::new();
    let base = lab.record("a", &[]);
    let other = lab.record(
        "b",
        &[
            "--set",
            "depth=1 mm",
            "--set",
            "repetitions.count=1",
            "--set",
            "evaluation.score=[1]",
        ],
    );
    let (base, other) = (show(&base), show(&other));
    assert_ne!(base["plan_sha256"], other["plan_sha256"]);
    assert_eq!(base["protocol_sha256"], other["protocol_sha256"]);
    let text_of_file = std::fs::read(format!("{ROOT}/{SMALL}")).unwrap();
    assert_eq!(other["protocol_sha256"], sha256(&text_of_file).as_str());
    assert_eq!(base["overrides"], serde_json::json!([]));
    assert_eq!(
        other["overrides"],
        serde_json::json!(["depth=1 mm", "repetitions.count=1", "evaluation.score=[1]"])
    );
    assert_eq!(other["totals"]["presses"]["planned"], 4);
    assert!(
        other["presses"]
            .as_array()
            .unwrap()
            .iter()
            .all(|p| p["depth_mm"] == 1.0)
    );
    let shown = skinrig(&[
        "show",
        "--protocol",
        &text(&only(&lab.path("b"), ".session.sqlite")),
    ])
    .code(0)
    .out;
    assert!(
        shown.contains("--set depth=1 mm") && shown.contains("depth: 1.5 mm"),
        "{shown}"
    );
    // The executed plan equals the plan shown before.
    let planned = skinrig(&["plan", "--json", SMALL]).code(0).json();
    assert_eq!(planned["sha256"], base["plan_sha256"]);
}

#[test]
fn a_wrong_override_is_refused_with_a_suggestion() {
    let lab = Lab::new();
    for (change, parts) in [
        (
            "motion.perid=2 s",
            vec!["motion.perid", "did you mean `period`"],
        ),
        ("dept=1 mm", vec!["did you mean `depth`"]),
        ("depth=1", vec!["depth", "mm"]),
        ("depth=1 s", vec!["depth", "1 s"]),
        ("depth=9 mm", vec!["depth"]),
        ("depth", vec!["depth"]),
    ] {
        skinrig(&["run", SMALL, "--set", change, "--sessions", &lab.text("s")])
            .code(2)
            .expect_stderr(&["--set"])
            .expect_stderr(&parts);
    }
    assert!(!lab.path("s").exists(), "nothing was to be made");
}

#[test]
fn no_option_replaces_a_session_or_a_protocol() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &["--set", "analysis.bootstrap_resamples=50"]));
    let other = lab.text("other.session.sqlite");
    let protocol = lab.text("p.yaml");
    std::fs::copy(&session, &other).unwrap();
    std::fs::copy(format!("{ROOT}/{SMALL}"), &protocol).unwrap();
    let before = [&session, &other, &protocol].map(|path| std::fs::read(path).unwrap());
    for command in [
        ["analyze", &session, "--out", &session],
        ["analyze", &session, "--out", &other],
        ["report", &session, "--out", &other],
        ["tradeoff", &session, "--out", &other],
        ["plan", &protocol, "--svg", &protocol],
        ["plan", &protocol, "--svg", &other],
        ["analyze", &session, "--out", &protocol],
    ] {
        skinrig(&command)
            .code(2)
            .expect_stderr(&["found a file of another kind", "name another file"]);
    }
    let scene = ["scene", "check", &session, "--out", &other];
    skinrig(&scene).code(2).expect_stderr(&["of another kind"]);
    let after = [&session, &other, &protocol].map(|path| std::fs::read(path).unwrap());
    assert!(before == after, "a file was changed");
    // What the same command wrote before is replaced.
    let out = lab.text("o.json");
    for _ in 0..2 {
        skinrig(&["analyze", &session, "--out", &out]).code(0);
    }
    let variant = |samples: &str| {
        let set = format!("analysis.min_samples={samples}");
        skinrig(&["analyze", &session, "--set", &set, "--name", "x"])
            .code(0)
            .err
    };
    assert!(!variant("5").contains("is replaced"));
    let told = variant("60");
    assert!(
        told.contains("the variant `x` of other settings (analysis.min_samples=5)"),
        "{told}"
    );
}

#[test]
fn a_value_given_twice_is_refused_and_not_the_last_one_taken() {
    for (twice, parts) in [
        (
            ["--set", "depth=1 mm", "--set", "depth=1.5 mm"],
            ["`depth`", "--set depth=1.5 mm"],
        ),
        (
            ["--seed", "5", "--set", "seed=6"],
            ["--seed 5", "--set seed=6"],
        ),
        (
            ["--level", "optical", "--set", "scene.level=kinematic"],
            ["--level optical", "--set scene.level=kinematic"],
        ),
    ] {
        let run = [&["run", SMALL, "--sessions", "/nowhere"], &twice[..]].concat();
        skinrig(&run).code(2).expect_stderr(&parts);
    }
    // The words before the values, the option of each value, and the two values.
    let skin = ["scene.skin={thickness: 3 mm}", "scene.skin.thickness=3 mm"];
    for (command, option, [one, other]) in [
        (
            &["scene", "predict", "a.session.sqlite"][..],
            "--set",
            ["depth=1 mm", "depth=2 mm"],
        ),
        (&["check", SMALL], "--set", skin),
        (&["check", SMALL], "--set", [skin[1], skin[0]]),
        (
            &["compare", "a", "b"],
            "--margin",
            ["rmse=0.3mm", "rmse=2mm"],
        ),
        (
            &["catalogue", "query", "best-prototypes"],
            "",
            ["min_sessions=1", "min_sessions=5"],
        ),
    ] {
        let given = [option, one, option, other];
        let given = given.into_iter().filter(|word| !word.is_empty());
        let words: Vec<&str> = command.iter().copied().chain(given).collect();
        skinrig(&words).code(2).expect_stderr(&[one, other]);
    }
    let same = ["check", SMALL, "--set", "depth=1 mm", "--set", "depth=1 mm"];
    skinrig(&same).code(0);
}

#[test]
fn a_press_stays_inside_the_simulated_skin() {
    let thin = ["check", SMALL, "--set", "scene.skin={thickness: 1 mm}"];
    skinrig(&thin).code(2).expect_stderr(&[
        "the press goes through the simulated skin",
        "less than 1 mm",
        "`scene.skin.thickness`",
    ]);
    let thicker = ["check", SMALL, "--set", "scene.skin={thickness: 2 mm}"];
    skinrig(&thicker).code(0);
}

#[test]
fn all_errors_of_a_protocol_are_reported_at_once() {
    let lab = Lab::new();
    let good = std::fs::read_to_string(format!("{ROOT}/{SMALL}")).unwrap();
    let bad = good
        .replacen("depth: 1.5 mm", "depth: 1.5", 1)
        .replacen("operator:", "operater:", 1)
        .replacen("max_force: 4 N", "max_force: 4 mm", 1);
    let file = lab.text("bad.yaml");
    std::fs::write(&file, bad).unwrap();
    skinrig(&["check", &file]).code(2).expect_stderr(&[
        "bad.yaml:4:1",
        "did you mean `operator`",
        "bad.yaml:30:8",
        "bad.yaml:39:14",
        "4 mm",
        "^^^",
    ]);
}

#[test]
fn the_plan_is_drawn_and_printed_step_by_step() {
    let lab = Lab::new();
    let svg = lab.text("path.svg");
    let result = skinrig(&["plan", SMALL, "--steps", "--svg", &svg]).code(0);
    let steps = result
        .out
        .lines()
        .filter(|l| l.contains("  press "))
        .count();
    assert_eq!(steps, 10, "{}", result.out);
    let drawn = std::fs::read_to_string(&svg).unwrap();
    assert!(
        drawn.starts_with("<svg") || drawn.starts_with("<?xml"),
        "{drawn}"
    );
    // Numbered: the last of four locations shows its number.
    assert!(drawn.contains(">4<"), "{drawn}");
    skinrig(&["plan", SMALL, "--svg", &lab.text("no/such/folder.svg")])
        .code(1)
        .expect_stderr(&["folder.svg"]);
}

#[test]
fn a_limit_that_is_not_met_ends_with_code_4_and_keeps_the_results() {
    let lab = Lab::new();
    skinrig(&[
        "run",
        SMALL,
        "--sessions",
        &lab.text("s"),
        "--max-rmse",
        "0.1",
    ])
    .code(4)
    .expect_stderr(&["RMSE", "at most 0.1 mm", "found"]);
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    let rmse =
        read_json(&only(&lab.path("s"), ".results.json"))["analysis"]["scored"]["rmse_mm"]["value"]
            .as_f64()
            .unwrap();
    only(&lab.path("s"), ".report.html");
    let above = (rmse + 0.01).to_string();
    skinrig(&["analyze", &session, "--max-rmse", &above]).code(0);
    let below = (rmse - 0.01).to_string();
    skinrig(&["analyze", &session, "--max-rmse", &below]).code(4);
    // The value that is printed is above the limit too, by however little it is missed.
    for limit in [
        f64::from_bits(rmse.to_bits() - 1),
        (rmse * 1e3).floor() / 1e3,
    ] {
        let refused = skinrig(&["analyze", &session, "--max-rmse", &limit.to_string()]).code(4);
        let (_, found) = refused.err.split_once("found ").unwrap();
        let found: f64 = found.split(' ').next().unwrap().parse().unwrap();
        assert!(found > limit, "{}", refused.err);
    }
    // The error of the few presses that are left when a rule excludes the others meets no limit, and compares no skins.
    let few = lab.text("few");
    let rule = "analysis={calibration: none, cluster_threshold: fixed, min_samples: 20, min_cluster_events: 5000}";
    let lost = ["run", SMALL, "--sessions", &few, "--set", rule];
    skinrig(&[&lost[..], &["--max-rmse", "100"]].concat())
        .code(4)
        .expect_stderr(&["at least half of the scored presses", "next:"]);
    let few = text(&only(&lab.path("few"), ".session.sqlite"));
    skinrig(&["compare", &few, &session, "--out", &lab.text("c.html")])
        .code(2)
        .expect_stderr(&["scored presses that count"]);
    // Nor does that of the few presses that a run made before it failed.
    let broken = lab.text("broken");
    let lost = ["run", SMALL, "--sessions", &broken, "--fault"];
    skinrig(&[&lost[..], &["robot-lost@hold:5"]].concat());
    let broken = text(&only(&lab.path("broken"), ".session.sqlite"));
    skinrig(&["analyze", &broken]).code(0);
    skinrig(&["analyze", &broken, "--max-rmse", "100"])
        .code(4)
        .expect_stderr(&["at least half of the scored presses", "were never made"]);
    skinrig(&["compare", &broken, &session, "--out", &lab.text("c.html")])
        .code(2)
        .expect_stderr(&["scored presses that count"]);
    // Without an analysis no limit is met.
    skinrig(&["run", SMALL, "--no-analysis", "--max-rmse", "100"])
        .code(2)
        .expect_stderr(&["--max-rmse", "--no-analysis"]);
    for nonsense in ["NaN", "-1", "two"] {
        skinrig(&["analyze", &session, &format!("--max-rmse={nonsense}")])
            .code(2)
            .expect_stderr(&["--max-rmse"]);
    }
    // A session without events is INVALID, whatever the limit.
    skinrig(&[
        "run",
        SMALL,
        "--level",
        "kinematic",
        "--sessions",
        &lab.text("k"),
        "--max-rmse",
        "100",
    ])
    .code(4)
    .expect_stderr(&["INVALID", "no events"]);
}

#[test]
fn a_session_whose_clocks_are_beyond_a_limit_is_invalid_everywhere() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    let good = skinrig(&["analyze", &session, "--json"]).code(0).json();
    assert_eq!(good["valid"], true);
    let certificate = &good["analysis"]["alignment"];
    assert_eq!(certificate["status"], "valid", "{certificate:#}");
    assert_eq!(certificate["lines"][1]["lost"], 0);
    assert_eq!(good["analysis"]["clocks"][0]["method"], "time_base");

    let strict = "analysis.alignment.max_camera_interval=0.5us";
    let result = skinrig(&["analyze", &session, "--json", "--set", strict]).code(4);
    let document = result.json();
    assert_eq!(document["valid"], false);
    assert_eq!(document["analysis"]["alignment"]["status"], "invalid");
    result.expect_stderr(&["INVALID", "camera 1 from box", "at most 0.5 µs", "next:"]);
    let shown = skinrig(&["analyze", &session, "--set", strict]).code(4).out;
    assert!(
        shown.starts_with("INVALID   use no number of this session"),
        "{shown}"
    );
    let variant = ".analysis-alignment.max_camera_interval=0.5us.report.html";
    let page = std::fs::read_to_string(only(&lab.path("s"), variant)).unwrap();
    assert!(page.contains("data-testid=\"invalid\""));
    skinrig(&["tradeoff", &session, "--set", strict])
        .code(4)
        .expect_stderr(&["INVALID"]);
    let digits = skinrig(&["analyze", &session, "--set", strict, "--digits=2"])
        .code(4)
        .expect_stderr(&["INVALID: its numbers have no true digits"]);
    assert!(!digits.out.contains("true digits"), "{digits:?}");

    let invalid = text(&lab.record("t", &["--set", strict]));
    let out = lab.text("x");
    let export = [
        "export", &invalid, "--to", "csv", "--only", "results", "--out", &out,
    ];
    skinrig(&export)
        .code(4)
        .expect_stderr(&["INVALID, do not use the exported numbers", "next:"]);
    let table = std::fs::read_to_string(only(&lab.path("x"), ".results.csv")).unwrap();
    let valid: Vec<&str> = table.lines().filter_map(|l| l.rsplit(',').next()).collect();
    assert!(valid[0] == "valid" && valid.len() > 2, "{table}");
    assert!(valid[1..].iter().all(|v| *v == "0"), "{table}");
    skinrig(&["online", &invalid])
        .code(4)
        .expect_stderr(&["expected a valid session, found an INVALID one", "next:"]);
    skinrig(&[
        "export",
        &invalid,
        "--to",
        "bundle",
        "--out",
        &lab.text("b"),
    ])
    .code(4)
    .expect_stderr(&["INVALID, do not use the exported numbers", "next:"]);
    skinrig(&["verify", &lab.text("b")]).code(0);
    let plan = skinrig(&["plan", "--from", &invalid, "--detect", "1 mm"]).code(4);
    assert!(
        plan.out.is_empty() && plan.err.contains("INVALID"),
        "{plan:?}"
    );
}

/// Nothing located is no result.
#[test]
fn a_session_in_which_no_press_counts_is_invalid() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    let all = "analysis.exclude_press_numbers=[3, 4, 5, 6, 7, 8, 9, 10]";
    let none = skinrig(&["analyze", &session, "--json", "--set", all]).code(4);
    assert_eq!(none.json()["valid"], false);
    let document = none.json();
    let warnings = document["analysis"]["warnings"].as_array().unwrap();
    let nothing = warnings.iter().find(|w| w["kind"] == "nothing_counts");
    assert_eq!(nothing.unwrap()["excluded"], 8, "{warnings:#?}");
    none.expect_stderr(&[
        "expected at least one of 8 presses to count, found none",
        "next:",
    ]);
    let reason = "expected at least one of 8 presses to count";
    for more in [&[][..], &["-v"]] {
        let arguments = [&["analyze", &session, "--set", all][..], more].concat();
        let printed = skinrig(&arguments).code(4).out;
        let mut lines = printed.lines().filter(|line| line.contains(reason));
        let (line, next) = (lines.next().unwrap_or_default(), lines.next());
        assert!(line.starts_with("INVALID") && next.is_none(), "{printed}");
    }
    for (wrong, part) in [("[11]", "which has 10"), ("[1]", "never score")] {
        let set = format!("analysis.exclude_press_numbers={wrong}");
        skinrig(&["analyze", &session, "--set", &set])
            .code(2)
            .expect_stderr(&["exclude_press_numbers", part]);
    }
    let one = "analysis.exclude_press_numbers=[4, 5, 6, 7, 8, 9, 10]";
    skinrig(&["analyze", &session, "--set", one]).code(0);
}

#[test]
fn a_folder_that_cannot_be_written_ends_with_code_1_and_a_next_step() {
    let lab = Lab::new();
    let file = lab.path("a-file");
    std::fs::write(&file, "").unwrap();
    for folder in [text(&file), format!("{}/below", text(&file))] {
        skinrig(&["run", SMALL, "--sessions", &folder])
            .code(1)
            .expect_stderr(&["next:", "--sessions"]);
    }
    let locked = lab.path("locked");
    std::fs::create_dir(&locked).unwrap();
    let mut permissions = std::fs::metadata(&locked).unwrap().permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&locked, permissions).unwrap();
    // Root can write to any folder without permissions, but not to a kernel file system.
    let kernel = Path::new("/sys/kernel").to_owned();
    let refusing = [locked, kernel]
        .into_iter()
        .find(|folder| folder.is_dir() && std::fs::write(folder.join("probe"), "").is_err());
    let Some(folder) = refusing else {
        eprintln!("skipped: expected a folder that this user cannot write into");
        return;
    };
    skinrig(&["run", SMALL, "--sessions", &text(&folder)])
        .code(1)
        .expect_stderr(&["next:", "--sessions"]);
}

/// Before the minutes of an analysis, not after them.
#[test]
fn results_that_cannot_be_written_are_refused_before_they_are_computed() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    let out = lab.text("none/results.json");
    for command in ["analyze", "tradeoff"] {
        let refused = skinrig(&[command, &session, "--out", &out, "--json"]).code(1);
        assert!(
            refused.err.contains("next: create its folder"),
            "{refused:?}"
        );
        assert!(!refused.err.contains("reading"), "{refused:?}");
    }
}

#[test]
fn sessions_that_start_in_the_same_second_get_files_of_their_own() {
    let lab = Lab::new();
    let sessions = lab.text("s");
    let arguments = ["run", SMALL, "--sessions", &sessions, "--no-analysis"];
    let children: Vec<_> = (0..6)
        .map(|_| {
            let mut command = program(&arguments);
            command.stdout(Stdio::piped()).stderr(Stdio::piped());
            command.spawn().unwrap()
        })
        .collect();
    for child in children {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{output:?}");
    }
    let found = files(&lab.path("s"), ".session.sqlite");
    assert_eq!(found.len(), 6, "{found:?}");
    let ids: BTreeSet<String> = found.iter().map(|s| show(s)["id"].to_string()).collect();
    assert_eq!(ids.len(), 6);
    for session in found {
        skinrig(&["verify", &text(&session)]).code(0);
    }
}

#[test]
fn digits_are_printed_below_the_answer_and_listed_in_json() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    let shown = skinrig(&["analyze", &session, "--digits=2"]).code(0).out;
    for expected in ["true digits", "fewest digits", "2 repetitions"] {
        assert!(shown.contains(expected), "{shown}");
    }
    let json = skinrig(&["--json", "analyze", &session, "--digits=2"])
        .code(0)
        .out;
    let document: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(document["digits"]["repetitions"], 2);
    let figures = document["digits"]["figures"].as_array().unwrap();
    assert!(figures.len() > 100, "{}", figures.len());
    skinrig(&["analyze", &session, "--digits=0"]).code(2);
}

/// SQLite takes text alone.
#[test]
fn a_folder_whose_name_is_no_text_needs_another_name() {
    use std::ffi::{OsStr, OsString};
    use std::os::unix::ffi::OsStrExt;
    let lab = Lab::new();
    let folder = lab.path("").join(OsStr::from_bytes(b"bad\xff"));
    let arguments = ["run", SMALL, "--sessions"].map(OsString::from);
    let arguments = [&arguments[..], &[folder.into_os_string()]].concat();
    skinrig(&arguments)
        .code(1)
        .expect_stderr(&["next: choose a folder whose path is UTF-8 text with --sessions"]);
}
