//! `skinrig reanalyze` on a Dask cluster of this computer: bit-equal to one machine, with killed workers and a killed scheduler.
//!
//! `SKINRIG_PYTHON` names an interpreter with the packages of `tests/python/requirements.txt`.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use serde_json::Value;

use crate::support::{Lab, ProgramOutput, ROOT, SMALL, files, program, skinrig, text};

const RESULTS: &str = ".analysis-wider.results.json";
const REPORT: &str = ".analysis-wider.report.html";

/// A scheduler and its workers; they end with this.
struct Cluster {
    scheduler: Child,
    address: String,
    workers: Vec<String>,
}

impl Cluster {
    /// `None`, with the reason on standard error, without an interpreter.
    fn start(workers: u32) -> Option<Self> {
        let Ok(python) = std::env::var("SKINRIG_PYTHON") else {
            eprintln!(
                "skipped: no SKINRIG_PYTHON, an interpreter with tests/python/requirements.txt"
            );
            return None;
        };
        let mut scheduler = Command::new(python)
            .arg(Path::new(ROOT).join("tests/python/dask_cluster.py"))
            .arg(workers.to_string())
            .env("SKINRIG", env!("CARGO_BIN_EXE_skinrig"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        let out = scheduler.stdout.take().unwrap();
        BufReader::new(out).read_line(&mut line).unwrap();
        let mut words = line.split_whitespace().map(str::to_owned);
        Some(Self {
            address: format!("dask://{}", words.next().unwrap()),
            workers: words.collect(),
            scheduler,
        })
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        // The end of its input ends it and its workers.
        drop(self.scheduler.stdin.take());
        let _ = self.scheduler.wait();
    }
}

/// Records `count` sessions in the folder `s`, and writes other settings.
fn recorded(lab: &Lab, count: u32) -> String {
    for seed in 1..=count {
        let seed = seed.to_string();
        let folder = lab.text("s");
        skinrig(&[
            "run",
            SMALL,
            "--sessions",
            &folder,
            "--seed",
            &seed,
            "--no-analysis",
        ])
        .code(0);
    }
    let settings = "skinrig_settings: 1\nanalysis: {min_samples: 5, bootstrap_resamples: 50}\n";
    std::fs::write(lab.path("wider.yaml"), settings).unwrap();
    lab.text("wider.yaml")
}

fn arguments<'a>(settings: &'a str, on: &'a str, folder: &'a str) -> [&'a str; 7] {
    [
        "reanalyze",
        "--json",
        "--settings",
        settings,
        "--on",
        on,
        folder,
    ]
}

fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let read = |path: PathBuf| (path.clone(), std::fs::read(path).unwrap());
    let all = [files(folder, RESULTS), files(folder, REPORT)].concat();
    all.into_iter().map(read).collect()
}

/// Starts the command, and waits for the first session that is finished: its report is written last.
fn under_way(arguments: &[&str], folder: &Path) -> Child {
    let mut command = program(arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    while files(folder, REPORT).is_empty() && child.try_wait().unwrap().is_none() {
        std::thread::yield_now();
    }
    child
}

fn end(child: Child) -> ProgramOutput {
    let output = child.wait_with_output().unwrap();
    ProgramOutput {
        code: output.status.code(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

fn kill(process: &str) {
    let killed = Command::new("kill").args(["-KILL", process]).status();
    assert!(killed.unwrap().success(), "{process}");
}

fn count(found: &Value, state: &str) -> u64 {
    found["counts"][state].as_u64().unwrap()
}

#[test]
fn a_killed_worker_loses_and_repeats_nothing() {
    let lab = Lab::new();
    let Some(cluster) = Cluster::start(2) else {
        return;
    };
    let settings = recorded(&lab, 6);
    let folder = lab.path("s");
    let run = under_way(
        &arguments(&settings, &cluster.address, &text(&folder)),
        &folder,
    );
    kill(&cluster.workers[0]);
    let found = end(run).code(0).json();
    assert_eq!(count(&found, "done"), 6, "{found}");
    let by_cluster = contents(&folder);
    assert_eq!(by_cluster.len(), 12, "results and reports");
    for (path, _) in &by_cluster {
        std::fs::remove_file(path).unwrap();
    }
    skinrig(&arguments(&settings, "local", &text(&folder))).code(0);
    assert!(
        contents(&folder) == by_cluster,
        "other bytes on one machine"
    );
}

#[test]
fn a_killed_scheduler_is_named_and_the_next_command_finishes() {
    let lab = Lab::new();
    let Some(mut cluster) = Cluster::start(2) else {
        return;
    };
    let settings = recorded(&lab, 6);
    let folder = lab.path("s");
    let run = under_way(
        &arguments(&settings, &cluster.address, &text(&folder)),
        &folder,
    );
    cluster.scheduler.kill().unwrap();
    let ended = end(run)
        .code(1)
        .expect_stderr(&["sessions failed", "repeat the command"]);
    let found = ended.json();
    assert!(count(&found, "failed") > 0, "{found}");
    let found = skinrig(&arguments(&settings, "local", &text(&folder)))
        .code(0)
        .json();
    let [done, replaced, there] = ["done", "replaced", "there"].map(|s| count(&found, s));
    assert!(there >= 1, "{found}");
    assert_eq!(done + replaced + there, 6, "{found}");
    assert_eq!(files(&folder, RESULTS).len(), 6);
}

#[test]
fn what_is_no_cluster_is_refused_with_the_next_step() {
    let lab = Lab::new();
    let settings = recorded(&lab, 1);
    let folder = lab.text("s");
    let on = |engine| skinrig(&arguments(&settings, engine, &folder));
    on("dask://here")
        .code(2)
        .expect_stderr(&["dask://HOST:PORT"]);
    on("ray://here:1").code(2).expect_stderr(&["`local`"]);
    let jobs = [
        &arguments(&settings, "dask://here:1", &folder)[..],
        &["--jobs", "2"],
    ]
    .concat();
    skinrig(&jobs)
        .code(2)
        .expect_stderr(&["--jobs", "leave it out"]);
    let mut command = program(&arguments(&settings, "dask://127.0.0.1:9", &folder));
    command.env("SKINRIG_PYTHON", "/bin/no-python");
    let child = command
        .stderr(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn();
    end(child.unwrap())
        .code(1)
        .expect_stderr(&["/bin/no-python", "SKINRIG_PYTHON"]);
}

/// Two workers against one, with as many sessions as `SKINRIG_SESSIONS` says.
#[test]
#[ignore = "measures, minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig --test commands -- --ignored --nocapture two_workers"]
fn two_workers_against_one() {
    let sessions = std::env::var("SKINRIG_SESSIONS").map_or(100, |n| n.parse().unwrap());
    let lab = Lab::new();
    let settings = recorded(&lab, 1);
    let first = files(&lab.path("s"), ".session.sqlite").remove(0);
    for n in 1..sessions {
        let copy = lab.path("s").join(format!("copy-{n}.session.sqlite"));
        std::fs::copy(&first, copy).unwrap();
    }
    let folder = lab.text("s");
    let took = [2, 1].map(|workers| {
        let cluster = Cluster::start(workers).expect("an interpreter");
        let began = Instant::now();
        skinrig(&arguments(&settings, &cluster.address, &folder)).code(0);
        let took = began.elapsed().as_secs_f64();
        for (path, _) in contents(&lab.path("s")) {
            std::fs::remove_file(path).unwrap();
        }
        took
    });
    let ratio = took[1] / took[0];
    println!(
        "{sessions} sessions: two workers {:.1} s, one {:.1} s: {ratio:.2} times",
        took[0], took[1]
    );
}
