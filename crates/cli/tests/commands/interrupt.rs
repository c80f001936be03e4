//! Interrupted runs: by operator, system, kill or full disk.
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, Stdio};

use serde_json::Value;

use crate::replay::assert_replays;
use crate::support::{Lab, ROOT, SMALL, files, only, program, run_to_end, show, skinrig, text};

/// A run in real time that goes on for more than a minute, so that it does not end by itself while a test is looking at it. It
/// reports a tenth of its presses: a longer one would report its first press later.
const LIVE: [&str; 7] = [
    "run",
    SMALL,
    "--real-time",
    "--set",
    "repetitions.count=10",
    "--set",
    "evaluation.score=[1-10]",
];
/// Its presses: two sync presses and four locations.
pub(crate) const LIVE_PRESSES: u64 = 2 + 10 * 4;

/// A running program, past its first press.
pub(crate) struct LiveRun {
    child: Child,
    lines: BufReader<ChildStderr>,
}

impl LiveRun {
    pub(crate) fn new(folder: &Path) -> Self {
        let mut command = program(&LIVE);
        command.arg("--sessions").arg(folder);
        Self::of(command)
    }

    pub(crate) fn of(mut command: Command) -> Self {
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stderr.take().unwrap());
        let mut run = Self { child, lines };
        run.wait_for("press ");
        run
    }

    /// Reads messages up to one that contains `word`.
    #[track_caller]
    pub(crate) fn wait_for(&mut self, word: &str) {
        let mut line = String::new();
        while !line.contains(word) {
            line.clear();
            let n = self.lines.read_line(&mut line).unwrap();
            assert!(n > 0, "the program ended before it said {word:?}");
        }
    }

    pub(crate) fn signal(&self, name: &str) {
        let pid = self.child.id().to_string();
        let sent = Command::new("kill")
            .args([format!("-{name}"), pid])
            .status()
            .unwrap();
        assert!(sent.success());
    }

    /// Waits for the exit; returns the exit code (`None` if killed) and the remaining messages.
    pub(crate) fn end(mut self) -> (Option<i32>, String) {
        let mut rest = String::new();
        while self.lines.read_line(&mut rest).unwrap() > 0 {}
        (self.child.wait().unwrap().code(), rest)
    }
}

fn count(shown: &Value, verdict: &str) -> u64 {
    shown["presses"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|p| p["verdict"] == verdict)
        .count() as u64
}

/// Asserts that the session ended early but properly: sealed, sound, every press with a verdict.
#[track_caller]
fn assert_ended_early(folder: &Path, word: &str) -> PathBuf {
    let session = only(folder, ".session.sqlite");
    let shown = show(&session);
    assert_eq!(shown["end"], "stopped", "{shown}");
    assert!(
        shown["end_reason"].as_str().unwrap().contains(word),
        "{shown}"
    );
    assert_eq!(shown["sealed"], true);
    assert!(count(&shown, "valid") >= 1, "{shown}");
    assert!(count(&shown, "missed") >= 1, "{shown}");
    assert_eq!(
        count(&shown, "valid") + count(&shown, "missed") + count(&shown, "invalid"),
        LIVE_PRESSES,
        "{shown}"
    );
    assert!(!shown["interruptions"].as_array().unwrap().is_empty());
    let verified = skinrig(&["verify", &text(&session)]).code(0).out;
    assert!(verified.contains("sound, sealed"), "{verified}");
    let listed = skinrig(&["sessions", &text(folder)]).code(0).out;
    assert!(listed.contains("(stopped)"), "{listed}");
    session
}

#[test]
fn ctrl_c_ends_the_run_after_the_press_with_a_sealed_session() {
    let lab = Lab::new();
    let run = LiveRun::new(&lab.path("s"));
    run.signal("INT");
    let (code, messages) = run.end();
    assert_eq!(code, Some(5), "{messages}");
    assert!(messages.contains("stopping after this press"), "{messages}");
    assert!(messages.contains("kept"), "{messages}");
    let repeated = messages.lines().filter(|l| l.starts_with("press ")).count();
    assert!(
        repeated <= 1,
        "presses that were not made are no progress: {messages}"
    );
    let session = assert_ended_early(&lab.path("s"), "stop");
    // The recorded part is an ordinary session; its replay stops at the same point.
    assert_replays(&lab, &session, "r");
}

#[test]
fn ctrl_c_twice_retracts_and_stops_at_once() {
    let lab = Lab::new();
    let mut run = LiveRun::new(&lab.path("s"));
    run.signal("INT");
    run.wait_for("stopping after this press");
    run.signal("INT");
    let (code, messages) = run.end();
    assert_eq!(code, Some(5), "{messages}");
    let session = assert_ended_early(&lab.path("s"), "");
    assert_replays(&lab, &session, "r");
}

/// ctrl-\ and an exceeded CPU time limit retract at once, like the second ctrl-C.
#[test]
fn signals_that_end_a_program_at_once_retract() {
    for signal in ["QUIT", "XCPU"] {
        let lab = Lab::new();
        let run = LiveRun::new(&lab.path("s"));
        run.signal(signal);
        let (code, messages) = run.end();
        assert_eq!(code, Some(5), "{signal}: {messages}");
        assert!(
            messages.contains("retracting and stopping now"),
            "{signal}: {messages}"
        );
        assert_ended_early(&lab.path("s"), "");
    }
}

#[test]
fn ctrl_c_three_times_switches_the_motors_off_and_seals() {
    let lab = Lab::new();
    // Between presses a stop would end the run before the second ctrl-C, so the tip must be in the skin for some seconds.
    let folder = lab.text("s");
    let mut arguments = [&LIVE[..], &["--no-analysis"]].concat();
    for set in ["motion.hold=3s", "motion.period=5s", "sync.interval=5s"] {
        arguments.extend(["--set", set]);
    }
    arguments.extend(["--sessions", &folder]);
    let mut run = LiveRun::of(program(&arguments));
    let in_the_skin = || {
        let found = skinrig(&["status", "--json", &folder]).code(0).json();
        let z_mm = found["live"]["tip_mm"][2].as_f64();
        z_mm.is_some_and(|z_mm| z_mm < -1.0)
    };
    while !in_the_skin() {
        let ended = run.child.try_wait().unwrap();
        assert!(ended.is_none(), "{ended:?}");
    }
    for word in ["stopping after this press", "retracting", "motors off"] {
        run.signal("INT");
        run.wait_for(word);
    }
    let (code, messages) = run.end();
    assert_eq!(code, Some(5), "{messages}");
    let session = assert_ended_early(&lab.path("s"), "operator: ");
    let kinds: Vec<String> = show(&session)["interruptions"]
        .as_array()
        .unwrap()
        .iter()
        .map(|i| i[1].as_str().unwrap().to_owned())
        .collect();
    // Of requests within one controller tick only the most severe takes effect, and a fast
    // retraction may finish before the third signal.
    let last = kinds.last().map(String::as_str);
    assert!(matches!(last, Some("halt" | "abort")), "{kinds:?}");
}

#[test]
fn nohup_is_respected() {
    let lab = Lab::new();
    let mut command = Command::new("sh");
    command.current_dir(ROOT).args([
        "-c",
        &format!(
            "trap '' HUP; exec '{}' {} --no-analysis --sessions '{}'",
            env!("CARGO_BIN_EXE_skinrig"),
            LIVE.join(" "),
            lab.text("s")
        ),
    ]);
    let mut run = LiveRun::of(command);
    run.signal("HUP");
    run.wait_for("press ");
    // The run continues and handles other signals.
    run.signal("TERM");
    let (code, messages) = run.end();
    assert_eq!(code, Some(5), "{messages}");
    assert_eq!(
        messages.matches("stopping after this press").count(),
        1,
        "{messages}"
    );
}

#[test]
fn a_polite_end_by_the_system_stops_as_ctrl_c_does() {
    // The run inherits `nohup` from the tests.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|l| l.strip_prefix("SigIgn:"));
    let mask = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    let signals: &[&str] = if mask.is_some_and(|mask| mask & 1 != 0) {
        eprintln!("skipped: HUP, which was ignored when the tests were started");
        &["TERM", "USR1"]
    } else {
        &["TERM", "HUP", "USR1"]
    };
    for signal in signals {
        let lab = Lab::new();
        let run = LiveRun::new(&lab.path("s"));
        run.signal(signal);
        let (code, messages) = run.end();
        assert_eq!(code, Some(5), "{signal}: {messages}");
        assert_ended_early(&lab.path("s"), "");
    }
}

#[test]
fn a_killed_run_leaves_a_session_that_opens() {
    let lab = Lab::new();
    // The first press is reported as done, so it is on the disk.
    let run = LiveRun::new(&lab.path("s"));
    run.signal("KILL");
    let (code, _) = run.end();
    assert_eq!(code, None);
    let session = only(&lab.path("s"), ".session.sqlite");
    let shown = show(&session);
    assert_eq!(shown["end"], Value::Null);
    assert_eq!(shown["sealed"], false);
    assert!(
        count(&shown, "valid") >= 1,
        "the first press was committed: {shown}"
    );
    assert!(shown["totals"]["cd_events"].as_u64().unwrap() > 0);
    let words = skinrig(&["show", &text(&session)]).code(0).out;
    assert!(
        words.contains("cut off; `skinrig resume` continues it") && words.contains("NOT SEALED"),
        "{words}"
    );
    let verified = skinrig(&["verify", &text(&session)]).code(0).out;
    let presses = format!(
        "; {} of {LIVE_PRESSES} planned presses,",
        count(&shown, "valid") + count(&shown, "invalid")
    );
    assert!(
        verified.contains("sound, but not sealed") && verified.contains(&presses),
        "{verified}"
    );
    let listed = skinrig(&["sessions", &lab.text("s")]).code(0).out;
    assert!(listed.contains("cut off"), "{listed}");
    skinrig(&["analyze", &text(&session)]).code(0);
    skinrig(&[
        "export",
        &text(&session),
        "--to",
        "all",
        "--out",
        &lab.text("e"),
    ])
    .code(0);
}

/// Runs the campaign with files limited to `blocks` of 512 bytes: like a full disk, plus SIGXFSZ, which kills by default.
fn on_a_full_disk(folder: &str, blocks: u32) -> crate::support::ProgramOutput {
    let mut command = Command::new("sh");
    command.current_dir(ROOT).args([
        "-c",
        &format!(
            "ulimit -f {blocks}; exec '{}' run {SMALL} --no-analysis --sessions '{folder}'",
            env!("CARGO_BIN_EXE_skinrig")
        ),
    ]);
    run_to_end(command)
}

#[test]
fn a_disk_that_fills_up_stops_the_run_which_can_be_resumed() {
    // The amount written before the first press is unspecified: raise the limit until some of it fits.
    for blocks in (1_000..40_000).step_by(1_000) {
        let lab = Lab::new();
        let run_output = on_a_full_disk(&lab.text("s"), blocks);
        if run_output.code == Some(1) {
            continue;
        }
        run_output
            .code(3)
            .expect_stderr(&["recorder", "kept", "next:"]);
        let session = only(&lab.path("s"), ".session.sqlite");
        // The disk was full before the header: an empty session.
        let header = skinrig(&["show", &text(&session)]);
        if header.code != Some(0) {
            header.code(2).expect_stderr(&["without records"]);
            continue;
        }
        let shown = show(&session);
        assert_ne!(shown["end"], "completed");
        let verified = skinrig(&["verify", &text(&session)]).code(0).out;
        assert!(verified.contains("not sealed"), "{verified}");
        if shown["totals"]["cd_events"].as_u64().unwrap() > 0 {
            // With space available it resumes.
            skinrig(&["resume", &text(&session), "--no-analysis"]).code(0);
            let shown = show(&session);
            assert_eq!(
                (&shown["end"], &shown["sealed"]),
                (&"completed".into(), &true.into())
            );
            let verified = skinrig(&["verify", &text(&session)]).code(0).out;
            assert!(verified.contains("sound, sealed"), "{verified}");
            return;
        }
    }
    panic!("expected a limit that is met after the first chunk of events");
}

#[test]
fn a_disk_that_is_full_from_the_start_ends_with_code_1_and_a_next_step() {
    let lab = Lab::new();
    on_a_full_disk(&lab.text("s"), 100)
        .code(1)
        .expect_stderr(&["next:"]);
    // No files remain.
    let left = files(&lab.path("s"), "");
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn a_disconnected_reader_does_not_stop_the_run() {
    let lab = Lab::new();
    let folder = lab.text("s");
    // `skinrig run ... 2>&1 | head -1`: both outputs closed after the first line.
    let mut command = program(&["run", SMALL, "--sessions", &folder]);
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap())
        .read_line(&mut line)
        .unwrap();
    assert!(line.starts_with("plan"), "{line}");
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let shown = show(&only(&lab.path("s"), ".session.sqlite"));
    assert_eq!(
        (&shown["end"], &shown["sealed"]),
        (&"completed".into(), &true.into())
    );

    // `skinrig show ... | head -1` is not an error.
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    let mut command = program(&["show", &session, "--presses"]);
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
}

#[test]
fn output_that_cannot_be_written_is_an_error() {
    let Ok(full) = std::fs::File::create("/dev/full") else {
        eprintln!("skipped: this system has no /dev/full");
        return;
    };
    let mut command = program(&["plan", SMALL, "--steps"]);
    let output = command
        .stdout(full)
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
        .wait_with_output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("standard output"),
        "{output:?}"
    );
}
