//! `skinrig hil` from the command line: input rejected before the start, an absent bench, and lease holders.

use std::path::Path;

use serde_json::Value;
use skinrig_hil::lease::{Lease, LeaseTiming, Owner};

use crate::support::{Lab, ProgramOutput, ROOT, files, program, run_to_end, text};

const EMULATED: &str = "hil/rigs/emulated.yaml";
const NIGHTLY: &str = "hil/nightly.yaml";

/// Runs the program with an absent emulated bench and leases in this folder.
fn without_bench(leases: &Path, arguments: &[&str]) -> ProgramOutput {
    let mut command = program(arguments);
    command
        .env("SKINRIG_EMULATED_LIBDRD", "/nowhere/libdrd.so")
        .env("SKINRIG_EMULATED_TRIGGER_BOX", "/nowhere/box")
        .env("SKINRIG_EMULATED_LAMPS_OFF", "/nowhere/lamps-off")
        .env("SKINRIG_LEASES", leases);
    run_to_end(command)
}

fn lab() -> (Lab, std::path::PathBuf) {
    let lab = Lab::new();
    let leases = lab.path("leases");
    std::fs::create_dir(&leases).unwrap();
    (lab, leases)
}

/// Writes a suite of these checks.
fn suite(lab: &Lab, budget: &str, checks: &str) -> String {
    let path = lab.path("suite.yaml");
    let text = format!("skinrig_suite: 1\nname: small\nbudget: {budget}\nchecks:\n{checks}");
    std::fs::write(&path, text).unwrap();
    lab.text("suite.yaml")
}

const IDENTITY: &str = "  identity: {differences: {at_most: 0}}\n";

#[test]
fn what_cannot_be_a_night_is_refused_before_it_begins() {
    let (lab, leases) = lab();
    let out = lab.text("nights");
    let run = |suite: &str, more: &[&str]| {
        let mut arguments = vec!["hil", "run", suite, "--rig", EMULATED, "--out", &out];
        arguments.extend_from_slice(more);
        without_bench(&leases, &arguments)
    };
    run(NIGHTLY, &["--only", "idle,idlle"])
        .code(2)
        .expect_stderr(&["--only", "found `idlle`", "trigger_loopback"]);
    let long = suite(
        &lab,
        "10 s",
        "  clocks: {duration: 60 s, drift: {at_least: -200 ppm, at_most: 200 ppm}}\n",
    );
    run(&long, &[]).code(2).expect_stderr(&["budget", "next: "]);
    let toothless = suite(&lab, "10 min", "  idle: {duration: 3 s}\n");
    run(&toothless, &[])
        .code(2)
        .expect_stderr(&["at least one of `data_rate`"]);
    let golden = text(Path::new(ROOT).join("hil/golden.yaml").as_path());
    let numb = suite(
        &lab,
        "10 min",
        &format!("  reaction: {{protocol: {golden}, skipped: {{at_most: 0}}}}\n"),
    );
    run(&numb, &[])
        .code(2)
        .expect_stderr(&["golden.yaml: expected `online`", "next: "]);
    run("no/such/suite.yaml", &[]).code(2);
    assert!(!lab.path("nights").exists());
}

#[test]
fn a_missing_bench_is_an_infrastructure_failure_and_the_night_is_stored() {
    let (lab, leases) = lab();
    let small = suite(
        &lab,
        "10 min",
        &format!("{IDENTITY}  stop_drill: {{skip: nobody near, distance: {{at_most: 1 mm}}}}\n"),
    );
    let history = lab.text("history.sqlite");
    let ran = without_bench(
        &leases,
        &[
            "hil",
            "run",
            &small,
            "--rig",
            EMULATED,
            "--out",
            &lab.text("nights"),
            "--history",
            &history,
        ],
    )
    .code(3);
    for output in [
        "Look at the computer and its cables",
        "about ",
        "FAIL",
        "nobody near",
        "next",
    ] {
        assert!(ran.out.contains(output), "expected {output:?} in {ran:#?}");
    }
    let [folder] = &files(&lab.path("nights"), "-small")[..] else {
        panic!("one night: {ran:#?}");
    };
    let json = std::fs::read_to_string(folder.join("night.json")).unwrap();
    let night: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(night["finished"], true);
    assert_eq!(
        (&night["verdict"], &night["exit"]),
        (&"FAIL".into(), &"Infrastructure".into())
    );
    let identity = &night["checks"][0];
    assert_eq!(identity["cause"], "infrastructure");
    // A third attempt could no longer reach two passes.
    assert_eq!(identity["attempts"].as_array().unwrap().len(), 2);
    let junit = std::fs::read_to_string(folder.join("junit.xml")).unwrap();
    let error = junit.lines().find(|line| line.contains("<error "));
    assert!(error.unwrap().contains(" type=\"not-reachable\"") && junit.contains("nobody near"));
    let page = std::fs::read_to_string(folder.join("night.html")).unwrap();
    assert!(page.contains("Look at the computer and its cables"));
    assert!(Path::new(&history).exists());
}

#[test]
fn a_bench_has_one_holder_whichever_command_asks() {
    let (lab, leases) = lab();
    let shown = |more: &[&str]| {
        let mut arguments = vec!["hil", "lease", "--json"];
        arguments.extend_from_slice(more);
        without_bench(&leases, &arguments).code(0).json()
    };
    assert_eq!(shown(&[])["leases"], Value::Array(Vec::new()));
    let lease = &shown(&["--rig", EMULATED])["leases"][0];
    assert_eq!(lease["state"], "free");
    let path = lease["path"].as_str().unwrap().to_owned();
    let owner = Owner::this_process("maria".into(), "lab-2".into(), "hil run nightly".into());
    let held = Lease::take(Path::new(&path), owner, LeaseTiming::default()).unwrap();

    let small = suite(&lab, "10 min", IDENTITY);
    let (out, log) = (lab.text("out"), lab.text("jog.log"));
    for arguments in [
        &["hil", "run", &*small, "--rig", EMULATED, "--out", &*out][..],
        &[
            "run",
            "protocols/quick-check.yaml",
            "--rig",
            EMULATED,
            "--sessions",
            &*out,
        ],
        &["jog", "--rig", EMULATED, "--log", &*log],
    ] {
        without_bench(&leases, arguments).code(3).expect_stderr(&[
            "`skinrig hil run nightly` of maria on lab-2",
            "next: ",
            "kill ",
        ]);
    }
    assert!(files(&lab.path("out"), "").is_empty());
    // Listing devices must not reset the lease holder's box.
    let requests = || {
        let listed = without_bench(&leases, &["devices", "--rig", EMULATED, "--json"]).code(0);
        let lines = listed.json()["devices"].as_array().unwrap().clone();
        let boxed = |l: &&Value| l["device"] == "trigger box";
        lines.iter().find(boxed).unwrap().clone()
    };
    let boxed = requests();
    assert_eq!(boxed["state"], "busy");
    assert!(
        boxed["next_step"]
            .as_str()
            .unwrap()
            .contains("maria on lab-2")
    );
    let lease = &shown(&[])["leases"][0];
    assert_eq!(
        (&lease["state"], &lease["owner"]["user"]),
        (&"held".into(), &"maria".into())
    );
    drop(held);
    assert_eq!(requests()["state"], "absent");
    let plain = without_bench(&leases, &["hil", "lease"]).code(0);
    assert!(plain.out.contains("free; last: ") && plain.out.contains(&text(Path::new(&path))));
}
