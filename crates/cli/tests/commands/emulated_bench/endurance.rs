//! Endurance of the bench under full processor load: thousands of presses, nights in a row. Started by hand; sizes come from
//! the environment.

use std::env;
use std::fs;
use std::path::Path;
use std::process::{Child, Command};
use std::thread;

use serde_json::Value;
use skinrig_emulated_bench::{BenchConfig, BenchError, EmulatedBench};
use skinrig_model::PressOutcome;
use skinrig_recorder::SessionReader;

use super::{SKINRIG, all_output, workspace_root};

/// Presses at closely spaced locations, as fast as the emulated arm can move.
const PROTOCOL: &str = "\
skinrig: 1
name: endurance
operator: nobody
prototype: {id: stand-in}
scene: {needs: [triggers, event_rates, localisation]}
sync: {count: 3, interval: 1 s, at: [10 mm, 2 mm], pause_after: 1 s}
path:
  points: [[10 mm, 2 mm], [10 mm, 5 mm], [10 mm, 9 mm], [6 mm, 9 mm], [1 mm, 9 mm], [1 mm, 4 mm], [-4 mm, 4 mm], [-4 mm, -2 mm], [1 mm, -2 mm], [6 mm, -1 mm]]
repetitions: {count: 30}
depth: 1 mm
motion: {clearance: 2 mm, approach: 60 mm/s, indent: 40 mm/s, hold: 50 ms, retract: 60 mm/s, travel: 90 mm/s}
limits:
  workspace: {min: [-30 mm, -35 mm, -4 mm], max: [50 mm, 40 mm, 25 mm]}
  max_depth: 3 mm
  max_speed: 100 mm/s
  max_force: 3 N
triggers: {marks: [contact, retract]}
evaluation: {calibrate: [1], score: [2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30]}
";
/// Presses of a run, sync presses included.
const PRESSES: usize = 303;

fn env_size(name: &str, default: usize) -> usize {
    env::var(name).map_or(default, |text| text.parse().unwrap())
}

/// Low-priority processes that keep all processors busy until dropped.
struct CpuLoad(Vec<Child>);

impl CpuLoad {
    fn all() -> Self {
        let one = |_| {
            let mut command = Command::new("nice");
            command.args(["-n", "19", "sh", "-c", "while :; do :; done"]);
            command.spawn().unwrap()
        };
        let processors = thread::available_parallelism().unwrap().get();
        Self((0..processors).map(one).collect())
    }
}

impl Drop for CpuLoad {
    fn drop(&mut self) {
        for child in &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Outcome of the presses of one bench.
#[derive(Debug, Default)]
struct Tally {
    presses: usize,
    refused: usize,
    /// Last messages of each run that ended early.
    ended: Vec<String>,
}

fn record_presses(bench: &EmulatedBench, folder: &Path, presses: usize) -> Tally {
    let protocol = folder.join("endurance.yaml");
    fs::write(&protocol, PROTOCOL).unwrap();
    let mut tally = Tally::default();
    for run in 0.. {
        if tally.presses >= presses || tally.ended.len() > 20 {
            break;
        }
        let sessions = folder.join(run.to_string());
        let mut command = bench.command(SKINRIG).unwrap();
        command
            .current_dir(workspace_root())
            .args(["run", "--no-analysis", "--rig", "hil/rigs/emulated.yaml"])
            .arg("--sessions")
            .arg(&sessions)
            .arg(&protocol);
        let output = command.output().unwrap();
        let messages = all_output(&output);
        tally.refused += messages.matches("motion refused").count();
        if !output.status.success() {
            let last = messages.lines().rev().take(12).collect::<Vec<_>>();
            tally.ended.push(last.join(" | "));
        }
        for file in fs::read_dir(&sessions).into_iter().flatten() {
            let path = file.unwrap().path();
            if path.to_string_lossy().ends_with(".session.sqlite") {
                let outcomes = SessionReader::open(&path).unwrap().last_outcomes().unwrap();
                let made =
                    |o: &&Option<PressOutcome>| o.as_ref().is_some_and(|o| o.timing.is_some());
                tally.presses += outcomes.iter().filter(made).count();
            }
        }
        eprintln!(
            "{} presses, {} refused, {} runs ended early",
            tally.presses,
            tally.refused,
            tally.ended.len()
        );
        fs::remove_dir_all(&sessions).unwrap();
    }
    tally
}

#[test]
#[ignore = "an hour of real time: SKINRIG_CI_LONG=1 .ci/run, or SKINRIG_PRESSES=10000 SKINRIG_BENCHES=2 cargo test -p skinrig --test commands -- --ignored --nocapture thousands"]
fn of_thousands_of_presses_under_load_no_motion_is_refused() {
    let (presses, benches) = (
        env_size("SKINRIG_PRESSES", 10_000),
        env_size("SKINRIG_BENCHES", 2),
    );
    let _busy = CpuLoad::all();
    let one = |seed| {
        let config = BenchConfig {
            seed: seed as u64,
            ..BenchConfig::default()
        };
        let bench = match EmulatedBench::start(&config) {
            Err(BenchError::Box(reason)) => panic!("no emulated bench: {reason}"),
            other => other.unwrap(),
        };
        let folder = tempfile::tempdir().unwrap();
        record_presses(
            &bench,
            folder.path(),
            presses.div_ceil(benches).max(PRESSES),
        )
    };
    let tallies: Vec<Tally> = thread::scope(|scope| {
        let all: Vec<_> = (1..=benches)
            .map(|seed| scope.spawn(move || one(seed)))
            .collect();
        all.into_iter().map(|t| t.join().unwrap()).collect()
    });
    let made: usize = tallies.iter().map(|t| t.presses).sum();
    let refused: usize = tallies.iter().map(|t| t.refused).sum();
    eprintln!("emulated, {benches} benches: {made} presses, {refused} motions refused");
    for ended in tallies.iter().flat_map(|t| &t.ended) {
        eprintln!("ended early: {ended}");
    }
    assert!(made >= presses && refused == 0, "{tallies:?}");
}

#[test]
#[ignore = "half an hour of real time: SKINRIG_CI_LONG=1 .ci/run, or SKINRIG_NIGHTS=20 SKINRIG_BENCHES=2 cargo test -p skinrig --test commands -- --ignored --nocapture nights"]
fn nights_in_a_row_pass() {
    let (nights, benches) = (
        env_size("SKINRIG_NIGHTS", 20),
        env_size("SKINRIG_BENCHES", 2),
    );
    let one = |_| {
        let bench = EmulatedBench::start(&BenchConfig::default()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let mut verdicts = Vec::new();
        for night in 0..nights.div_ceil(benches) {
            let mut command = bench.command(SKINRIG).unwrap();
            command
                .current_dir(workspace_root())
                .args([
                    "hil",
                    "run",
                    "--json",
                    "hil/nightly.yaml",
                    "--rig",
                    "hil/rigs/emulated.yaml",
                    "--out",
                ])
                .arg(folder.path().join("nights"));
            let output = command.output().unwrap();
            let night_report: Value = serde_json::from_slice(&output.stdout).unwrap_or_default();
            let checks = night_report["checks"]
                .as_array()
                .cloned()
                .unwrap_or_default();
            let bad = checks
                .iter()
                .filter(|c| !matches!(c["verdict"].as_str(), Some("PASS" | "SKIPPED")));
            let bad: Vec<String> = bad.map(|c| format!("{c}")).collect();
            let verdict = night_report["verdict"]
                .as_str()
                .unwrap_or("none")
                .to_owned();
            eprintln!(
                "night {}: {verdict} {:?} {bad:?}",
                night + 1,
                output.status.code()
            );
            verdicts.push(verdict);
        }
        verdicts
    };
    let verdicts: Vec<String> = thread::scope(|scope| {
        let all: Vec<_> = (0..benches).map(|n| scope.spawn(move || one(n))).collect();
        all.into_iter().flat_map(|t| t.join().unwrap()).collect()
    });
    let passed = verdicts.iter().filter(|v| *v == "PASS").count();
    eprintln!(
        "emulated, {benches} benches: {passed} of {} nights PASS",
        verdicts.len()
    );
    assert_eq!(passed, verdicts.len(), "{verdicts:?}");
}
