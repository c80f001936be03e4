//! Comparing skins: no difference between two sessions of one skin, rejected comparisons, and a stable output format.

use serde_json::Value;

use crate::json::shape;
use crate::support::{Lab, SMALL, files, only, show, skinrig, text, write_results};

/// Records a small session of a skin and returns its path.
fn record(lab: &Lab, folder: &str, seed: &str, more: &[&str]) -> String {
    let mut arguments = vec!["--seed", seed, "--set", "analysis.bootstrap_resamples=50"];
    arguments.extend_from_slice(more);
    text(&lab.record(folder, &arguments))
}

fn row<'a>(document: &'a Value, metric: &str) -> &'a Value {
    let rows = document["table"].as_array().unwrap();
    rows.iter().find(|r| r["metric"] == metric).unwrap()
}

/// The table of a comparison, which is the same as long as the results are.
fn table(a: &str, b: &str) -> Value {
    let compared = skinrig(&["--json", "compare", a, b, "--margin", "rmse=8 mm"]);
    compared.code(0).json()["table"].clone()
}

/// Lists read the summary alone, which no hash of the results covers.
#[test]
fn a_summary_that_was_edited_is_not_listed() {
    let lab = Lab::new();
    let session = record(&lab, "a", "1", &[]);
    skinrig(&["analyze", &session]).code(0);
    let rmse = || show(session.as_ref())["analyses"][0]["rmse_mm"]["value"].clone();
    let measured = rmse().as_f64().unwrap();
    let path = only(&lab.path("a"), ".results.json");
    let text = std::fs::read_to_string(&path).unwrap();
    let (head, summary) = text.rsplit_once("\n  \"summary\": ").unwrap();
    let better = summary.replace(&measured.to_string(), "0.125");
    assert_ne!(better, summary);
    std::fs::write(&path, format!("{head}\n  \"summary\": {better}")).unwrap();
    assert_eq!(rmse(), Value::Null);
    for list in [&["show", &session][..], &["sessions", &lab.text("a")]] {
        let listed = skinrig(list).code(0).out;
        assert!(
            !listed.contains("0.12") && !listed.contains("0.13"),
            "{listed}"
        );
    }
    let shown = skinrig(&["show", &session]).out;
    let shown = shown.split_whitespace().collect::<Vec<_>>().join(" ");
    let expected = "the results were changed after they were written: analyze the session again";
    assert!(shown.contains(expected), "{shown}");
}

#[test]
fn results_that_were_edited_or_are_older_than_their_session_are_not_used() {
    let lab = Lab::new();
    let (a, b) = (record(&lab, "a", "1", &[]), record(&lab, "b", "2", &[]));
    skinrig(&["analyze", &b]).code(0);
    let before = table(&a, &b);
    let path = only(&lab.path("b"), ".results.json");
    let text = std::fs::read_to_string(&path).unwrap();
    let edited = |change: &dyn Fn(&mut Value)| {
        let mut document: Value = serde_json::from_str(&text).unwrap();
        change(&mut document);
        write_results(&path, document);
    };
    let moved: &dyn Fn(&mut Value) = &|document| {
        for press in document["analysis"]["presses"].as_array_mut().unwrap() {
            let truth = &mut press["truth"]["x_mm"];
            *truth = Value::from(truth.as_f64().unwrap() + 2.0);
        }
    };
    edited(moved);
    assert_eq!(table(&a, &b), before);
    edited(&|document| {
        for onset in document["analysis"]["latency"]["onsets"]
            .as_array_mut()
            .unwrap()
        {
            onset[1] = Value::from(1.0);
        }
    });
    assert_eq!(table(&a, &b), before);
    edited(&|document| {
        moved(document);
        document["provenance"]["content_sha256"] = Value::from("0".repeat(64));
        document["summary"]["content_sha256"] = Value::from("0".repeat(64));
    });
    assert_eq!(table(&a, &b), before);
    // What makes a session INVALID stays.
    let strict = "analysis.alignment.max_camera_interval=0.5us";
    let invalid = record(&lab, "i", "3", &["--set", strict]);
    skinrig(&["analyze", &invalid]).code(4);
    let path = only(&lab.path("i"), ".results.json");
    let mut document = crate::support::read_json(&path);
    let alignment = &mut document["analysis"]["alignment"];
    alignment["status"] = Value::from("valid");
    alignment["violations"] = Value::Array(Vec::new());
    write_results(&path, document);
    skinrig(&["compare", &a, &invalid])
        .code(2)
        .expect_stderr(&["a session is INVALID"]);

    let listed = skinrig(&["prototypes", &lab.text("b")]).code(0).out;
    assert!(!listed.contains("RMSE 2"), "{listed}");
}

#[test]
fn sides_of_two_skins_and_of_other_depth_shares_and_planted_faults_are_refused() {
    let lab = Lab::new();
    let a = record(&lab, "a", "1", &[]);
    let add = |folder: &str, seed: &str, set: &str| {
        let folder = lab.text(folder);
        let run = [
            "run",
            SMALL,
            "--sessions",
            &folder,
            "--no-analysis",
            "--seed",
            seed,
        ];
        skinrig(&[&run[..], &["--set", set]].concat()).code(0);
    };
    add("mixed", "2", "prototype.id=one");
    add("mixed", "3", "prototype.id=two");
    skinrig(&["compare", &a, &lab.text("mixed")])
        .code(2)
        .expect_stderr(&["several prototypes", "--despite prototypes"]);

    for (folder, depths) in [
        ("deep", ["1.5 mm", "1.5 mm", "1 mm"]),
        ("flat", ["1.5 mm", "1 mm", "1 mm"]),
    ] {
        for (seed, depth) in (1..).zip(depths) {
            let depth = format!("depth={depth}");
            add(folder, &format!("{seed}"), &depth);
        }
    }
    skinrig(&["compare", &lab.text("deep"), &lab.text("flat")])
        .code(2)
        .expect_stderr(&[
            "presses by depth",
            "67 % at 1.5 mm",
            "--despite depth-shares",
        ]);

    // The second round leaves out three of four locations on one side.
    let b = record(&lab, "b", "6", &[]);
    let easy = lab.text("easy.selection.yaml");
    let select = [
        "select",
        &b,
        "--name",
        "easy",
        "--exclude",
        "8-10=unlucky",
        "--decided-by",
        "A. Person",
        "--out",
        &easy,
    ];
    skinrig(&select).code(0);
    skinrig(&["compare", &a, &easy]).code(2).expect_stderr(&[
        "presses by location",
        "1 to 2 presses at each of 4 locations",
        "--despite location-shares",
    ]);

    let fault = ["--fault", "robot-z-high@contact:3"];
    let (c, d) = (
        record(&lab, "c", "4", &fault),
        record(&lab, "d", "5", &fault),
    );
    skinrig(&["compare", &c, &d])
        .code(2)
        .expect_stderr(&["a fault was injected", "--despite planted-fault"]);
}

#[test]
fn comparing_a_skin_with_itself_finds_no_difference_and_a_complete_page() {
    let lab = Lab::new();
    let a = record(&lab, "a", "1", &[]);
    let b = record(&lab, "b", "2", &[]);
    let out = lab.text("page/c.html");
    std::fs::create_dir(lab.path("page")).unwrap();
    let limits = "protocols/comparison.limits.yaml";
    let arguments = [
        "compare",
        &a,
        &b,
        "--limits",
        limits,
        "--margin",
        "rmse=8 mm",
        "--out",
        &out,
    ];
    let output = skinrig(&arguments).code(0);
    assert!(
        output.out.lines().all(|l| l.chars().count() <= 80),
        "{}",
        output.out
    );
    let verdict = output.out.lines().next().unwrap();
    assert!(verdict.starts_with("VERDICT   B against A: "), "{verdict}");
    // Numbers and names differ between runs; the layout does not.
    let layout: String = output
        .out
        .lines()
        .skip_while(|l| !l.starts_with("B against"))
        .collect::<Vec<_>>()
        .join("\n");
    let layout: Vec<&str> = layout
        .lines()
        .map(|l| l.get(..26).unwrap_or(l).trim_end())
        .collect();
    let end = layout.iter().position(|l| l.is_empty()).unwrap();
    insta::assert_snapshot!("compare_table", layout[..end].join("\n"));
    let document = crate::support::read_json(&lab.path("page/c.json"));
    insta::assert_snapshot!("compare", shape_without_facts(document.clone()));
    let rmse = row(&document, "rmse");
    assert_eq!(rmse["margin"], 8.0, "the command line goes before the file");
    assert_eq!(rmse["against_first"][0]["verdict"], "equivalent", "{rmse}");
    assert_eq!(row(&document, "taxels")["margin"], 50.0);
    assert_eq!(document["locations"].as_array().unwrap().len(), 4);
    let page = std::fs::read_to_string(&out).unwrap();
    for part in [
        "figure-maps-1",
        "figure-margins-1",
        "figure-causes-1",
        "data-testid=\"simulated\"",
        "</html>",
    ] {
        assert!(page.contains(part), "{part} is missing");
    }
    assert!(
        !page.contains("http://") || !page.contains("src=\"http"),
        "loads something"
    );
}

/// Keys of the document, with each session's facts reduced to a placeholder.
fn shape_without_facts(mut document: Value) -> String {
    for skin in document["skins"].as_array_mut().unwrap() {
        for session in skin["sessions"].as_array_mut().unwrap() {
            session["values"] = Value::from(session["values"].as_object().unwrap().len());
        }
    }
    shape(&document)
}

/// Two repetitions of each: two looks.
#[test]
fn a_sequential_comparison_looks_after_each_repetition() {
    let lab = Lab::new();
    let a = record(&lab, "a", "1", &[]);
    let b = record(&lab, "b", "2", &[]);
    let output = skinrig(&["compare", &a, &b, "--sequential"]).code(0);
    assert!(output.out.contains("LOOKS     not yet: "), "{output:?}");
    assert!(output.out.contains("99.17 % interval"), "{output:?}");
    let json = skinrig(&["--json", "compare", &a, &b, "--sequential", "--looks", "2"])
        .code(0)
        .json();
    let looks = json["sequential"]["looks"].as_array().unwrap();
    assert_eq!(looks.len(), 2);
    assert!(looks[1]["presses"][0].as_u64() > looks[0]["presses"][0].as_u64());
    assert_eq!(json["skins"][0]["attempted"], 8);
    assert_eq!(looks[1]["spent"], 0.05);
    assert_eq!(json["sequential"]["outlook"]["status"], "spent");
    assert_eq!(json["settings"]["alpha"], 0.025);
    // The skin with fewer repetitions decides how many looks there are.
    let short = record(
        &lab,
        "c",
        "3",
        &[
            "--set",
            "repetitions.count=1",
            "--set",
            "evaluation.score=[1]",
        ],
    );
    let json = skinrig(&["--json", "compare", &a, &short, "--sequential"])
        .code(0)
        .json();
    assert_eq!(json["sequential"]["complete"], serde_json::json!([2, 1]));
    assert_eq!(json["skins"][0]["attempted"], 4);
    skinrig(&["compare", &a, &b, &short, "--sequential"])
        .code(2)
        .expect_stderr(&["--sequential: expected 2 skins, found 3"]);
    skinrig(&["compare", &a, &b, "--looks", "2"])
        .code(2)
        .expect_stderr(&["--sequential"]);
}

#[test]
fn what_may_not_be_compared_is_refused_and_can_be_lifted_by_name() {
    let lab = Lab::new();
    let a = record(&lab, "a", "1", &[]);
    let deeper = record(&lab, "b", "2", &["--set", "depth=1 mm"]);
    let refused = skinrig(&["compare", &a, &deeper]).code(2);
    assert!(
        refused.out.contains("BLOCKING") && !refused.out.contains("RMSE"),
        "{refused:?}"
    );
    let refused = refused.expect_stderr(&[
        "depths",
        "no depth is shared",
        "press both skins to the same",
    ]);
    // Nothing would be left to compare.
    assert!(!refused.err.contains("--despite"), "{refused:?}");
    skinrig(&["compare", &a, &deeper, "--despite", "depths"])
        .code(2)
        .expect_stderr(&["depths", "no depth is shared"]);
    assert!(
        files(&lab.path("a"), ".html").is_empty(),
        "a page of what may not be compared"
    );
    let json = skinrig(&["--json", "compare", &a, &deeper]).code(2).json();
    assert_eq!(json["blocked"], true);
    assert_eq!(json["table"].as_array().unwrap().len(), 0);
    let same = skinrig(&["compare", &a, &a]).code(2);
    same.expect_stderr(&["same-session", "is on both sides"]);
    let lifted = skinrig(&["compare", &a, &a, "--despite", "same-session"]).code(0);
    assert!(lifted.out.contains("despite   session"), "{lifted:?}");
    let page = std::fs::read_to_string(only(&lab.path("a"), "comparison.html")).unwrap();
    assert!(
        page.contains("data-testid=\"despite\""),
        "not on the first screen"
    );
    // A simulation repeated with its seed is no second session of the skin.
    let repeated = record(&lab, "again", "1", &[]);
    std::fs::copy(repeated, lab.path("a/again.session.sqlite")).unwrap();
    let other = record(&lab, "d", "4", &[]);
    skinrig(&["compare", &lab.text("a"), &other])
        .code(2)
        .expect_stderr(&["same-session", "simulated twice", "is twice on one side"]);
    let other_level = record(&lab, "c", "3", &["--level", "kinematic"]);
    skinrig(&["compare", &a, &other_level])
        .code(2)
        .expect_stderr(&["simulation level", "sim-level", "scored presses that count"]);
}

/// The skins have other locations besides: their numbers of presses say nothing of what is compared.
#[test]
fn the_number_of_shared_locations_is_told() {
    let lab = Lab::new();
    let a = record(&lab, "a", "1", &[]);
    let places = "path.points=[[10 mm, 2 mm], [-10 mm, 18 mm], [2 mm, -16 mm], [23 mm, 15 mm]]";
    let b = record(&lab, "b", "2", &["--set", places]);
    let told = skinrig(&["compare", &a, &b]).code(0);
    let shared = "compared  only 2 shared locations: ";
    assert!(told.out.contains(shared), "{told:#?}");
    let same = skinrig(&["compare", &a, &a, "--despite", "same-session"]);
    assert!(!same.out.contains("compared  "), "{same:#?}");
}

#[test]
fn other_places_are_blocking_and_then_independent() {
    let lab = Lab::new();
    let a = record(&lab, "a", "1", &[]);
    let places = "path.points=[[12 mm, 4 mm], [-8 mm, 20 mm], [2 mm, -16 mm], [23 mm, 15 mm]]";
    let b = record(&lab, "b", "2", &["--set", places]);
    skinrig(&["compare", &a, &b])
        .code(2)
        .expect_stderr(&["fewer than two locations are shared", "--despite locations"]);
    let json = skinrig(&["--json", "compare", &a, &b, "--despite", "locations"])
        .code(0)
        .json();
    assert_eq!(json["settings"]["pairing"], "independent");
    assert!(row(&json, "rmse")["against_first"][0]["comparison"].is_object());
    assert!(
        json["causes"][0].is_null(),
        "nothing is shared to take apart"
    );
}

#[test]
fn invalid_arguments_are_refused_with_help() {
    let lab = Lab::new();
    let a = record(&lab, "a", "1", &[]);
    let wrong = lab.path("limits.yaml");
    std::fs::write(
        &wrong,
        "skinrig_limits: 1\nname: x\nmargins: {rsme: 1 mm}\n",
    )
    .unwrap();
    for (arguments, parts) in [
        (vec![a.as_str()], vec!["2", "SKIN"]),
        (
            vec![&a, "README.md"],
            vec!["README.md", "expected a skinrig session"],
        ),
        (
            vec![&a, "no such skin", "--sessions", "docs"],
            vec!["no such skin", "--sessions"],
        ),
        (
            vec![&a, "no/such.session.sqlite"],
            vec!["no/such.session.sqlite", "skinrig sessions"],
        ),
        (
            vec![&a, &a, "--margin", "rmse=1"],
            vec!["the bare number `1`"],
        ),
        (
            vec![&a, &a, "--margin", "rsme=1mm"],
            vec!["did you mean `rmse`?"],
        ),
        (
            vec![&a, &a, "--limits", wrong.to_str().unwrap()],
            vec!["limits.yaml:3", "did you mean `rmse`?"],
        ),
        (
            vec![&a, &a, "--limits", "no/limits.yaml"],
            vec!["no/limits.yaml", "cannot read"],
        ),
    ] {
        let all: Vec<&str> = std::iter::once("compare").chain(arguments).collect();
        skinrig(&all).code(2).expect_stderr(&parts);
    }
}

/// A calibration from fewer presses is worse, which is not the skin's fault.
#[test]
fn sides_that_other_presses_calibrate_are_confounded() {
    let lab = Lab::new();
    let run = |folder: &str, seed: &str, more: &[&str]| {
        let sessions = lab.text(folder);
        let mut arguments = vec!["run", "protocols/comparison.yaml", "--sessions", &sessions];
        arguments.extend(["--seed", seed, "--level", "geometric"]);
        for size in ["columns=3", "rows=3", "pitch=20 mm"] {
            arguments.extend(["--set", ["path.meander.", size].concat().leak()]);
        }
        arguments.extend([
            "--set",
            "repetitions.count=2",
            "--set",
            "evaluation.score=[2]",
        ]);
        arguments.extend_from_slice(more);
        skinrig(&arguments).code(0);
        text(&only(&lab.path(folder), ".session.sqlite"))
    };
    let all = run("all", "1", &[]);
    let few = run("few", "2", &["--set", "calibrate_at.locations=5"]);
    let again = run("again", "3", &[]);
    let differences = |b: &str| {
        let compared = skinrig(&["--json", "compare", &all, b, "--margin", "rmse=8 mm"]);
        let differences = compared.json()["differences"].clone();
        let all = differences.as_array().unwrap().clone();
        let calibrate = all
            .into_iter()
            .filter(|d| d["what"] == "presses that calibrate");
        calibrate.collect::<Vec<_>>()
    };
    assert_eq!(differences(&again), Vec::<Value>::new());
    let found = differences(&few);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(
        (&found[0]["weight"], &found[0]["key"]),
        (&Value::from("confounding"), &Value::from("evaluation"))
    );
    let values = [
        "9 at 9 locations, those of 100 % of the scored presses",
        "5 at 5 locations, those of 56 % of the scored presses",
    ];
    assert_eq!(found[0]["values"], serde_json::json!(values));
}
