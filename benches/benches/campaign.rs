//! A whole campaign: simulate and record, verify, analyse; time and memory of each stage, and their growth with the events.
//!
//! `SKINRIG_BENCH_REPETITIONS` selects how many of the published ten repetitions run, one campaign per number; default
//! `1,3,10`.
#![expect(clippy::print_stdout, reason = "a bench prints its table")]

use std::ffi::OsString;
use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::Instant;

use skinrig::exit::Exit;
use skinrig_bench::memory::{bytes_read, peak_mb, reset_peak};
use skinrig_recorder::SessionReader;

const PROTOCOL: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../protocols/paper-meander.yaml"
);

/// A stage of the pipeline.
struct Stage {
    what: &'static str,
    seconds: f64,
    /// Peak resident memory of the stage; `None` if the system does not report it.
    peak_mb: Option<f64>,
    /// Bytes read by the process during the stage; `None` if the system does not report it.
    read: Option<u64>,
}

/// Results of one campaign.
struct Campaign {
    events: u64,
    bytes: u64,
    analysing: Stage,
}

fn stage(what: &'static str, work: impl FnOnce()) -> Stage {
    reset_peak();
    let read = bytes_read();
    let start = Instant::now();
    work();
    Stage {
        what,
        seconds: start.elapsed().as_secs_f64(),
        peak_mb: peak_mb(),
        read: bytes_read().zip(read).map(|(now, before)| now - before),
    }
}

/// Runs the program in this process.
fn skinrig(arguments: &[OsString]) {
    let all = std::iter::once("skinrig".into()).chain(arguments.iter().cloned());
    assert_eq!(skinrig::main_with(all), Exit::Ok, "{arguments:?}");
}

/// Protocol overrides for this many repetitions.
fn overrides(repetitions: u32) -> Vec<String> {
    let mut values = vec![format!("repetitions.count={repetitions}")];
    if repetitions == 1 {
        // A single repetition is scored, so none calibrates.
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

/// Writes the bytes of `source` to a new file durably; seconds without the reading.
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
    let expected =
        std::env::var("SKINRIG_BENCH_REPETITIONS").unwrap_or_else(|_| "1,3,10".to_owned());
    let number = |text: &str| match text.trim().parse() {
        Ok(n @ 1..=10) => n,
        _ => panic!("SKINRIG_BENCH_REPETITIONS: numbers from 1 to 10, as 1,3,10; not {text:?}"),
    };
    let campaigns: Vec<Campaign> = expected.split(',').map(number).map(campaign).collect();
    growth(&campaigns);
}

/// Growth of the analysis with the events.
fn growth(campaigns: &[Campaign]) {
    println!("\nanalyse and report, by the events of a session");
    for (i, c) in campaigns.iter().enumerate() {
        let (mev, ms) = (c.events as f64 / 1e6, 1e3 * c.analysing.seconds);
        let memory = c
            .analysing
            .peak_mb
            .map_or(String::new(), |mb| format!("  peak {mb:.0} MB"));
        let times_read =
            |read: u64| format!("  {:.2} x the session read", read as f64 / c.bytes as f64);
        let read = c.analysing.read.map_or(String::new(), times_read);
        // Relative to the previous campaign: cost of each further event, and exponent of time over events, 1 if
        // proportional.
        let grown = i
            .checked_sub(1)
            .and_then(|before| campaigns.get(before))
            .map(|before| {
                let further = c.events as f64 - before.events as f64;
                let power = libm::log(c.analysing.seconds / before.analysing.seconds)
                    / libm::log(c.events as f64 / before.events as f64);
                let each = 1e9 * (c.analysing.seconds - before.analysing.seconds) / further;
                format!("  {each:.0} ns per further event, power {power:.2}")
            });
        println!(
            "  {mev:>8.1} Mev  {ms:>8.0} ms  {:>6.0} ns per event{memory}{read}{}",
            ms / mev,
            grown.unwrap_or_default()
        );
    }
}

/// Runs a campaign with this many repetitions.
fn campaign(repetitions: u32) -> Campaign {
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
        read: None,
    };
    for Stage {
        what,
        seconds,
        peak_mb,
        ..
    } in [&recording, &verifying, &analysing, &total]
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
    let reader = SessionReader::open(&session).expect("the session");
    Campaign {
        events: reader.totals().expect("the session").cd_events,
        bytes,
        analysing,
    }
}
