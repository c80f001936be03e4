//! A challenge from a session to a score, and the tables that it refuses.

use std::fs::read_to_string;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::support::{Lab, SMALL, only, read_json, skinrig, text};

/// A challenge of four calibrating and four scored presses.
struct Challenge {
    lab: Lab,
    folder: PathBuf,
    answers: PathBuf,
    session: PathBuf,
}

impl Challenge {
    fn new() -> Self {
        let lab = Lab::new();
        let more = [
            "--set",
            "evaluation.calibrate=[1]",
            "--set",
            "evaluation.score=[2]",
            "--set",
            "analysis.bootstrap_resamples=50",
        ];
        let session = lab.record("s", &more);
        let folder = lab.path("challenge");
        let command = [
            "challenge",
            "make",
            &text(&session),
            "--out",
            &text(&folder),
            "--json",
        ];
        let output = skinrig(&command).code(0).json();
        assert_eq!(
            (&output["calibrating"], &output["scored"]),
            (&4.into(), &4.into())
        );
        let answers = PathBuf::from(output["answers"].as_str().unwrap());
        assert_eq!(answers.parent(), session.parent());
        Self {
            lab,
            folder,
            answers,
            session,
        }
    }

    /// The answers: (press, x, y).
    fn truths(&self) -> Vec<(u64, f64, f64)> {
        let all = read_json(&self.answers);
        let number = |p: &Value, name: &str| p[name].as_f64().unwrap();
        let presses = all["presses"].as_array().unwrap().iter();
        presses
            .map(|p| {
                (
                    p["press"].as_u64().unwrap(),
                    number(p, "x_mm"),
                    number(p, "y_mm"),
                )
            })
            .collect()
    }

    fn arguments(&self, table: &str) -> Vec<String> {
        let path = self.lab.path("estimates.csv");
        std::fs::write(&path, table).unwrap();
        let folder = text(&self.folder);
        let answers = text(&self.answers);
        let words = [
            "challenge",
            "score",
            &folder,
            &text(&path),
            "--answers",
            &answers,
            "--json",
        ];
        words.map(str::to_owned).into()
    }

    fn score(&self, table: &str) -> Value {
        skinrig(&self.arguments(table)).code(0).json()
    }

    #[track_caller]
    fn refuses(&self, table: &str, parts: &[&str]) {
        skinrig(&self.arguments(table)).code(2).expect_stderr(parts);
    }
}

fn table(header: &str, rows: impl IntoIterator<Item = String>) -> String {
    let rows: Vec<String> = rows.into_iter().collect();
    format!("{header}\n{}\n", rows.join("\n"))
}

fn rows(truths: &[(u64, f64, f64)], off_mm: f64) -> Vec<String> {
    let row = |(press, x, y): &(u64, f64, f64)| format!("{press},{},{y}", x + off_mm);
    truths.iter().map(row).collect()
}

#[test]
fn estimates_are_scored_with_regions_and_without() {
    let challenge = Challenge::new();
    let truths = challenge.truths();
    let output = challenge.score(&table("press,x_mm,y_mm", rows(&truths, 3.0)));
    let near = |value: &Value, expected: f64| (value.as_f64().unwrap() - expected).abs() < 1e-9;
    let metrics = &output["metrics"];
    assert!(near(&metrics["rmse_mm"]["value"], 3.0), "{output}");
    assert!(near(&metrics["rmse_mm"]["low"], 3.0) && near(&metrics["bias_x_mm"]["value"], 3.0));
    assert_eq!(metrics["located_rate"]["value"], 1.0);
    assert!(output["coverage"].is_null());
    // As tables with an empty cell are written.
    let real = truths
        .iter()
        .map(|(press, x, y)| format!("{press}.0,{x},{y}"));
    let output = challenge.score(&table("press,x_mm,y_mm", real));
    assert_eq!(output["metrics"]["rmse_mm"]["value"], 0.0);
    // One is not located; of the others, the region holds two.
    let header = "press,x_mm,y_mm,region_major_mm,region_minor_mm,region_angle_deg";
    let regions = ["4,1,0", "4,1,180", "4,1,90"];
    let mut with: Vec<String> = rows(&truths, 3.0)
        .iter()
        .zip(regions)
        .map(|(row, region)| format!("{row},{region}"))
        .collect();
    with.push(format!("{},,,,,", truths[3].0));
    let output = challenge.score(&table(header, with));
    assert_eq!(output["metrics"]["located_rate"]["value"], 0.75);
    assert_eq!(output["coverage"]["n"], 3);
    // (3, 0) is within 4 mm along x; within 1 mm along y and 4 mm along x; not within 1 mm along x.
    assert!(near(&output["coverage"]["value"], 2.0 / 3.0), "{output}");
}

#[test]
fn the_folder_gives_no_position_of_a_scored_press_away() {
    let challenge = Challenge::new();
    let presses = read_to_string(challenge.folder.join("challenge.presses.csv")).unwrap();
    let scored: Vec<&str> = presses.lines().filter(|l| l.contains(",score,")).collect();
    assert_eq!(scored.len(), 4, "{presses}");
    assert!(scored.iter().all(|l| l.ends_with(",,,")), "{presses}");
    for (_, x, y) in challenge.truths() {
        for file in std::fs::read_dir(&challenge.folder).unwrap() {
            let bytes = std::fs::read(file.unwrap().path()).unwrap();
            let holds = |number: f64| {
                let text = number.to_string();
                let bits = number.to_le_bytes();
                let found = |part: &[u8]| bytes.windows(part.len()).any(|w| w == part);
                found(text.as_bytes()) || found(&bits)
            };
            assert!(!holds(x) && !holds(y));
        }
    }
    // The answers are not in the folder.
    let inside = text(&challenge.folder.join("answers.json"));
    let command = [
        "challenge",
        "make",
        &text(&challenge.session),
        "--out",
        &text(&challenge.folder),
        "--answers",
        &inside,
    ];
    skinrig(&command).code(2).expect_stderr(&["--answers"]);
    assert!(!Path::new(&inside).exists());
    // Nor the session with all its labels.
    let beside = text(challenge.session.parent().unwrap());
    let session = text(&challenge.session);
    let parts = ["for the challenge alone", "--out"];
    let answers = challenge.lab.text("a.json");
    skinrig(&[
        "challenge",
        "make",
        &session,
        "--out",
        &beside,
        "--answers",
        &answers,
    ])
    .code(2)
    .expect_stderr(&parts);
    assert!(!Path::new(&answers).exists());
}

#[test]
fn order_and_hash_follow_from_random_bytes_and_the_origin_is_stated() {
    let challenge = Challenge::new();
    let description = read_json(&challenge.folder.join("challenge.json"));
    assert_eq!(description["origin"], "simulated");
    // With four scored presses, one order in 24 is that of the plan: eight of them in a row are none in 10^11.
    let (folder, answers) = (text(&challenge.folder), text(&challenge.answers));
    let session = text(&challenge.session);
    let make = || {
        let command = ["challenge", "make", &session, "--out", &folder, "--answers"];
        skinrig(&[&command[..], &[&answers, "--overwrite"]].concat()).code(0);
        let answers = read_json(&challenge.answers);
        let presses = answers["presses"].as_array().unwrap().iter();
        let order: Vec<u64> = presses
            .map(|p| p["session_press"].as_u64().unwrap())
            .collect();
        (order, answers["salt"].as_str().unwrap().to_owned())
    };
    let command: Vec<_> = (0..8).map(|_| make()).collect();
    assert!(
        command.iter().any(|(order, _)| !order.is_sorted()),
        "{command:?}"
    );
    assert!(command.iter().all(|(_, salt)| salt.len() == 64));
    assert_ne!(command[0].1, command[1].1);
    // The answers of a challenge that was given away stay.
    let other = challenge.lab.text("other");
    let command = [
        "challenge",
        "make",
        &session,
        "--out",
        &other,
        "--answers",
        &answers,
    ];
    for more in [&[][..], &["--overwrite"]] {
        skinrig(&[&command[..], more].concat())
            .code(2)
            .expect_stderr(&["found others", "another file with --answers"]);
    }
    let own = challenge.lab.text("own.json");
    skinrig(&[&command[..6], &[&own]].concat()).code(0);
}

#[test]
fn a_wrong_table_is_refused_with_its_row() {
    let challenge = Challenge::new();
    let truths = challenge.truths();
    let good = rows(&truths, 0.0);
    let header = "press,x_mm,y_mm";
    let changed = |i: usize, row: String| {
        let mut all = good.clone();
        all[i] = row;
        table(header, all)
    };
    let (press, x, y) = truths[1];
    let scored: Vec<u64> = truths.iter().map(|t| t.0).collect();
    let given = (1..=8).find(|press| !scored.contains(press)).unwrap();
    challenge.refuses(
        &table(header, good[1..].to_vec()),
        &["1 presses have no row", &format!("press {}", scored[0])],
    );
    challenge.refuses(
        &table(header, [good.clone(), vec![good[1].clone()]].concat()),
        &["row 6", "row 3"],
    );
    challenge.refuses(
        &changed(1, format!("77,{x},{y}")),
        &["row 3", "no press 77"],
    );
    challenge.refuses(
        &changed(1, format!("{given},{x},{y}")),
        &["row 3", "calibrates"],
    );
    challenge.refuses(
        &changed(1, format!("1.5,{x},{y}")),
        &["row 3", "the number of a press", "1.5"],
    );
    challenge.refuses(
        &changed(1, format!("{press},NaN,{y}")),
        &["row 3", "x_mm", "NaN"],
    );
    challenge.refuses(&changed(1, format!("{press},inf,{y}")), &["row 3", "x_mm"]);
    challenge.refuses(
        &changed(1, format!("{press},{x},")),
        &["row 3", "y_mm", "empty"],
    );
    challenge.refuses(&changed(1, format!("{press},{x},left")), &["row 3", "left"]);
    challenge.refuses(
        &changed(1, format!("{press},320,{y}")),
        &["row 3", "mm in the skin frame"],
    );
    challenge.refuses(&table("press,x_m,y_m", good.clone()), &["row 1", "x_m"]);
    challenge.refuses(&table("press,x_mm", good.clone()), &["row 1", "y_mm"]);
    let metres = truths
        .iter()
        .map(|(p, x, y)| format!("{p},{},{}", 1e-3 * x, 1e-3 * y));
    challenge.refuses(&table(header, metres), &["metres"]);
    let region = "press,x_mm,y_mm,region_major_mm,region_minor_mm,region_angle_deg";
    let regions = good.iter().map(|row| format!("{row},0,1,0"));
    challenge.refuses(
        &table(region, regions),
        &["row 2", "region_major_mm", "above 0"],
    );
    let exchanged = good.iter().map(|row| format!("{row},1,4,30"));
    challenge.refuses(
        &table(region, exchanged),
        &["row 2", "region_minor_mm at most region_major_mm (1)", "4"],
    );
    // Answers of another challenge, or changed ones.
    let changed =
        read_to_string(&challenge.answers)
            .unwrap()
            .replacen("\"seed\": ", "\"seed\": 1", 1);
    std::fs::write(&challenge.answers, changed).unwrap();
    challenge.refuses(&table(header, good), &["SHA-256"]);
}

#[test]
fn an_invalid_session_makes_no_challenge() {
    let lab = Lab::new();
    let sessions = lab.text("s");
    let noisy = ["--no-analysis", "--fault", "box-noisy@arming"];
    // The device failed, and all presses are done.
    skinrig(&[&["run", SMALL, "--sessions", &sessions], &noisy[..]].concat()).code(3);
    let session = only(&lab.path("s"), ".session.sqlite");
    let folder = lab.path("challenge");
    let arguments = [
        "challenge",
        "make",
        &text(&session),
        "--out",
        &text(&folder),
    ];
    skinrig(&arguments).code(4).expect_stderr(&[
        &text(&session),
        "found an INVALID one",
        "skinrig show",
    ]);
    assert!(!folder.exists());
}

/// Answers of a guest in a shell: its name after `fit`, then `locate` for every press, `$n`.
fn guest(locate: &str, end: &str) -> Vec<String> {
    let name = r#"{"name":"shell","version":"7"}"#;
    let script = format!(
        r#"while read -r l; do case "$l" in *'"fit"'*) echo '{name}';; *'"locate"'*) n=${{l#*'"press":'}}; n=${{n%%,*}}; {locate};; esac; done; {end}"#
    );
    ["sh", "-c", &script].map(str::to_owned).into()
}

fn examine(session: &Path, options: &[&str], guest: &[String]) -> crate::support::ProgramOutput {
    let session = text(session);
    let mut arguments = vec!["challenge", "run", &session, "--json"];
    arguments.extend_from_slice(options);
    arguments.push("--");
    arguments.extend(guest.iter().map(String::as_str));
    skinrig(&arguments)
}

#[test]
fn a_guest_is_scored_as_its_table_would_be_and_sees_no_scored_position() {
    let challenge = Challenge::new();
    let log = text(&challenge.lab.path("lines"));
    let constant = r#"echo "{\"press\":$n,\"x_mm\":1.5,\"y_mm\":-2}""#;
    let locate = format!("echo \"$l\" >>'{log}'; {constant}");
    let found = examine(&challenge.session, &[], &guest(&locate, "true")).code(0);
    let found = found.json();
    let truths = challenge.truths();
    let square = |(_, x, y): &(u64, f64, f64)| (x - 1.5).powi(2) + (y + 2.0).powi(2);
    let rmse = (truths.iter().map(square).sum::<f64>() / truths.len() as f64).sqrt();
    let of = |who: &str| found[who]["metrics"]["rmse_mm"]["value"].as_f64().unwrap();
    assert!((of("guest") - rmse).abs() < 1e-9, "{found:#}");
    assert!(of("own") < rmse && found["difference_mm"]["value"].as_f64() > Some(0.0));
    assert_eq!(found["guest"]["coverage"], Value::Null);
    assert_eq!(
        (&found["name"], &found["version"]),
        (&"shell".into(), &"7".into())
    );
    assert_eq!(found["calibrating"], 4);
    // Four locations are too few to leave some out.
    assert_eq!(found["left_out"], Value::Null);
    let lines = read_to_string(&log).unwrap();
    assert_eq!(lines.lines().count(), truths.len());
    for (_, x, y) in truths {
        assert!(!lines.contains(&x.to_string()) && !lines.contains(&y.to_string()));
    }
    for name in ["_mm", "depth", "release", "events\":{", "location"] {
        assert!(!lines.contains(name), "{name}: {lines}");
    }
    // With events, as many as the analysis clustered or more.
    std::fs::remove_file(&log).unwrap();
    examine(&challenge.session, &["--events"], &guest(&locate, "true")).code(0);
    for line in read_to_string(&log).unwrap().lines() {
        let line: Value = serde_json::from_str(line).unwrap();
        for camera in line["cameras"].as_array().unwrap() {
            let clustered = camera["cluster_events"].as_u64().unwrap() as usize;
            let columns = ["t_us", "x_px", "y_px", "on"];
            let counts = columns.map(|c| camera["events"][c].as_array().unwrap().len());
            assert!(clustered > 0 && counts[0] >= clustered, "{counts:?}");
            assert!(counts.iter().all(|n| *n == counts[0]));
        }
    }
}

#[test]
fn a_guest_that_does_not_do_its_part_is_refused_with_the_reason() {
    let challenge = Challenge::new();
    let good = r#"echo "{\"press\":$n,\"x_mm\":1.5,\"y_mm\":-2}""#;
    for (locate, end, parts) in [
        (
            "exit 3",
            "true",
            vec!["`locate` of press", "exit status: 3"],
        ),
        (
            good,
            "exit 4",
            vec!["the end of its input", "exit status: 4"],
        ),
        (
            good,
            "echo done",
            vec!["no line after the last press", "done"],
        ),
        ("echo loading", "true", vec!["`loading`", "standard error"]),
        (r#"echo "{\"press\":99}""#, "true", vec!["found press 99"]),
        (
            r#"echo "{\"press\":$n,\"x_mm\":320,\"y_mm\":240}""#,
            "true",
            vec!["mm in the skin frame"],
        ),
        (
            r#"echo "{\"press\":$n,\"x_mm\":0.01,\"y_mm\":0.02}""#,
            "true",
            vec!["metres"],
        ),
        (":", "true", vec!["within 1 s", "--timeout"]),
    ] {
        let output = examine(&challenge.session, &["--timeout", "1"], &guest(locate, end));
        output.code(2).expect_stderr(&parts);
    }
    let absent = ["/nowhere/guest".to_owned()];
    let output = examine(&challenge.session, &[], &absent).code(2);
    output.expect_stderr(&["/nowhere/guest", "after `--`"]);
}

#[test]
fn the_documented_guest_is_worse_at_places_that_it_did_not_learn() {
    let Ok(python) = std::env::var("SKINRIG_PYTHON") else {
        eprintln!("skipped: no SKINRIG_PYTHON, an interpreter with tests/python/requirements.txt");
        return;
    };
    let lab = Lab::new();
    let points: Vec<String> = (0..12)
        .map(|i| format!("[{} mm, {} mm]", -14 + 12 * (i % 4), -16 + 15 * (i / 4)))
        .collect();
    let points = format!("path.points=[{}]", points.join(", "));
    let more = [
        "evaluation.calibrate=[1]",
        "evaluation.score=[2]",
        "analysis.bootstrap_resamples=50",
        &points,
    ];
    let more: Vec<&str> = more.iter().flat_map(|set| ["--set", *set]).collect();
    let session = lab.record("s", &more);
    let script = format!("{}/docs/how-to/guest.py", crate::support::ROOT);
    let found = examine(&session, &[], &[python, script]).code(0).json();
    let rmse = |of: &Value| of["metrics"]["rmse_mm"]["value"].as_f64().unwrap();
    let left_out = &found["left_out"]["guest"];
    assert!(rmse(left_out) > 2.0 * rmse(&found["guest"]), "{found:#}");
    assert_eq!(found["calibrating"], left_out["presses"]);
}
