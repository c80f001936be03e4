//! Injected faults, each in each phase of a run: the result matches docs/reference/runs.md, and wrong data never pass as
//! valid.
//!
//! With `SKINRIG_WRITE_DOCS=1` the test writes the table of docs/reference/runs.md instead of comparing it.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on must fail")]

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use skinrig::analysis_request::AnalysisRequest;
use skinrig::fault::FaultInjector;
use skinrig::results::analyze_session;
use skinrig::rig::{self, gates};
use skinrig_analysis::Analysis;
use skinrig_analysis::result::PressResult;
use skinrig_controller::{ControlHandle, RecordSink, RunReport, SinkFault};
use skinrig_model::{CameraId, HostTime, PressId, PressTiming, Record, RigFault, RunEnd, SimLevel};
use skinrig_protocol::{FaultPhase, FaultTime, Plan, PlantedFault, Protocol};
use skinrig_recorder::{SessionReader, SessionWriter, verify};
use skinrig_results::Rescan;
use skinrig_sim::{SimConfig, simulated_rig};
use skinrig_tests::{header, planned};

const SEED: u64 = 11;
const PROTOCOL: &str = "
skinrig: 1
name: faults
operator: tests
prototype: {id: none}
seed: 11
scene: {level: geometric}
sync: {count: 2, interval: 1.5 s, at: [10 mm, 2 mm], pause_after: 1 s}
path:
  points: [[4 mm, 0 mm], [14 mm, 6 mm], [10 mm, -6 mm]]
depth: 1.5 mm
motion: {period: 2 s, hold: 300 ms}
limits:
  workspace: {min: [-40 mm, -48 mm, -4 mm], max: [60 mm, 52 mm, 30 mm]}
  max_depth: 3 mm
  max_speed: 100 mm/s
  max_force: 5 N
triggers: {marks: [contact, retract]}
suspend:
  event_rate: {above: 50 kev/s, resume_below: 20 kev/s}
  temperature: {above: 60 °C, resume_below: 50 degC, for: 0 s}
  resume_after: 1 s
evaluation: {calibrate: [], score: [1]}
analysis: {calibration: none}
";

/// Camera buffer for a slow program: a quarter of a second of an idle stream.
const BUFFER_BYTES: usize = 64 << 10;

/// Phases in order, with the time of a fault in each and the presses completed before it: the first press is a sync press, the
/// third the first scored one, the fifth the last.
const PHASES: [(&str, &str, u64); 10] = [
    ("preflight", "preflight", 0),
    ("arming", "arming", 0),
    ("sync press", "hold:1", 0),
    ("travel", "travel:1", 2),
    ("approach", "approach:3", 2),
    ("contact", "contact:3", 2),
    ("hold", "hold:3", 2),
    ("retract", "retract:3", 2),
    ("between", "between:3", 2),
    ("end", "between:5", 4),
];

/// Faults in the order of the table.
const FAULTS: [&str; 19] = [
    "camera1-unplugged",
    "camera1-stalled",
    "camera1-drops",
    "camera1-storm",
    "camera1-clock-step",
    "camera1-hot",
    "trigger-lost",
    "trigger-doubled",
    "trigger-delayed",
    "box-silent",
    "box-noisy",
    "robot-lost",
    "robot-stalled",
    "robot-slow",
    "robot-force-spike",
    "robot-stale",
    "recorder-slow",
    "disk-full",
    "killed",
];

/// Faults that affect records strike at the first record of the phase in the fault-free run.
fn planted(fault: &str, phase: usize, record: usize) -> PlantedFault {
    let of_records = matches!(fault, "disk-full" | "killed");
    let when = if of_records {
        format!("record:{}", record + 1)
    } else {
        PHASES[phase].1.to_owned()
    };
    format!("{fault}@{when}").parse().unwrap()
}

/// Record sink that can simulate a kill: later records are not written.
struct Sink {
    writer: Option<SessionWriter>,
    injector: FaultInjector,
    killed_at: Option<FaultTime>,
    /// For each record the latest time reported so far.
    record_times: Vec<HostTime>,
    moved: bool,
}

impl RecordSink for Sink {
    fn accept(&mut self, record: Record) -> Result<(), SinkFault> {
        let t = time_of(&record).max(self.record_times.last().copied());
        self.record_times.push(t.unwrap_or_default());
        self.moved |= matches!(record, Record::Command { .. });
        let n = u32::try_from(self.record_times.len()).unwrap();
        if self.killed_at == Some(FaultTime::Nth(FaultPhase::Record, n)) {
            self.writer = None;
        }
        self.injector.before(&record)?;
        match &mut self.writer {
            Some(writer) => writer
                .accept(record)
                .map_err(|e| skinrig::sink::fault_of(&e)),
            None => Ok(()),
        }
    }
}

fn time_of(record: &Record) -> Option<HostTime> {
    match record {
        Record::Command { t, .. } | Record::Intent { t, .. } | Record::Note { t, .. } => Some(*t),
        Record::Chunk(chunk) => Some(chunk.host_time),
        Record::Poses(block) => block.last().map(|s| s.t),
        Record::MarkSent(sent) => Some(sent.t),
        Record::Outcome(outcome) => outcome.timing.map(|t| t.clear),
        _ => None,
    }
}

/// A run and its output.
struct Run {
    report: RunReport,
    path: PathBuf,
    record_times: Vec<HostTime>,
    moved: bool,
    sealed: bool,
}

fn run((protocol, plan): (&Protocol, &Plan), fault: Option<PlantedFault>, path: PathBuf) -> Run {
    let faults: Vec<PlantedFault> = fault.into_iter().collect();
    let mut config = SimConfig::new(SEED, SimLevel::Geometric);
    config.camera_clock.buffer_bytes = BUFFER_BYTES;
    config.camera_clock.chunk_bytes = 16 << 10;
    // Every press of a location gives the same response, so that a repeated press can be compared.
    config.geometric.dead_share = 0.0;
    config.geometric.strength_spread = 0.0;
    config.faults = rig::planted::of_devices(&faults).unwrap();
    let simulated = simulated_rig(&config);
    let header = header(protocol, plan, &simulated).unwrap();
    let preflight = gates::of_simulated(&simulated, path.parent().unwrap(), 1.0);
    let killed = fault.filter(|fault| fault.kind == RigFault::Killed);
    let mut sink = Sink {
        writer: Some(SessionWriter::create(&path).unwrap()),
        injector: FaultInjector::new(if killed.is_some() { &[] } else { &faults }, None),
        killed_at: killed.map(|fault| fault.when),
        record_times: Vec::new(),
        moved: false,
    };
    let control = ControlHandle::new();
    let report = skinrig_controller::Run::new(plan, header, simulated, &control, &mut sink)
        .checked(preflight)
        .execute();
    let seals = killed.is_none() && sink.injector.before_the_seal().is_ok();
    let writer = sink.writer.take();
    let sealed = seals && writer.is_some_and(|writer| writer.finish().is_ok());
    Run {
        report,
        path,
        record_times: sink.record_times,
        moved: sink.moved,
        sealed,
    }
}

/// The fault-free run.
struct FaultFreeRun {
    presses: BTreeMap<PressId, PressResult>,
    recorded: u64,
}

/// Fingerprint of the delivered device data. Equal seeds deliver equal data; a fault that strikes changes it.
fn recorded(reader: &SessionReader) -> u64 {
    let mut hash = DefaultHasher::new();
    for camera in CameraId::ALL {
        let chunks = reader.for_each_chunk(camera, 0, |meta, bytes| {
            (meta.lost_before, bytes).hash(&mut hash);
        });
        chunks.unwrap();
        format!("{:?}", reader.trigger_edges(camera).unwrap()).hash(&mut hash);
    }
    let poses = reader
        .poses(HostTime(i64::MIN), HostTime(i64::MAX))
        .unwrap();
    let delivered = (
        reader.box_reports().unwrap(),
        reader.marks_sent().unwrap(),
        poses,
    );
    format!("{delivered:?}").hash(&mut hash);
    hash.finish()
}

/// Text of a table cell, and what is wrong.
struct Cell {
    words: String,
    reason: String,
    wrong: Vec<String>,
}

/// Evaluates a run with a fault from its session file alone, compared with the fault-free run.
/// `before`: presses completed before the fault; the text gives the number of valid ones where it differs.
fn judge(run: &Run, fault: PlantedFault, before: u64, without: &FaultFreeRun) -> Cell {
    let mut wrong = Vec::new();
    let verified = verify::<Rescan>(&run.path).unwrap();
    if !verified.is_sound() || verified.sealed != run.sealed {
        wrong.push(format!(
            "verify: {:?}, sealed {}",
            verified.problems, verified.sealed
        ));
    }
    let reader = SessionReader::open(&run.path).unwrap();
    let due = recorded(&reader) != without.recorded;
    // No mark follows the last press that could be affected.
    let may_miss = matches!(fault.when, FaultTime::Nth(FaultPhase::Between, 5));
    if !due && !may_miss {
        wrong.push("all that was recorded is as without the fault: it did not strike".into());
    }
    let killed = fault.kind == RigFault::Killed;
    let totals = reader.totals().unwrap();
    for tally in [totals.presses, totals.sync] {
        let counted = tally.valid + tally.missed + tally.invalid + tally.excluded;
        let cut_off = !run.sealed;
        if tally.planned != counted + tally.open() || (tally.open() > 0 && !cut_off) {
            wrong.push(format!("counts: {tally:?}"));
        }
    }
    let valid = totals.presses.valid + totals.sync.valid;
    let attempts: usize = reader.presses().unwrap().iter().map(|(_, a)| a.len()).sum();
    let attempted = reader
        .presses()
        .unwrap()
        .iter()
        .filter(|(_, a)| !a.is_empty())
        .count();
    let retaken = attempts - attempted;
    let report = &run.report;
    if !killed {
        // A robot that stopped answering cannot report that it is disarmed; its own brakes are on.
        if !report.disarmed && fault.kind != RigFault::RobotLost {
            wrong.push("not disarmed".into());
        }
        if matches!(report.end, RunEnd::Completed) && !(report.retracted && report.disarmed) {
            wrong.push("completed, but not at rest".into());
        }
        if run.sealed && valid != report.valid as u64 {
            wrong.push(format!(
                "{valid} valid in the file, {} in the report",
                report.valid
            ));
        }
    }
    let analysis = analyze_session(&run.path, AnalysisRequest::default()).map(|r| r.analysis);
    let usable = analysis.as_ref().is_ok_and(|a| a.is_valid());
    if let Ok(analysis) = &analysis
        && usable
    {
        // A slow robot moves differently, with other events and other measured times.
        let moves_normally = fault.kind != RigFault::RobotSlow;
        wrong.extend(differences(analysis, &without.presses, moves_normally));
    }
    let planned = totals.presses.planned + totals.sync.planned;
    let valid_count = if valid == before {
        String::new()
    } else {
        format!(", {valid} valid")
    };
    let mut words = match (&report.end, killed) {
        (_, true) => format!("cut off{valid_count}"),
        (RunEnd::Faulted(_), _) if !run.moved => "refused".to_owned(),
        (RunEnd::Faulted(_), _) => {
            let place = if report.retracted {
                "at clearance"
            } else {
                "braked"
            };
            format!("ended {place}{valid_count}")
        }
        (RunEnd::Completed, _) if !due => "too late to strike".to_owned(),
        (RunEnd::Completed, _) if !usable => "INVALID session".to_owned(),
        (RunEnd::Completed, _) if valid < planned => format!("{} invalid", planned - valid),
        (RunEnd::Completed, _) => "survived".to_owned(),
        (RunEnd::Stopped(_), _) => "stopped".to_owned(),
    };
    if retaken > 0 {
        let _ = write!(words, ", {retaken} retaken");
    }
    let mut reason = report.end.reason().unwrap_or_default();
    match &analysis {
        Ok(a) => {
            for p in &a.presses {
                if let Some(r) = p.reason() {
                    let _ = write!(reason, " | {}: {r}", p.press);
                }
            }
            if !usable {
                let _ = write!(reason, " | {:?}", a.alignment.violations);
            }
        }
        Err(e) => {
            let _ = write!(reason, " | analysis: {}", e.message);
        }
    }
    Cell {
        words,
        reason,
        wrong,
    }
}

/// Maximum truth error of a press, mm: twice the 0.0049 mm of the worst cell.
const TRUTH_MM: f64 = 0.01;
/// Maximum relative error of its event count: 0.195 in the worst cell.
const EVENTS_SHARE: f64 = 0.25;
/// Maximum error of its estimate, mm: 1.10 mm in the worst cell.
const ESTIMATE_MM: f64 = 1.5;
/// Same for a slow robot, with fewer valid presses: twice the 0.19 mm of the worst cell.
const SLOW_ESTIMATE_MM: f64 = 0.4;

/// Differences of valid presses from the fault-free run, beyond noise.
fn differences(
    analysis: &Analysis,
    without: &BTreeMap<PressId, PressResult>,
    moves_normally: bool,
) -> Vec<String> {
    let mut found = Vec::new();
    for press in analysis
        .presses
        .iter()
        .filter(|p| p.verdict == skinrig_model::Verdict::Valid)
    {
        let fault_free = &without[&press.press];
        let off_mm = press
            .truth
            .zip(fault_free.truth)
            .map(|(a, b)| a.distance_mm(b));
        if off_mm.is_none_or(|off_mm| off_mm > TRUTH_MM) {
            found.push(format!("{}: truth off by {off_mm:?} mm", press.press));
        }
        for (k, (observed, normal)) in press.views.iter().zip(&fault_free.views).enumerate() {
            let (Some(observed), Some(normal)) = (observed, normal) else {
                if observed.is_some() != normal.is_some() {
                    found.push(format!("{}: view {k} is {observed:?}", press.press));
                }
                continue;
            };
            let (n, of) = (f64::from(observed.events), f64::from(normal.events));
            if moves_normally && (n - of).abs() > EVENTS_SHARE * of {
                found.push(format!(
                    "{}: camera {} saw {n} events, without a fault {of}",
                    press.press,
                    k + 1
                ));
            }
        }
        let off_mm = press
            .estimate()
            .zip(fault_free.estimate())
            .map(|(a, b)| a.distance_mm(b));
        let most_mm = if moves_normally {
            ESTIMATE_MM
        } else {
            SLOW_ESTIMATE_MM
        };
        if off_mm.is_some_and(|off_mm| off_mm > most_mm)
            || press.estimate().is_some() != fault_free.estimate().is_some()
        {
            found.push(format!("{}: estimate off by {off_mm:?} mm", press.press));
        }
    }
    found
}

/// Number of the first record of a phase in the fault-free run.
fn record_of(phase: usize, record_times: &[HostTime], timings: &[PressTiming]) -> usize {
    let (sync, press, last) = (timings[0], timings[2], timings[4]);
    let t = match phase {
        0 => return 2,
        1 => {
            let began = timings[0].approach;
            return record_times.iter().position(|t| *t >= began).unwrap() - 3;
        }
        2 => sync.at_depth,
        3 => HostTime(timings[1].clear.0 + 1_010_000_000),
        4 => press.approach,
        5 => press.contact,
        6 => press.at_depth,
        7 => press.retract,
        8 => press.clear,
        _ => last.clear,
    };
    record_times
        .iter()
        .position(|t_record| *t_record >= t)
        .unwrap()
}

#[test]
fn each_fault_in_each_phase_ends_as_documented() {
    let lab = tempfile::tempdir().unwrap();
    let (protocol, plan) = planned(PROTOCOL.trim_start()).unwrap();
    let experiment = (&protocol, &plan);
    let ideal = run(experiment, None, lab.path().join("ideal.session.sqlite"));
    assert_eq!(ideal.report.end, RunEnd::Completed);
    assert_eq!(ideal.report.valid, plan.presses.len());
    let analysis = analyze_session(&ideal.path, AnalysisRequest::default())
        .unwrap()
        .analysis;
    assert!(analysis.is_valid(), "{:?}", analysis.invalid_because());
    let presses: BTreeMap<_, _> = analysis.presses.into_iter().map(|p| (p.press, p)).collect();
    let timings: Vec<PressTiming> = presses.values().filter_map(|p| p.timing).collect();
    let recorded = recorded(&SessionReader::open(&ideal.path).unwrap());
    let without = FaultFreeRun { presses, recorded };

    let cells: Vec<(usize, usize)> = (0..FAULTS.len())
        .flat_map(|f| (0..PHASES.len()).map(move |p| (f, p)))
        .collect();
    let cells: Vec<Cell> = cells
        .into_par_iter()
        .map(|(f, p)| {
            let path = lab.path().join(format!("{}-{p}.session.sqlite", FAULTS[f]));
            let fault = planted(FAULTS[f], p, record_of(p, &ideal.record_times, &timings));
            let run = run(experiment, Some(fault), path);
            let cell = judge(&run, fault, PHASES[p].2, &without);
            std::fs::remove_file(&run.path).unwrap();
            cell
        })
        .collect();

    let mut wrong = Vec::new();
    for (n, cell) in cells.iter().enumerate() {
        let (f, p) = (n / PHASES.len(), n % PHASES.len());
        for words in &cell.wrong {
            wrong.push(format!(
                "{} in {}: {words} ({})",
                FAULTS[f], PHASES[p].0, cell.reason
            ));
        }
    }
    let table = table(&cells);
    assert!(wrong.is_empty(), "wrong data:\n{}", wrong.join("\n"));
    compare(&table);
}

/// Faults with equal outcomes share a row; phases with equal outcomes in succession are named by their ends.
fn table(cells: &[Cell]) -> String {
    let mut rows: Vec<(String, String)> = Vec::new();
    for (name, row) in FAULTS.iter().zip(cells.chunks(PHASES.len())) {
        let mut outcomes: Vec<String> = Vec::new();
        let mut first = 0;
        for spell in row.chunk_by(|a, b| a.words == b.words) {
            let last = first + spell.len() - 1;
            let phases = match spell.len() {
                1 => PHASES[first].0.to_owned(),
                2 => format!("{}, {}", PHASES[first].0, PHASES[last].0),
                _ => format!("{} to {}", PHASES[first].0, PHASES[last].0),
            };
            outcomes.push(format!("{phases}: {}", spell[0].words));
            first = last + 1;
        }
        let outcomes = outcomes.join("; ");
        match rows.iter_mut().find(|(_, same)| *same == outcomes) {
            Some((names, _)) => {
                let _ = write!(names, ", {name}");
            }
            None => rows.push(((*name).to_owned(), outcomes)),
        }
    }
    let mut table = String::from("| fault | outcome by phase |\n|---|---|\n");
    for (names, outcomes) in rows {
        let _ = writeln!(table, "| {names} | {outcomes} |");
    }
    table
}

const BEGIN: &str = "<!-- the table is written by tests/tests/system/faults.rs -->\n";
const END: &str = "<!-- end of the table -->";

fn compare(table: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/reference/runs.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once(BEGIN).unwrap();
    let (documented, after) = rest.split_once(END).unwrap();
    if std::env::var_os("SKINRIG_WRITE_DOCS").is_some() {
        std::fs::write(&path, format!("{before}{BEGIN}{table}{END}{after}")).unwrap();
    } else {
        let next = "SKINRIG_WRITE_DOCS=1 cargo test -p skinrig-tests faults";
        assert_eq!(
            documented, table,
            "docs/reference/runs.md is not up to date; next: {next}"
        );
    }
}
