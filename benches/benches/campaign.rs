//! A whole campaign in one run: simulate and record, verify, analyse; seconds and memory of each.
//!
//! `SKINRIG_BENCH_REPETITIONS` sets how many of the published ten repetitions are run; 1 when absent.
#![expect(clippy::print_stdout, reason = "a bench prints its table")]

use std::ffi::OsString;
use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::Instant;

use skinrig::exit::Exit;
use skinrig_bench::memory::{peak_mb, reset_peak};

const PROTOCOL: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../protocols/paper-meander.yaml"
);

/// One part of the pipeline.
struct Stage {
    what: &'static str,
    seconds: f64,
    /// Largest resident memory during the part; `None` where the system does not say.
    peak_mb: Option<f64>,
}

fn stage(what: &'static str, work: impl FnOnce()) -> Stage {
    reset_peak();
    let start = Instant::now();
    work();
    Stage {
        what,
        seconds: start.elapsed().as_secs_f64(),
        peak_mb: peak_mb(),
    }
}

/// Runs the program in this process.
fn skinrig(arguments: &[OsString]) {
    let all = std::iter::once("skinrig".into()).chain(arguments.iter().cloned());
    assert_eq!(skinrig::main_with(all), Exit::Ok, "{arguments:?}");
}

/// The protocol's overrides for this many repetitions.
fn overrides(repetitions: u32) -> Vec<String> {
    let mut values = vec![format!("repetitions.count={repetitions}")];
    if repetitions == 1 {
        // There is none to calibrate with besides the scored one.
        values.push("evaluation.calibrate=[]".into());
        values.push("evaluation.score=[1]".into());
        values.push("analysis.calibration=none".into());
    } else {
        values.push(format!("evaluation.score=[2-{repetitions}]"));
    }
    values
}

fn session_in(folder: &Path) -> PathBuf {
    let files = std::fs::read_dir(folder).expect("the sessions folder");
    files
        .filter_map(|f| f.ok().map(|f| f.path()))
        .find(|p| p.to_string_lossy().ends_with(".session.sqlite"))
        .expect("a session")
}

/// Writes the bytes of `source` to a new file and makes them durable; seconds without the reading.
fn plain_write(source: &Path, target: &Path) -> f64 {
    let mut from = File::open(source).expect("the session");
    let mut to = File::create(target).expect("a new file");
    let mut buffer = vec![0; 1 << 20];
    let mut seconds = 0.0;
    loop {
        let n = from.read(&mut buffer).expect("readable");
        let start = Instant::now();
        if n == 0 {
            to.sync_all().expect("room on the disk");
            return seconds + start.elapsed().as_secs_f64();
        }
        to.write_all(&buffer[..n]).expect("room on the disk");
        seconds += start.elapsed().as_secs_f64();
    }
}

fn main() {
    let repetitions = match std::env::var("SKINRIG_BENCH_REPETITIONS") {
        Ok(text) => text
            .parse()
            .expect("SKINRIG_BENCH_REPETITIONS: a number from 1 to 10"),
        Err(_) => 1,
    };
    let overrides = overrides(repetitions);
    let checked = skinrig::check::load(Path::new(PROTOCOL), &overrides)
        .unwrap_or_else(|failure| panic!("{}", failure.message));
    let summary = checked.plan.summary();
    let folder = tempfile::tempdir().expect("a temporary folder");

    let mut run: Vec<OsString> = vec!["run".into(), PROTOCOL.into(), "--no-analysis".into()];
    run.extend(["--sessions".into(), folder.path().into()]);
    for value in &overrides {
        run.extend(["--set".into(), value.into()]);
    }
    let recording = stage("simulate and record", || skinrig(&run));
    let session = session_in(folder.path());
    let bytes = std::fs::metadata(&session).expect("the session").len();
    let path = OsString::from(&session);
    let verifying = stage("verify", || skinrig(&["verify".into(), path.clone()]));
    let analysing = stage("analyse and report", || {
        skinrig(&["analyze".into(), path.clone()])
    });
    let plain_s = plain_write(&session, &folder.path().join("plain"));

    println!(
        "\ncampaign: {repetitions} repetition(s), {} presses, {:.0} s on a real rig; session file {:.1} MB",
        checked.plan.presses.len(),
        summary.duration_s,
        bytes as f64 / 1e6
    );
    let total = Stage {
        what: "all",
        seconds: recording.seconds + verifying.seconds + analysing.seconds,
        peak_mb: None,
    };
    for Stage {
        what,
        seconds,
        peak_mb,
    } in [recording, verifying, analysing, total]
    {
        let memory = peak_mb.map_or(String::new(), |mb| format!("  peak {mb:.0} MB resident"));
        println!(
            "  {what:20}  {seconds:>8.2} s  {:>8.0} x real time  {:>7.1} x the plain write{memory}",
            summary.duration_s / seconds,
            seconds / plain_s
        );
    }
    println!(
        "  {:20}  {plain_s:>8.2} s  baseline: {:.0} MB/s, sequential, one fsync at the end",
        "plain write",
        bytes as f64 / 1e6 / plain_s
    );
    println!(
        "  method: one run of the commands run, verify and analyze in one process, the file system as it is; the \
         plain write is of the session's own bytes"
    );
}
