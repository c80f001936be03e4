//! Synthetic nights: a bench's history, written by the library.

use std::ops::Range;
use std::path::{Path, PathBuf};

use chrono::{Days, NaiveDate};
use skinrig_hil::history::append;
use skinrig_nightly::night::{Attempt, CheckResult, Measurement, NIGHT_VERSION, Part};
use skinrig_nightly::{GoldenSession, Night, NightExit, Verdict, Versions};

use crate::support::{Lab, ProgramOutput, program, run_to_end, skinrig};

/// Names of bench and suite, as in the emulated rig file and [`SUITE`].
const RIG: &str = "emulated";
/// Suite of a check that needs no device.
const SUITE: &str = "\
skinrig_suite: 1
name: small
budget: 10 min
checks:
  disk: {amount: 1 MB, write_rate: {at_least: 1 kB/s}, free: {at_least: 1 B}}
";

/// Night number `at` with these measurements: check, device, metric, unit, value.
fn night(at: usize, golden: Option<&str>, measured: &[(&str, &str, &str, &str, f64)]) -> Night {
    let day = NaiveDate::from_ymd_opt(2024, 1, 1).unwrap() + Days::new(at as u64);
    Night {
        version: NIGHT_VERSION,
        id: format!("{day}T02-00-00Z-small"),
        suite: "small".to_owned(),
        suite_sha256: "5".repeat(64),
        rig: RIG.to_owned(),
        rig_kind: "emulated".to_owned(),
        rig_sha256: "6".repeat(64),
        versions: Versions::default(),
        started: format!("{day}T02:00:00Z"),
        took_s: 60.0,
        planned_s: 60.0,
        budget_s: 600.0,
        finished: true,
        ended_early: None,
        lease_note: None,
        notifications: Vec::new(),
        checks: measured.iter().map(check).collect(),
        golden: golden.map(|session| GoldenSession {
            session: session.to_owned(),
            report: None,
            results_sha256: None,
        }),
        verdict: Verdict::Pass,
        exit: NightExit::Pass,
    }
}

/// A night of this day, YYYY-MM-DD.
fn dated(day: &str) -> Night {
    Night {
        id: format!("{day}T02-00-00Z-small"),
        started: format!("{day}T02:00:00Z"),
        ..night(0, None, &[("disk", "computer", "write_rate", "B/s", 1e15)])
    }
}

fn check(&(name, subject, metric, unit, value): &(&str, &str, &str, &str, f64)) -> CheckResult {
    let measurement = Measurement {
        metric: metric.to_owned(),
        value: Some(value),
        unit: unit.to_owned(),
        interval: None,
        n: None,
        needs: 0,
        limit: None,
        verdict: Verdict::Pass,
        note: None,
    };
    let part = Part {
        subject: subject.to_owned(),
        measurements: vec![measurement],
        verdict: Verdict::Pass,
    };
    CheckResult {
        name: name.to_owned(),
        title: name.to_owned(),
        planned_s: 30.0,
        attempts: vec![Attempt {
            began_s: 0.0,
            took_s: 30.0,
            parts: vec![part],
            evidence: Vec::new(),
            verdict: Verdict::Pass,
            cause: None,
            rule: None,
        }],
        skipped: None,
        verdict: Verdict::Pass,
        repeats: None,
        cause: None,
        rule: None,
        witnesses: Vec::new(),
    }
}

/// Normal variation between nights of a healthy bench.
fn wobble(at: usize) -> f64 {
    (at * 7 % 5) as f64
}

/// Nights in `nights/`, with their history next to the folder.
pub(super) struct Nights {
    pub lab: Lab,
    pub history: String,
    /// Whether folders of nights have their results.
    pub with_json: bool,
}

impl Nights {
    pub(super) fn new() -> Self {
        let lab = Lab::new();
        std::fs::create_dir(lab.path("nights")).unwrap();
        let history = lab.text("nights/history.sqlite");
        Self {
            lab,
            history,
            with_json: false,
        }
    }

    /// This many nights; values drop by a fifth from night `change` on.
    pub(super) fn of(count: usize, change: usize) -> Self {
        let all = Self::new();
        all.add(0..count, change, None);
        all
    }

    /// Nights of a golden skin and a camera; the skin's events drop by a fifth from `change` on.
    pub(super) fn add(&self, which: Range<usize>, change: usize, session: Option<&Path>) {
        for at in which {
            let share = if at < change { 1.0 } else { 0.8 };
            let events = share * (1e5 + 1e3 * wobble(at));
            let rate = 2e6 + 1e4 * wobble(at);
            let name = session.and_then(|s| s.file_name()?.to_str());
            let measured = [
                ("golden", "skin", "press_events", "ev/s", events),
                ("idle", "camera1", "data_rate", "B/s", rate),
            ];
            let home = self.append(&night(at, name, &measured));
            if let Some((session, name)) = session.zip(name) {
                std::fs::copy(session, home.join(name)).unwrap();
            }
        }
    }

    /// Nights of an impossibly fast disk that is a million times slower from `change` on.
    pub(super) fn add_disk(&self, which: Range<usize>, change: usize) {
        for at in which {
            let share = if at < change { 1.0 } else { 1e-6 };
            let rate = share * 1e15 * (1.0 + 0.01 * wobble(at));
            let measured = ("disk", "computer", "write_rate", "B/s", rate);
            self.append(&night(at, None, &[measured]));
        }
    }

    /// A night of this day, YYYY-MM-DD.
    pub(super) fn add_dated(&self, day: &str) {
        self.append(&dated(day));
    }

    /// As [`add_dated`](Self::add_dated), in a folder that the history does not have.
    pub(super) fn add_file(&self, day: &str) {
        let dated = dated(day);
        let home = self.lab.path("nights").join(&dated.id);
        std::fs::create_dir(&home).unwrap();
        let json = serde_json::to_vec(&dated).unwrap();
        std::fs::write(home.join("night.json"), json).unwrap();
    }

    /// Adds a night with its page to the history; returns its folder.
    fn append(&self, night: &Night) -> PathBuf {
        let home = self.lab.path("nights").join(&night.id);
        std::fs::create_dir(&home).unwrap();
        std::fs::write(home.join("night.html"), "a page").unwrap();
        if self.with_json {
            let json = serde_json::to_vec(night).unwrap();
            std::fs::write(home.join("night.json"), json).unwrap();
        }
        append(Path::new(&self.history), night, &home).unwrap();
        home
    }

    pub(super) fn trend(&self, more: &[&str]) -> ProgramOutput {
        skinrig(&[&["hil", "trend", &self.history], more].concat())
    }

    pub(super) fn accept(&self, more: &[&str]) -> ProgramOutput {
        skinrig(&[&["hil", "accept", "--history", &self.history], more].concat())
    }

    /// Runs a night of one check that needs no device; returns output and folder.
    pub(super) fn run(&self, more: &[&str]) -> (ProgramOutput, PathBuf) {
        self.run_notifying("", more)
    }

    /// Like [`run`](Self::run), with these lines at the end of the suite.
    pub(super) fn run_notifying(&self, lines: &str, more: &[&str]) -> (ProgramOutput, PathBuf) {
        std::fs::write(self.lab.path("suite.yaml"), format!("{SUITE}{lines}")).unwrap();
        let (suite, out) = (self.lab.text("suite.yaml"), self.lab.text("nights"));
        let rig = "hil/rigs/emulated.yaml";
        let run = ["hil", "run", &*suite, "--rig", rig, "--out", &*out];
        let mut command = program(&[&run[..], more].concat());
        command
            .env("SKINRIG_EMULATED_LIBDRD", "/nowhere/libdrd.so")
            .env("SKINRIG_EMULATED_LAMPS_OFF", "/nowhere/lamps-off")
            .env("SKINRIG_EMULATED_TRIGGER_BOX", "/nowhere/box");
        let ran = run_to_end(command);
        let folder = ran.out.lines().find(|l| l.starts_with(&out));
        let folder = PathBuf::from(folder.unwrap_or_else(|| panic!("no folder: {ran:#?}")));
        (ran, folder)
    }
}
