//! Injected faults: shown with the session everywhere, rejected on a bench, and reflected in the exit code.

use crate::support::{Lab, SMALL, files, only, program, run_to_end, show, skinrig, text};

#[test]
fn a_run_with_faults_is_labelled_in_every_view() {
    let lab = Lab::new();
    let folder = lab.path("a");
    let output = skinrig(&[
        "run",
        SMALL,
        "--sessions",
        &text(&folder),
        "--set",
        "faults=[camera1-drops@hold:3]",
        "--fault",
        "trigger-lost@contact:5",
    ])
    .code(0);
    let notice = "FAULTS ON PURPOSE: camera1-drops@hold:3, trigger-lost@contact:5";
    assert!(output.err.contains(notice), "{output:#?}");
    let words: Vec<&str> = output.out.split_whitespace().collect();
    assert!(words.join(" ").contains(notice), "{output:#?}");
    let shown = show(&only(&folder, ".session.sqlite"));
    let name = shown["rig"].as_str().unwrap_or_default();
    assert!(name.contains(notice), "{name}");
    let report = std::fs::read_to_string(only(&folder, ".html")).unwrap();
    let first = &report[..report.find("<h2").unwrap()];
    assert!(first.contains(notice), "not on the first screen");
}

#[test]
fn a_bench_takes_no_faults() {
    let lab = Lab::new();
    let folder = text(&lab.path("a"));
    for plant in [
        ["--fault", "robot-slow@hold:1"],
        ["--set", "faults=[robot-slow@hold:1]"],
    ] {
        let mut arguments = vec!["run", SMALL, "--sessions", &folder];
        arguments.extend(["--rig", "hil/rigs/emulated.yaml"]);
        arguments.extend(plant);
        let mut command = program(&arguments);
        command
            .env("SKINRIG_EMULATED_LIBDRD", "not-there.so")
            .env("SKINRIG_EMULATED_TRIGGER_BOX", "/dev/not-there")
            .env("SKINRIG_EMULATED_LAMPS_OFF", "/not-there/lamps-off");
        run_to_end(command).code(2).expect_stderr(&[
            "only the simulated rig",
            "robot-slow@hold:1",
            "next: ",
        ]);
    }
    assert!(files(&lab.path("."), ".sqlite").is_empty());
}

/// A rehearsal in which a fault never occurred has tested nothing.
#[test]
fn a_run_without_one_of_its_faults_fails_and_names_it() {
    let lab = Lab::new();
    for (n, (never, occurs)) in [
        ("robot-slow@hold:9999", "trigger-lost@contact:2"),
        ("camera1-drops@time:18000s", "trigger-lost@arming"),
        ("killed@record:9999999", "camera2-drops@hold:1"),
        ("disk-full@press:9999", "camera2-drops@time:1s"),
    ]
    .into_iter()
    .enumerate()
    {
        let folder = lab.path(&n.to_string());
        let mut run = vec!["run", SMALL, "--sessions"];
        let path = text(&folder);
        run.extend([&*path, "--no-analysis", "--fault", never, "--fault", occurs]);
        let ended = skinrig(&run).code(2);
        let session = text(&only(&folder, ".session.sqlite"));
        ended.expect_stderr(&[
            &format!("the run ended without {never}\n"),
            &format!("the session is kept: {session}"),
        ]);
        skinrig(&["verify", &session]).code(0);
    }
}

#[test]
fn an_unknown_fault_is_refused() {
    let run = |plant: [&str; 2]| skinrig(&["run", SMALL, plant[0], plant[1]]).code(2);
    run(["--fault", "camera1-stall@hold:1"]).expect_stderr(&["did you mean `camera1-stalled`?"]);
    run(["--set", "faults=[robot-slow@record:3]"]).expect_stderr(&["faults[0]", "`preflight`"]);
}

#[test]
fn a_full_disk_keeps_what_was_written() {
    let lab = Lab::new();
    let folder = lab.path("a");
    skinrig(&[
        "run",
        SMALL,
        "--sessions",
        &text(&folder),
        "--fault",
        "disk-full@press:5",
    ])
    .code(3)
    .expect_stderr(&["disk is full", "disk space", "skinrig resume"]);
    let session = only(&folder, ".session.sqlite");
    assert_eq!(show(&session)["totals"]["presses"]["valid"], 2);
    // With space available again the remaining presses follow under the same name.
    skinrig(&["resume", &text(&session)]).code(0);
    let shown = show(&session);
    assert_eq!(shown["totals"]["presses"]["valid"], 8);
    assert!(
        shown["rig"]
            .as_str()
            .unwrap_or_default()
            .contains("disk-full@press:5")
    );
}

/// Runs presses of this depth, with a fault that shifts the reported height by 0.5 mm if given; returns the output.
fn with_height_off(fault: Option<&str>, depth: &str, code: i32) -> String {
    let lab = Lab::new();
    let folder = text(&lab.path("a"));
    let depth = format!("depth={depth}");
    let mut arguments = vec!["run", "-v", SMALL, "--sessions", &folder, "--set", &depth];
    arguments.extend(fault.iter().flat_map(|f| ["--fault", f]));
    let output = skinrig(&arguments).code(code);
    let shown = skinrig(&["show", &text(&only(&lab.path("a"), ".session.sqlite"))]).code(0);
    for fault in ["height off", "not touched"] {
        let found = shown.out.contains(&format!("found: {fault}"));
        assert_eq!(output.out.contains(fault), found, "{}", shown.out);
    }
    let words: Vec<&str> = output.out.split_whitespace().collect();
    words.join(" ")
}

#[test]
fn a_wrong_robot_height_is_reported_with_the_evidence() {
    let check = "skinrig hil run hil/nightly.yaml --rig NAME.yaml --only depth";
    let deep = with_height_off(Some("robot-z-high@preflight"), "1 mm", 0);
    assert!(
        deep.contains("height off") && deep.contains(check),
        "{deep}"
    );
    let shallow = with_height_off(Some("robot-z-low@preflight"), "0.4 mm", 4);
    assert!(
        shallow.contains("not touched") && shallow.contains(check),
        "{shallow}"
    );
    assert!(!shallow.contains("camera blind"), "{shallow}");
    for depth in ["1 mm", "0.4 mm"] {
        let sound = with_height_off(None, depth, 0);
        assert!(
            !sound.contains("height off") && !sound.contains("not touched"),
            "{sound}"
        );
    }
}
