//! `skinrig run`: protocol -> plan -> controller over a rig -> session -> results.

use std::path::{Path, PathBuf};

use chrono::{DateTime, SecondsFormat, Utc};
use skinrig_controller::{ControllerError, Preflight, Problem, Run, RunReport, SinkFault};
use skinrig_device::Rig;
use skinrig_model::{
    AnalysisSettings, CameraId, HostDuration, HostTime, InterruptionKind, PressRole, PressVerdict,
    RunEnd, RunHeader, SimLevel,
};
use skinrig_protocol::{Plan, PlantedFault, Protocol};
use skinrig_recorder::{RecorderError, SessionReader, SessionWriter};

use crate::args::RunArgs;
use crate::check;
use crate::exit::{Exit, Failure, Outcome};
use crate::fault::FaultInjector;
use crate::hil::lease;
use crate::host::host_name;
use crate::paths;
use crate::progress::ProgressView;
use crate::results::{self};
use crate::rig::{self, RepeatedOperator, bench, gates, planted};
use crate::signals::Operator;
use crate::sink::{ReplayExpectations, SessionSink};
use crate::terminal::Output;
use skinrig_results::RigDocument;

/// What is to be recorded, before the rig adds what it knows.
pub(crate) struct Intent<'a> {
    /// The protocol or schedule, byte for byte.
    pub text: &'a str,
    /// Its file name.
    pub file_name: &'a str,
    /// Short name, for the session's file name.
    pub name: &'a str,
    /// Its SHA-256.
    pub sha256: &'a str,
    /// Overrides from the command line.
    pub overrides: &'a [String],
    /// Seed of the run.
    pub seed: u64,
    /// Which prototype.
    pub prototype: &'a str,
    /// Who.
    pub operator: &'a str,
    /// How to analyse it.
    pub analysis: &'a AnalysisSettings,
    /// The command line.
    pub command_line: &'a str,
    /// Rig time that the plan should take.
    pub expected: HostDuration,
    /// What is known of the presses beforehand.
    pub known: ReplayExpectations,
    /// Faults on purpose.
    pub faults: &'a [PlantedFault],
}

/// Records `plan` on `rig` into a new session in `folder`, after the `preflight` when there is one: an import and a
/// replay have no devices to check.
///
/// # Errors
/// [`Failure::internal`] when the session cannot be made. A rig or recorder fault during the run is in the report.
pub(crate) fn record(
    intent: &Intent<'_>,
    plan: &Plan,
    mut rig: Rig,
    folder: &Path,
    preflight: Option<Preflight>,
    operator: &Operator,
) -> Result<(PathBuf, RunReport), Failure> {
    let outline = &rig.geometry.outline;
    skinrig_analysis::check::before_recording(&plan.presses, intent.analysis, outline)
        .and_then(|()| skinrig_analysis::check::geometry(&rig.geometry))
        .map_err(|e| Failure::input(format!("{}: {e}", intent.file_name)))?;
    let started = Utc::now();
    let started_at = started.to_rfc3339_opts(SecondsFormat::Secs, true);
    let header = header(intent, plan, &rig, &started_at)?;
    let (path, writer) = new_session(intent, started, folder)?;
    let view = if operator.is_attended() {
        ProgressView::new(plan.presses.len(), intent.expected)
    } else {
        ProgressView::hidden(intent.expected)
    };
    let mut sink = SessionSink::new(writer, view, intent.known.clone())
        .with_faults(FaultInjector::new(intent.faults));
    let control = operator.control();
    if preflight.is_some() {
        sink = sink.on_disk_of(folder).controlled(&path, control);
    }
    if let Some((at, kind)) = intent.known.interruption {
        rig.clock = Box::new(RepeatedOperator {
            clock: rig.clock,
            at,
            kind,
            control: control.clone(),
        });
    }

    let mut settings = bench::settings(&rig.kind);
    if intent.known.scheduled {
        settings.camera_lag = None;
    }
    let mut run = Run::new(plan, header, rig, control, &mut sink).with_settings(settings);
    if let Some(mut preflight) = preflight {
        preflight.caller_checks.insert(0, gates::recorder(&path));
        run = run.checked(preflight);
    }
    let report = run.execute();
    close(sink, path, report, operator)
}

/// Seals the session, and tells what went wrong besides. Gives the path under which it is kept: another one when it was moved or
/// removed meanwhile.
pub(crate) fn close(
    sink: SessionSink,
    mut path: PathBuf,
    mut report: RunReport,
    operator: &Operator,
) -> Result<(PathBuf, RunReport), Failure> {
    let mut lost = None;
    if let Err(error) = sink.seal() {
        let is_complete = matches!(error, RecorderError::HeldOpen { .. });
        match &error {
            RecorderError::Rescued { to, .. } => path = shortest(to),
            RecorderError::Lost { .. } => lost = Some(error.to_string()),
            _ => {}
        }
        let error = ControllerError::from(SinkFault::Rejected(error.to_string()));
        if report.end == RunEnd::Completed && !is_complete {
            report.end = RunEnd::Faulted(error.to_string());
            report.causes.push(error);
        } else if !report.causes.contains(&error) {
            // Of a complete run all is on the disk: that its seal is put off is no fault of the run.
            report.problems.push(Problem { doing: "", error });
        }
    }
    operator.run_is_over();
    for problem in &report.problems {
        if !report.causes.contains(&problem.error) {
            errln!("warning: {problem}");
        }
    }
    match lost {
        Some(lost) => Err(Failure::rig(format!(
            "{lost}\n  next: begin again with `skinrig run`, and leave a session where it is until its run has ended"
        ))),
        None => Ok((path, report)),
    }
}

/// A path as people would type it here.
fn shortest(path: &Path) -> PathBuf {
    let here = std::env::current_dir().ok();
    let below = here.and_then(|here| path.strip_prefix(here).ok().map(Path::to_path_buf));
    below.unwrap_or_else(|| path.to_owned())
}

/// A new session file under a name that nobody else took meanwhile.
fn new_session(
    intent: &Intent<'_>,
    started: DateTime<Utc>,
    folder: &Path,
) -> Result<(PathBuf, SessionWriter), Failure> {
    loop {
        let path = paths::new_session(folder, started, intent.name, intent.prototype)?;
        match SessionWriter::create(&path) {
            Ok(writer) => return Ok((path, writer)),
            Err(RecorderError::Exists { .. }) => {}
            Err(error) => {
                // A session without so much as a header is no session: nothing is lost with it.
                for ending in ["", "-wal", "-shm"] {
                    let mut file = path.clone().into_os_string();
                    file.push(ending);
                    let _ = std::fs::remove_file(file);
                }
                return Err(Failure::internal(format!(
                    "{error}\n  next: choose a folder that can be written, with space, with --sessions"
                )));
            }
        }
    }
}

fn header(
    intent: &Intent<'_>,
    plan: &Plan,
    rig: &Rig,
    started_at: &str,
) -> Result<RunHeader, Failure> {
    let description = serde_json::from_str(&rig.description_json).map_err(|e| {
        Failure::internal(format!(
            "expected the description of the rig as JSON, found: {e}"
        ))
    })?;
    let document = RigDocument {
        geometry: rig.geometry,
        analysis: intent.analysis.clone(),
        rig: description,
    };
    Ok(RunHeader {
        protocol_text: intent.text.to_owned(),
        protocol_name: intent.file_name.to_owned(),
        protocol_sha256: intent.sha256.to_owned(),
        overrides: intent.overrides.to_vec(),
        plan_json: serde_json::to_string(plan).map_err(Failure::internal)?,
        plan_sha256: plan.digest(),
        seed: intent.seed,
        rig_kind: rig.kind.clone(),
        rig_name: rig.name.clone(),
        rig_json: serde_json::to_string(&document).map_err(Failure::internal)?,
        robot_from_skin: rig.robot_from_skin,
        stream_formats: CameraId::ALL.map(|c| rig.cameras[c.index()].capabilities().format),
        prototype: intent.prototype.to_owned(),
        operator: intent.operator.to_owned(),
        started_at: started_at.to_owned(),
        host: host_name(),
        software: crate::version::SOFTWARE.to_owned(),
        command_line: intent.command_line.to_owned(),
        presses: plan.presses.clone(),
    })
}

/// `skinrig run`.
///
/// # Errors
/// [`Failure`] with the code that says what kind.
pub(crate) fn run(args: &RunArgs, command_line: &str, output: Output) -> Outcome {
    // Before any device is opened: from then on a robot may be live.
    let operator = Operator::listen().map_err(Failure::internal)?;
    let (session, report) = match (&args.replay, &args.protocol) {
        (Some(recording), _) => replay(recording, &args.sessions, command_line, &operator)?,
        (None, Some(protocol)) => fresh(args, protocol, command_line, output, &operator)?,
        (None, None) => {
            return Err(Failure::input(
                "expected a protocol file or --replay SESSION",
            ));
        }
    };
    conclude(&session, &report, args.no_analysis, args.max_rmse, output)
}

/// Analyses a recorded session, prints its results, and turns the run's end into an exit code.
///
/// # Errors
/// [`Failure`] with the code that says what kind.
pub(crate) fn conclude(
    session: &Path,
    report: &RunReport,
    no_analysis: bool,
    max_rmse_mm: Option<f64>,
    output: Output,
) -> Outcome {
    let analysed = if no_analysis && output.json {
        crate::terminal::print_json(&serde_json::json!({ "files": { "session": session } }));
        Ok(Exit::Ok)
    } else if no_analysis {
        outln!("{}", session.display());
        Ok(Exit::Ok)
    } else {
        analyse(session, max_rmse_mm, output)
    };
    // How the run ended comes first: a failing analysis must not hide a fault of the rig.
    let ended = end_of(session, report);
    if matches!(ended, Ok(None)) {
        return analysed;
    }
    if let Err(failure) = analysed {
        errln!("{}", failure.message);
    }
    match ended? {
        Some(stopped) => {
            errln!("{stopped}");
            Ok(Exit::Stopped)
        }
        None => Ok(Exit::Ok),
    }
}

/// How the run of `session` ended; the operator's stop as the line that says so, `None` when all is well.
///
/// # Errors
/// [`Failure::rig`] for a fault, and for presses that the rig cost.
pub(crate) fn end_of(session: &Path, report: &RunReport) -> Result<Option<String>, Failure> {
    let kept = format!("everything recorded so far is kept: {}", session.display());
    match &report.end {
        RunEnd::Completed => match cost_by_the_rig(session)? {
            Some(cost) => Err(Failure::rig(format!(
                "{cost}\n  the session is kept: {}\n  next: put right what they name (device, cable, disk), then take these presses \
                 again with `skinrig resume {0}`",
                session.display()
            ))),
            None => Ok(None),
        },
        RunEnd::Stopped(reason) => Ok(Some(format!(
            "stopped: {reason}; {kept}\n  next: {}",
            go_on(session)
        ))),
        RunEnd::Faulted(reason) => Err(Failure::rig(format!(
            "{reason}\n  {kept}\n  next: put right what is named above (device, cable, file, disk space), then {}; \
             `skinrig show` lists what was kept",
            go_on(session)
        ))),
    }
}

/// The presses of a completed session that the rig or the operator cost, in words; `None` when there are none, or when no rig can take
/// them again.
fn cost_by_the_rig(session: &Path) -> Result<Option<String>, Failure> {
    const NAMED: usize = 3;
    let reader = SessionReader::open(session).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    let histories = reader.history().map_err(Failure::session)?;
    if !header.is_of_a_rig() {
        return Ok(None);
    }
    let plan: Plan = serde_json::from_str(&header.plan_json).map_err(|e| {
        Failure::rig(format!(
            "{0}: expected the plan that was just carried out, found: {e}
  next: `skinrig verify {0}`",
            session.display()
        ))
    })?;
    let wanted = plan.wanted(&histories);
    let all = plan.presses.iter().zip(&histories).zip(wanted);
    let cost: Vec<_> = all
        .filter(|((press, _), wanted)| *wanted && press.role != PressRole::Sync)
        .map(|((press, known), _)| {
            let reason = known.verdict.as_ref().and_then(PressVerdict::reason);
            format!("{}: {}", press.id, reason.unwrap_or("no verdict".into()))
        })
        .collect();
    if cost.is_empty() {
        return Ok(None);
    }
    let mut words = format!(
        "all of the plan was done, but {} of {} presses are invalid because of the rig, not the skin: {}",
        cost.len(),
        plan.presses.len(),
        cost.iter()
            .take(NAMED)
            .cloned()
            .collect::<Vec<_>>()
            .join("; ")
    );
    if cost.len() > NAMED {
        words += &format!("; and {} more", cost.len() - NAMED);
    }
    Ok(Some(words))
}

/// The next step of a session that was not finished: a rig can go on, an import or a replay begins anew.
fn go_on(session: &Path) -> String {
    let header = SessionReader::open(session).and_then(|reader| reader.header());
    match header {
        Ok(header) if header.is_of_a_rig() => {
            format!("continue with `skinrig resume {}`", session.display())
        }
        _ => "run again".to_owned(),
    }
}

fn analyse(session: &Path, max_rmse_mm: Option<f64>, output: Output) -> Outcome {
    let results = results::analyze_shown(session, results::Choices::default())?;
    let written = results::write_shown(&results, None, None)?;
    results::print_results(&results, output, &written);
    results::check_limit(&results, max_rmse_mm)
}

fn fresh(
    args: &RunArgs,
    protocol: &Path,
    command_line: &str,
    output: Output,
    operator: &Operator,
) -> Result<(PathBuf, RunReport), Failure> {
    let checked = check::load(protocol, &args.overrides)?;
    if let Some(file) = &args.rig {
        return on_bench(args, checked.protocol, file, command_line, output, operator);
    }
    simulated(args, checked, command_line, output, operator)
}

/// Runs a protocol on the simulated rig.
pub(crate) fn simulated(
    args: &RunArgs,
    checked: check::Checked,
    command_line: &str,
    output: Output,
    operator: &Operator,
) -> Result<(PathBuf, RunReport), Failure> {
    let (protocol, mut plan) = (checked.protocol, checked.plan);
    let level = match &args.level {
        Some(name) => name
            .parse::<SimLevel>()
            .map_err(|e| Failure::input(format!("--level: {e}")))?,
        None => protocol.scene.level,
    };
    let seed = args.seed.unwrap_or(protocol.seed);
    plan.seed = seed;
    let summary = plan.summary();
    let faults = [&protocol.faults[..], &args.faults].concat();
    if !output.json {
        outln!("{summary}");
        let needs: Vec<&str> = protocol
            .scene
            .needs
            .iter()
            .map(|need| need.name())
            .collect();
        let needed_for = if needs.is_empty() {
            String::new()
        } else {
            format!(", for {}", needs.join(", "))
        };
        outln!("rig       simulated ({level}{needed_for}), seed {seed}\n");
    }
    if let Some(told) = planted::told(&faults) {
        errln!("warning: {told}\n");
    }
    let mut rig = rig::simulated(&protocol, level, seed, args.real_time, &faults);
    if level < protocol.scene.level {
        // In the name, so that no report of this session can be read without it.
        let short = format!(
            "{level}, less than the scene needs: {}",
            protocol.scene.level
        );
        rig.name = rig.name.replacen(level.name(), &short, 1);
        errln!(
            "warning: --level {level} is less than the protocol's scene needs ({}): what needs it is not in the data\n",
            protocol.scene.level
        );
    }
    let preflight = gates::of_simulated(&rig, &args.sessions, summary.expected_bytes);
    let intent = Intent {
        faults: &faults,
        ..intent_of(&protocol, seed, summary.duration_s, command_line)
    };
    record(
        &intent,
        &plan,
        rig,
        &args.sessions,
        Some(preflight),
        operator,
    )
}

/// Runs a protocol on the bench of a rig file, within what the bench bears.
fn on_bench(
    args: &RunArgs,
    mut protocol: Protocol,
    file: &Path,
    command_line: &str,
    output: Output,
    operator: &Operator,
) -> Result<(PathBuf, RunReport), Failure> {
    let mut file = bench::load(file)?;
    if args.tolerant {
        bench::tolerate(&mut file);
    }
    let faults = [&protocol.faults[..], &args.faults].concat();
    planted::refuse(&faults, &bench::display_name(&file))?;
    bench::tighten(&mut protocol, &file);
    let mut plan = protocol.compile();
    protocol.check(&plan).map_err(|found| {
        let mut failure = Failure::findings(&found);
        let l = &file.limits;
        failure.message.push_str(&format!(
            "\n  {} allows at most {} mm/s, {} N and {} mm; the tighter of its limits and the protocol's hold",
            file.file_name, l.max_speed_mm_s, l.max_force_n, l.max_depth_mm
        ));
        failure
    })?;
    let seed = args.seed.unwrap_or(protocol.seed);
    plan.seed = seed;
    let summary = plan.summary();
    if !output.json {
        outln!("{summary}");
        outln!("rig       {}\n", bench::display_name(&file));
    }
    // Until the session is closed.
    let _lease = lease::take(&file, &format!("run {}", protocol.name))?;
    let (rig, tolerated) = bench::open(&file, &protocol)?;
    let preflight = gates::of_bench(&file, &rig, &args.sessions, summary.duration_s);
    let intent = intent_of(&protocol, seed, summary.duration_s, command_line);
    let recorded = record(
        &intent,
        &plan,
        rig,
        &args.sessions,
        Some(preflight),
        operator,
    );
    tolerated.propose(&file);
    recorded
}

/// What a run of `protocol` is to record.
pub(crate) fn intent_of<'a>(
    protocol: &'a Protocol,
    seed: u64,
    duration_s: f64,
    command_line: &'a str,
) -> Intent<'a> {
    Intent {
        text: &protocol.text,
        file_name: &protocol.file_name,
        name: &protocol.name,
        sha256: &protocol.sha256,
        overrides: &protocol.overrides,
        seed,
        prototype: &protocol.prototype.id,
        operator: &protocol.operator,
        analysis: &protocol.analysis,
        command_line,
        expected: HostDuration::from_secs_f64(duration_s),
        known: ReplayExpectations::default(),
        faults: &[],
    }
}

fn replay(
    recording: &Path,
    folder: &Path,
    command_line: &str,
    operator: &Operator,
) -> Result<(PathBuf, RunReport), Failure> {
    let reader = SessionReader::open(recording).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    // A replay repeats one run of the plan on the tape's own clocks; a further leg begins in the middle of the plan.
    let legs = reader.legs().map_err(Failure::session)?.len();
    if legs > 1 {
        return Err(Failure::input(format!(
            "{}: expected a session of one leg, found {legs} legs, which cannot be replayed\n  \
             next: `skinrig analyze` analyses all of it",
            recording.display()
        )));
    }
    let plan: Plan = serde_json::from_str(&header.plan_json).map_err(|e| {
        Failure::input(format!(
            "{}: expected a plan in the session, found: {e}",
            recording.display()
        ))
    })?;
    let document: RigDocument = serde_json::from_str(&header.rig_json).map_err(|e| {
        Failure::input(format!(
            "{}: expected the description of the rig in the session, found: {e}",
            recording.display()
        ))
    })?;
    let name = header.protocol_name.rsplit('/').next().unwrap_or("replay");
    let name = format!("replay-{}", name.trim_end_matches(".yaml"));
    let expected = reader
        .end()
        .map_err(Failure::session)?
        .map_or(HostDuration::ZERO, |(t, _)| HostDuration(t.0));
    let intent = Intent {
        text: &header.protocol_text,
        file_name: &header.protocol_name,
        name: &name,
        sha256: &header.protocol_sha256,
        overrides: &header.overrides,
        seed: header.seed,
        prototype: &header.prototype,
        operator: &header.operator,
        analysis: &document.analysis,
        command_line,
        expected,
        known: expectations(&reader).map_err(Failure::session)?,
        faults: &[],
    };
    let rig = rig::replayed(recording, &header, &document)?;
    record(&intent, &plan, rig, folder, None, operator)
}

/// What the recording says that no device can: schedule, exclusions, and what the operator did.
fn expectations(reader: &SessionReader) -> Result<ReplayExpectations, RecorderError> {
    let outcomes = reader.last_outcomes()?;
    let outcomes = || outcomes.iter().flatten();
    let excluded = outcomes().filter_map(|o| match &o.verdict {
        PressVerdict::Excluded(rule) => Some((o.attempt.press, rule.clone())),
        _ => None,
    });
    // Of a schedule, since the attempt began; what was measured is measured again.
    let presses = reader.presses()?;
    let attempts = presses.iter().filter_map(|(_, attempts)| attempts.last());
    let timings = attempts.filter_map(|attempt| {
        let outcome = attempt.outcome.as_ref().filter(|o| o.scheduled)?;
        let begun = attempt.intent? - HostTime::ZERO;
        Some((
            attempt.id.press,
            outcome.timing?.after(HostDuration(-begun.0)),
        ))
    });
    let interruptions = reader.interruptions()?;
    let ending = interruptions.last().filter(|i| {
        use InterruptionKind as K;
        matches!(i.kind, K::Stop | K::Abort | K::Halt)
    });
    Ok(ReplayExpectations {
        scheduled: outcomes().any(|o| o.scheduled),
        timings: timings.collect(),
        excluded: excluded.collect(),
        interruption: ending.map(|i| (i.t, i.kind)),
    })
}
