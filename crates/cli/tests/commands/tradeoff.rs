//! Trade-off of speed and accuracy: the printed lines select the measured settings.

use serde_json::Value;

use crate::support::{Lab, only, program, skinrig, text};

/// Nine places: a third of them chooses, the others confirm.
const PLACES: &str = "path.points=[[10 mm, 2 mm], [-10 mm, 18 mm], [0 mm, -18 mm], [25 mm, 17 mm], [10 mm, 20 mm], \
                      [-10 mm, 2 mm], [20 mm, -8 mm], [0 mm, 8 mm], [15 mm, 10 mm]]";

/// Records a campaign whose first repetition calibrates.
fn session(lab: &Lab) -> String {
    text(&lab.record(
        "s",
        &[
            "--set",
            PLACES,
            "--set",
            "evaluation.calibrate=[1]",
            "--set",
            "evaluation.score=[2]",
            "--set",
            "analysis.calibration=positions",
            "--set",
            "analysis.bootstrap_resamples=50",
        ],
    ))
}

#[test]
fn the_printed_lines_select_what_was_measured_to_the_last_bit() {
    let lab = Lab::new();
    let session = session(&lab);
    let arguments = [
        "--json",
        "tradeoff",
        &session,
        "--repeats",
        "1",
        "--budget",
        "10s",
        "--pixels",
        "64x48",
    ];
    let output = skinrig(&arguments).code(0).json();
    let rows = output["tradeoff"]["rows"].as_array().unwrap();
    assert!(rows.len() > 60, "{}", rows.len());
    // The session's own settings, and a choice with every kind of change.
    let expected = |key: &str| {
        let has = |row: &&Value| row["overrides"].to_string().contains(key);
        rows.iter()
            .find(has)
            .unwrap_or_else(|| panic!("no row with {key}"))
    };
    let keys = [
        "estimator",
        "precision",
        "thinning",
        "bin",
        "window_after_contact",
        "crop",
    ];
    for row in std::iter::once(&rows[0]).chain(keys.map(expected).iter().copied()) {
        let out = lab.text("one.json");
        let mut arguments = vec![
            "--json".to_owned(),
            "analyze".into(),
            session.clone(),
            "--out".into(),
            out,
        ];
        for pair in row["overrides"].as_array().unwrap() {
            let (key, value) = (pair[0].as_str().unwrap(), pair[1].as_str().unwrap());
            arguments.extend(["--set".to_owned(), format!("{key}={value}")]);
        }
        // With a choice that leaves no press, the session is INVALID.
        let code = if row["rmse_mm"]["value"].is_null() {
            4
        } else {
            0
        };
        let analysis = &skinrig(&arguments).code(code).json()["analysis"];
        assert_eq!(
            analysis["scored"]["rmse_mm"], row["rmse_mm"],
            "{}",
            row["overrides"]
        );
        assert_eq!(
            analysis["scored"]["located_rate"], row["located_rate"],
            "{}",
            row["overrides"]
        );
    }
    assert!(output["answers"][0]["row"]["cpu_us"].as_f64().unwrap() > 0.0);
    assert_eq!(output["answers"][0]["confirmed_mm"]["n"], 6);
    let coarse = &output["answers"][1]["row"];
    assert!(coarse["pixels"].as_u64().unwrap() <= 64 * 48, "{coarse}");
    assert!(
        coarse["overrides"].to_string().contains("analysis.bin"),
        "{coarse}"
    );
    let machine = &output["machine"];
    assert_eq!(machine["architecture"], std::env::consts::ARCH);
    assert!(machine["threads"].as_u64() >= Some(1), "{machine}");
    let page = std::fs::read_to_string(output["files"]["page"].as_str().unwrap()).unwrap();
    assert!(page.contains("<svg") && page.contains("</html>"), "{page}");
}

#[test]
fn a_grid_is_two_numbers_of_pixels() {
    for wrong in ["64", "64x", "0x48", "64x48x2", "64x48.5", "1e3x4"] {
        let refused = skinrig(&["tradeoff", "none.session.sqlite", "--pixels", wrong]).code(2);
        refused.expect_stderr(&[
            "expected WIDTHxHEIGHT in pixels, for example `64x48`",
            wrong,
        ]);
    }
}

/// Values that could mean two things, and options without the one that they belong to.
#[test]
fn an_ambiguous_or_unused_option_is_refused() {
    let tradeoff = |more: &[&str]| {
        let words = [&["tradeoff", "none.session.sqlite"], more].concat();
        skinrig(&words).code(2).err
    };
    let share = tradeoff(&["--min-located", "0.99"]);
    assert!(share.contains("write `99%` or `0.99%`"), "{share}");
    let cost = tradeoff(&["--cost", "delay"]);
    assert!(cost.contains("--target-rmse <LENGTH>"), "{cost}");
    // The tip works.
    let negative = tradeoff(&["--target-rmse", "-1mm"]);
    let tip = "tip: a value that starts with `-` follows `=`: `--target-rmse=-1mm`";
    assert!(negative.contains(tip), "{negative}");
    let negative = tradeoff(&["--target-rmse=-1mm"]);
    assert!(
        negative.contains("expected a length") && negative.contains("-1mm"),
        "{negative}"
    );
}

/// Nothing tells which part of the rows the touches are in.
#[test]
fn without_calibration_presses_no_part_of_the_rows_is_offered() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &["--set", PLACES]));
    let output = skinrig(&["--json", "tradeoff", &session, "--repeats", "1"]);
    let output = output.code(0).json();
    let rows = output["tradeoff"]["rows"].as_array().unwrap();
    assert!(rows.len() > 40, "{}", rows.len());
    let parts = rows.iter().filter(|row| row["choice"]["region"] != "full");
    assert_eq!(parts.count(), 0);
    assert_eq!(output["tradeoff"]["predictions"]["combinations"], 6930 / 3);
}

#[test]
fn an_unmet_demand_exits_with_code_4_and_tables_fit_the_terminal() {
    let lab = Lab::new();
    let session = session(&lab);
    let output = skinrig(&[
        "tradeoff",
        &session,
        "--repeats",
        "1",
        "--target-rmse",
        "1 um",
        "-v",
    ])
    .code(4)
    .expect_stderr(&["--full"]);
    assert!(
        output.out.lines().all(|l| l.chars().count() <= 100),
        "{}",
        output.out
    );
    assert!(output.out.contains("streaming f32"), "{}", output.out);
    // The answer comes before the table.
    let answer = output.out.find("none: the first in rank has RMSE").unwrap();
    assert!(answer < output.out.find("choices tried on").unwrap());
    let budget = ["tradeoff", &session, "--repeats", "1", "--budget", "10s"];
    let met = skinrig(&budget).code(0).out;
    assert!(
        met.lines().count() <= 20 && !met.contains("choices tried on"),
        "{met}"
    );
    let mut lines = met.lines();
    assert!(
        lines.next().unwrap().starts_with("most accurate within"),
        "{met}"
    );
    let chosen: String = lines.take(2).collect();
    for part in [
        ": RMSE ",
        " mm, 95 % interval [",
        ", n 6 that did not choose",
        " ms of CPU time",
    ] {
        assert!(chosen.contains(part), "{part}: {chosen}");
    }
    skinrig(&["tradeoff", &session, "--budget", "5 mm"])
        .code(2)
        .expect_stderr(&["time"]);
}

#[test]
fn a_trade_of_other_settings_leaves_that_of_the_session_alone() {
    let lab = Lab::new();
    let session = session(&lab);
    let trade = |more: &[&str]| {
        let common = ["--json", "tradeoff", &session, "--repeats", "1"];
        skinrig(&[&common[..], more].concat())
    };
    let own = trade(&[]).code(0).json();
    let page = own["files"]["page"].as_str().unwrap().to_owned();
    let before = std::fs::read(&page).unwrap();
    let set = ["--set", "analysis.estimator=column_median"];
    let other = trade(&[&set[..], &["--budget", "10s"]].concat())
        .code(0)
        .json();
    let lines = other["answers"][0]["protocol"].as_str().unwrap();
    let expected = "# on top of analysis.estimator=column_median\nanalysis:\n";
    assert!(lines.starts_with(expected), "{lines}");
    assert_ne!(other["files"]["page"], own["files"]["page"]);
    assert_eq!(
        other["variant"]["changed"][0],
        "analysis.estimator=column_median"
    );
    let output = std::fs::read_to_string(other["files"]["page"].as_str().unwrap()).unwrap();
    assert!(
        output.contains("Not the session&#39;s own settings: analysis.estimator=column_median"),
        "{output}"
    );
    // Beside another session it is not that of the session.
    let stranger = text(&lab.record("t", &["--seed", "8"]));
    let json = own["files"]["results"].as_str().unwrap();
    let beside = stranger.replace(".session.sqlite", ".tradeoff.json");
    std::fs::copy(json, beside).unwrap();
    skinrig(&["report", &stranger]).code(0);
    let report = std::fs::read_to_string(only(&lab.path("t"), ".report.html")).unwrap();
    assert!(!report.contains("Error against cost"));
    assert!(report.contains("found that of another one"), "no reason");
    // Nor is it with an edited figure.
    let edited = std::fs::read_to_string(json).unwrap();
    let edited = edited.replacen("\"value\": ", "\"value\": 1", 1);
    std::fs::write(json, edited).unwrap();
    skinrig(&["report", &session]).code(0);
    let report = std::fs::read_to_string(only(&lab.path("s"), ".report.html")).unwrap();
    assert!(
        report.contains("found that of another content"),
        "no reason"
    );
    trade(&[&set[..], &["--out", &page]].concat())
        .code(2)
        .expect_stderr(&["--out"]);
    assert_eq!(std::fs::read(&page).unwrap(), before);
}

#[test]
#[cfg(unix)]
fn ctrl_c_leaves_with_the_best_so_far() {
    use std::io::{BufRead, BufReader, Read};
    use std::process::{Command, Stdio};
    let lab = Lab::new();
    let session = session(&lab);
    let mut command = program(&["tradeoff", &session, "--full", "--budget", "10s"]);
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut messages = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.contains("ctrl-C leaves") {
        line.clear();
        assert!(messages.read_line(&mut line).unwrap() > 0);
    }
    let id = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert!(sent.success());
    let mut rest = String::new();
    messages.read_to_string(&mut rest).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(5), "{rest}");
    assert!(rest.contains("INTERRUPTED after "), "{rest}");
    assert!(
        rest.contains(" of 6930 choices: the answer is the best so far"),
        "{rest}"
    );
    let printed = String::from_utf8(output.stdout).unwrap();
    assert!(printed.starts_with("most accurate within"), "{printed}");
    assert!(printed.contains("n 6 that did not choose"), "{printed}");
    let page = printed.lines().find_map(|l| l.strip_prefix("page     "));
    let page = std::fs::read_to_string(page.unwrap()).unwrap();
    assert!(page.contains("INTERRUPTED.") && page.contains(" of 6930 choices were tried"));
}

#[test]
fn random_combinations_check_the_predictions() {
    let lab = Lab::new();
    let session = session(&lab);
    let common = ["tradeoff", &session, "--repeats", "1", "--check", "3"];
    let output = skinrig(&[&["--json"], &common[..]].concat()).code(0).json();
    let of = output["tradeoff"]["predictions"]["of"].as_array().unwrap();
    let checks = of.iter().filter(|p| p["is_check"] == true).count();
    assert!(checks == 3 || of.is_empty(), "{of:?}");
    assert_eq!(output["tradeoff"]["predictions"]["combinations"], 6930);
    let printed = skinrig(&common).code(0).out;
    let says = ["checked on 3 random combinations", "no prediction to check"];
    assert!(says.iter().any(|s| printed.starts_with(s)), "{printed}");
    skinrig(&["tradeoff", &session, "--full", "--check", "3"]).code(2);
}
