//! Disk faults at every system call of a run, a seal, two kinds of resume and an analysis: the process is killed before the
//! call or in the middle of it, or the call fails. Afterwards the session is valid, can be resumed to its end, and has a
//! complete history: plan, journal and camera bytes are compared by a program that shares no code with the writer
//! (`history.py`).
//!
//! A preloaded library (`disk.c`) injects the faults. This runs a sample; all several thousand cases run with
//!
//!     SKINRIG_DISK_FAULTS=all cargo test -p skinrig --test commands crash::disk -- --nocapture
#![cfg(target_os = "linux")]
#![expect(
    clippy::print_stderr,
    reason = "says what was skipped and how far it came"
)]

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use skinrig_model::RunEnd;
use skinrig_recorder::{RecorderError, SessionReader};

use super::lab::{SeededRandom, expect, journal, output_text, program, resume, session_in};

const CAMPAIGN: &str = "tests/crash/disk.yaml";
const KINDS: [&str; 6] = ["kill", "torn", "eio", "enospc", "full", "short"];
/// Default number of cases.
const SAMPLE: usize = 20;

/// Task of the program during which the disk fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Task {
    Run,
    /// `resume` of a complete session without a seal.
    Seal,
    /// `resume` of a session that was cut off.
    Resume,
    /// `resume` of a session sealed after a fault, whose seal must be removed.
    Unseal,
    Analyze,
}

const TASKS: [Task; 5] = [
    Task::Run,
    Task::Seal,
    Task::Resume,
    Task::Unseal,
    Task::Analyze,
];

impl Task {
    /// Injected fault that creates the initial session; `None` for a complete one.
    fn before(self) -> Option<&'static str> {
        match self {
            Self::Run | Self::Analyze => None,
            Self::Seal => Some("killed@seal"),
            Self::Resume => Some("killed@journal:12"),
            Self::Unseal => Some("robot-lost@approach:2"),
        }
    }

    fn command(self, folder: &Path, session: Option<&Path>) -> Command {
        match (self, session) {
            (Self::Run, _) => run(folder),
            (Self::Analyze, Some(session)) => {
                program(&[OsStr::new("analyze"), session.as_os_str()])
            }
            (_, Some(session)) => resume(session),
            (_, None) => panic!("a session to begin with"),
        }
    }
}

fn run(folder: &Path) -> Command {
    let mut command = program(&["run", CAMPAIGN, "--no-analysis", "--sessions"]);
    command.arg(folder);
    command
}

/// Data common to all cases.
struct Bench {
    folder: tempfile::TempDir,
    library: PathBuf,
    python: Option<String>,
    /// Initial files of each task.
    before: BTreeMap<Task, PathBuf>,
    /// System calls of each task without faults, one line each.
    calls: BTreeMap<Task, Vec<String>>,
}

impl Bench {
    /// `None` without a C compiler.
    fn get() -> Option<&'static Self> {
        static ONCE: OnceLock<Option<Bench>> = OnceLock::new();
        ONCE.get_or_init(Self::new).as_ref()
    }

    fn new() -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let library = folder.path().join("disk.so");
        let source = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/crash/disk.c");
        let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
        let mut compile = Command::new(compiler);
        compile
            .args(["-O1", "-shared", "-fPIC", "-o"])
            .arg(&library)
            .args([source, "-ldl"]);
        if !compile
            .output()
            .is_ok_and(|created| created.status.success())
        {
            eprintln!("skipped: no C compiler (cc) for the library that makes the disk fail");
            return None;
        }
        let python = std::env::var("SKINRIG_PYTHON")
            .ok()
            .unwrap_or_else(|| "python3".to_owned());
        let works = Command::new(&python)
            .args(["-c", "import sqlite3"])
            .output();
        let python = works.is_ok_and(|o| o.status.success()).then_some(python);
        if python.is_none() {
            eprintln!("skipped: python3 with sqlite3, which checks the histories");
        }
        let mut bench = Self {
            folder,
            library,
            python,
            before: BTreeMap::new(),
            calls: BTreeMap::new(),
        };
        for task in TASKS {
            let before = bench.folder.path().join(format!("{task:?}"));
            std::fs::create_dir(&before).unwrap();
            if task != Task::Run {
                let mut command = run(&before);
                command.args(
                    task.before()
                        .into_iter()
                        .flat_map(|fault| ["--fault", fault]),
                );
                command.output().unwrap();
                assert!(session_in(&before).is_some(), "{task:?}");
            }
            bench.before.insert(task, before);
            let case = tempfile::tempdir().unwrap();
            let output = bench.start(task, case.path(), None);
            assert!(
                output.status.success(),
                "{task:?}: {}",
                output_text(&output)
            );
            let log = std::fs::read_to_string(log_of(case.path())).unwrap();
            bench
                .calls
                .insert(task, log.lines().map(str::to_owned).collect());
        }
        Some(bench)
    }

    /// Starts the task on its files in `case`, with a fault.
    fn start(&self, task: Task, case: &Path, fault: Option<(&str, u64)>) -> Output {
        let folder = folder_of(case);
        std::fs::create_dir(&folder).unwrap();
        for entry in std::fs::read_dir(&self.before[&task]).unwrap() {
            let from = entry.unwrap().path();
            // A killed run leaves its socket.
            if from.is_file() {
                std::fs::copy(&from, folder.join(from.file_name().unwrap())).unwrap();
            }
        }
        let mut command = task.command(&folder, session_in(&folder).as_deref());
        command
            .env("LD_PRELOAD", &self.library)
            .env("SKINRIG_DISK_UNDER", &folder)
            .env("SKINRIG_DISK_LOG", log_of(case));
        if let Some((kind, n)) = fault {
            command.env("SKINRIG_DISK_FAULT", format!("{kind}:{n}"));
        }
        command.output().unwrap()
    }

    /// Runs one case and checks that the session can be resumed to its end. Returns a description of what is wrong.
    fn case(&self, task: Task, kind: &str, n: u64) -> Result<(), String> {
        let case = tempfile::tempdir().unwrap();
        let output = self.start(task, case.path(), Some((kind, n)));
        let log = std::fs::read_to_string(log_of(case.path())).unwrap_or_default();
        let call = log
            .lines()
            .nth(n as usize - 1)
            .unwrap_or("never made")
            .to_owned();
        let named = |what: &str| {
            let text = output_text(&output);
            format!("{task:?}, {kind} at call {n} ({call}): {what}\n{text}")
        };
        let code = output.status.code();
        let may_end = match kind {
            "kill" | "torn" => code.is_none() || code == Some(0),
            _ if task == Task::Analyze => matches!(code, Some(0 | 1)),
            _ => matches!(code, Some(0 | 1 | 3)),
        };
        if !may_end || output_text(&output).contains("panicked") {
            return Err(named("expected another end"));
        }
        let folder = folder_of(case.path());
        let text = String::from_utf8_lossy(&output.stderr);
        let mut reported = text.lines().filter_map(|line| {
            let (n, _) = line.strip_prefix("press ")?.split_once('/')?;
            n.parse::<usize>().ok()
        });
        let reported = reported.next_back().unwrap_or(0);
        let Some(session) = session_in(&folder) else {
            return if reported == 0 && task == Task::Run {
                Ok(())
            } else {
                Err(named("no session"))
            };
        };
        let verify = |session: &Path| {
            let output = program(&[OsStr::new("verify"), session.as_os_str()])
                .output()
                .unwrap();
            (output.status.code(), output_text(&output))
        };
        let (code, text) = verify(&session);
        let empty = SessionReader::open(&session).and_then(|reader| reader.header());
        if matches!(empty, Err(RecorderError::Empty { .. })) {
            let is_nothing = reported == 0 && task == Task::Run && code == Some(2);
            return if is_nothing {
                Ok(())
            } else {
                Err(named(&format!("nothing left: {text}")))
            };
        }
        if code != Some(0) {
            return Err(named(&format!("expected a sound session, found: {text}")));
        }
        let presses = journal(&session).unwrap_or_default();
        let outcomes = presses
            .iter()
            .filter(|(_, attempts)| attempts.iter().any(|a| a.outcome.is_some()))
            .count();
        if task == Task::Run && outcomes < reported {
            return Err(named(&format!(
                "{reported} presses reported, {outcomes} kept"
            )));
        }
        let reader = SessionReader::open(&session).unwrap();
        let completed = matches!(reader.end().unwrap(), Some((_, RunEnd::Completed)));
        let done = completed && text.contains("sound, sealed");
        drop(reader);
        let output = resume(&session).output().unwrap();
        let expected = if done { 2 } else { 0 };
        if output.status.code() != Some(expected) {
            return Err(named(&format!(
                "expected resume to end with {expected}: {}",
                output_text(&output)
            )));
        }
        let (code, text) = verify(&session);
        if code != Some(0) || !text.contains("sound, sealed") {
            return Err(named(&format!("expected a sealed session, found: {text}")));
        }
        if task == Task::Analyze {
            expect(program(&[OsStr::new("analyze"), session.as_os_str()]), 0);
            let names = std::fs::read_dir(&folder).unwrap();
            let names = names.map(|e| e.unwrap().file_name().into_string().unwrap());
            // The catalogue may be missing, or have files beside it.
            let names: Vec<_> = names
                .filter(|name| !name.starts_with("catalogue.sqlite"))
                .collect();
            if names.iter().any(|name| name.contains("partial")) || names.len() != 3 {
                return Err(named(&format!(
                    "expected a session and its results, found {names:?}"
                )));
            }
        }
        self.history(&session).map_err(|wrong| named(&wrong))
    }

    fn history(&self, session: &Path) -> Result<(), String> {
        let Some(python) = &self.python else {
            return Ok(());
        };
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/crash/history.py");
        let checked = Command::new(python)
            .arg(script)
            .arg(session)
            .output()
            .unwrap();
        if checked.status.success() {
            Ok(())
        } else {
            Err(output_text(&checked))
        }
    }
}

fn folder_of(case: &Path) -> PathBuf {
    std::fs::canonicalize(case).unwrap().join("sessions")
}

fn log_of(case: &Path) -> PathBuf {
    case.join("calls")
}

/// The cases to try: all, or the requested number, spread over tasks and kinds.
fn cases(bench: &Bench) -> Vec<(Task, &'static str, u64)> {
    let requested = std::env::var("SKINRIG_DISK_FAULTS").unwrap_or_default();
    if requested == "all" {
        let of = |task: Task| {
            (1..=bench.calls[&task].len() as u64)
                .flat_map(move |n| KINDS.map(|kind| (task, kind, n)))
        };
        return TASKS.into_iter().flat_map(of).collect();
    }
    let mut random = SeededRandom(24);
    let many = requested.parse().unwrap_or(SAMPLE);
    let case = |i: usize| {
        let task = TASKS[i % TASKS.len()];
        let kind = KINDS[i / TASKS.len() % KINDS.len()];
        (
            task,
            kind,
            1 + random.below(bench.calls[&task].len() as u64),
        )
    };
    let sampled: Vec<_> = (0..many).map(case).collect();
    // The index of SQLite's log is a separate, temporary file: without space for it the session is not damaged.
    let index = TASKS.into_iter().flat_map(|task| {
        [("open64", "full"), ("pwrite64", "enospc")].map(|(call, kind)| {
            let is_it = |line: &&String| line.contains(call) && line.ends_with("-shm");
            let place = bench.calls[&task].iter().position(|line| is_it(&line))?;
            Some((task, kind, 1 + place as u64))
        })
    });
    sampled.into_iter().chain(index.flatten()).collect()
}

#[test]
fn a_disk_that_fails_at_any_call_loses_nothing() {
    let Some(bench) = Bench::get() else { return };
    for (task, calls) in &bench.calls {
        eprintln!("{task:?}: {} calls reach the disk", calls.len());
        assert!(calls.len() > 3, "the library sees no calls: {calls:?}");
    }
    let (cases, next) = (cases(bench), AtomicUsize::new(0));
    let wrong: Vec<String> = std::thread::scope(|scope| {
        let work = || {
            let mut wrong = Vec::new();
            while let Some((task, kind, n)) = cases.get(next.fetch_add(1, Ordering::SeqCst)) {
                let found = bench.case(*task, kind, *n).err();
                wrong.extend(found.inspect(|found| eprintln!("{found}")));
            }
            wrong
        };
        let workers = [scope.spawn(work), scope.spawn(work)];
        workers
            .into_iter()
            .flat_map(|w| w.join().unwrap())
            .collect()
    });
    eprintln!("{} cases, {} wrong", cases.len(), wrong.len());
    assert!(
        wrong.is_empty(),
        "{} of {}: {}",
        wrong.len(),
        cases.len(),
        wrong.join("\n")
    );
}

/// The history check detects the corruptions that it is meant for.
#[test]
fn the_check_of_histories_finds_a_press_too_many_and_a_byte_too_few() {
    let Some(bench) = Bench::get() else { return };
    if bench.python.is_none() {
        return;
    }
    let session = session_in(&bench.before[&Task::Analyze]).unwrap();
    bench.history(&session).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for (n, (change, found)) in [
        (
            "UPDATE attempt SET verdict = 'invalid', reason = 'x' WHERE press = 1",
            "last verdict",
        ),
        (
            "UPDATE attempt SET press = 1, number = 2, previous = 1 WHERE press = 2",
            "valid attempts",
        ),
        (
            "UPDATE chunk SET raw_crc32 = raw_crc32 + 1 WHERE camera = 1 AND seq = 1",
            "bytes",
        ),
        (
            "DELETE FROM mark WHERE press = 1 AND kind = 'contact'",
            "trains of kind 2",
        ),
        ("UPDATE press SET role = 'sync' WHERE id = 1", "presses"),
    ]
    .into_iter()
    .enumerate()
    {
        let copy = folder.path().join(format!("{n}.session.sqlite"));
        std::fs::write(&copy, std::fs::read(&session).unwrap()).unwrap();
        let script = "import sqlite3, sys\ndb = sqlite3.connect(sys.argv[1])\ndb.execute(sys.argv[2])\ndb.commit()";
        let mut python = Command::new(bench.python.as_deref().unwrap());
        let changed = python
            .args(["-c", script])
            .arg(&copy)
            .arg(change)
            .output()
            .unwrap();
        assert!(changed.status.success(), "{}", output_text(&changed));
        let wrong = bench.history(&copy).unwrap_err();
        assert!(wrong.contains(found), "{change}: {wrong}");
    }
}
