//! `skinrig run`: protocol -> plan -> controller over a rig -> session -> results.

use std::path::{Path, PathBuf};

use chrono::{DateTime, SecondsFormat, Utc};
use skinrig_controller::{Preflight, Run, RunReport};
use skinrig_device::Rig;
use skinrig_model::{
    AnalysisSettings, CameraId, HostDuration, HostTime, InterruptionKind, InterruptionReason, Look,
    PressVerdict, RunHeader, SimLevel,
};
use skinrig_notify::Notifier;
use skinrig_protocol::{Plan, Protocol};
use skinrig_recorder::{RecorderError, SessionReader, SessionWriter};

use crate::args::RunArgs;
use crate::check;
use crate::conclusion::{close, conclude};
use crate::exit::{Failure, Outcome};
use crate::fault::FaultInjector;
use crate::hil::lease;
use crate::host::host_name;
use crate::looks::LookMode;
use crate::notify::{self, RunMessages};
use crate::paths;
use crate::progress::ProgressView;
use crate::rig::{self, RepeatedOperator, bench, gates, planted};
use crate::sense::SenseMode;
use crate::signals::Operator;
use crate::sink::{ReplayExpectations, SessionSink};
use crate::terminal::Output;
use skinrig_results::RigDocument;
use skinrig_sim::optical::Parts;

/// Header data of a session that do not depend on the rig.
pub(crate) struct RunInputs<'a> {
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
    /// Name of the prototype.
    pub prototype: &'a str,
    /// Name of the operator.
    pub operator: &'a str,
    /// Settings of the analysis.
    pub analysis: &'a AnalysisSettings,
    /// The command line.
    pub command_line: &'a str,
    /// Rig time that the plan should take.
    pub expected: HostDuration,
    /// Facts about the presses that are known before the run.
    pub known: ReplayExpectations,
    /// Injects the faults of the run.
    pub fault_injector: FaultInjector,
    /// How the looks of the plan are taken.
    pub looks: LookMode,
    /// How touches are felt, if the plan wants them felt.
    pub sense: SenseMode,
}

/// Records `plan` on `rig` into a new session in `folder`, after the `preflight`; imports and replays have none, because
/// they have no devices to check. The `notifier` sends messages about the end.
///
/// # Errors
/// [`Failure::internal`] when the session cannot be created. A rig or recorder fault during the run is in the report.
pub(crate) fn record(
    intent: &RunInputs<'_>,
    plan: &Plan,
    mut rig: Rig,
    folder: &Path,
    preflight: Option<Preflight>,
    notifier: Option<Notifier>,
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
        .with_faults(intent.fault_injector.clone())
        .notifying(notifier.map(|notifier| RunMessages::new(notifier, &header)));
    let control = operator.control();
    if preflight.is_some() {
        sink = sink
            .on_disk_of(folder)
            .controlled(&path, control, plan.online.is_some());
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
    let formats = header.stream_formats;
    let mut run = Run::new(plan, header, rig, control, &mut sink)
        .with_settings(settings)
        .looking(intent.looks.at(&path));
    if let Some(online) = plan.online {
        let sense = intent.sense.at(&path, online, formats);
        run = run.feeling(sense.map_err(Failure::internal)?);
    }
    if let Some(mut preflight) = preflight {
        preflight.caller_checks.insert(0, gates::recorder(&path));
        run = run.checked(preflight);
    }
    let report = run.execute();
    close(sink, path, report, operator)
}

/// Creates a new session file; retries if another process took the name.
fn new_session(
    intent: &RunInputs<'_>,
    started: DateTime<Utc>,
    folder: &Path,
) -> Result<(PathBuf, SessionWriter), Failure> {
    loop {
        let path = paths::new_session(folder, started, intent.name, intent.prototype)?;
        match SessionWriter::create(&path) {
            Ok(writer) => return Ok((path, writer)),
            Err(RecorderError::Exists { .. }) => {}
            Err(error) => {
                // A file without a header holds no data: remove it.
                for ending in ["", "-wal", "-shm"] {
                    let mut file = path.clone().into_os_string();
                    file.push(ending);
                    let _ = std::fs::remove_file(file);
                }
                let next = match path.to_str() {
                    Some(_) => "a writable folder with enough space",
                    None => "a folder whose path is UTF-8 text",
                };
                return Err(Failure::internal(format!(
                    "{error}\n  next: choose {next} with --sessions"
                )));
            }
        }
    }
}

fn header(
    intent: &RunInputs<'_>,
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
/// [`Failure`] with the exit code of its kind.
pub(crate) fn run(args: &RunArgs, command_line: &str, output: Output) -> Outcome {
    // Before any device is opened: from then on a robot may be live.
    let operator = Operator::listen().map_err(Failure::internal)?;
    let (session, report) = match (&args.replay, &args.protocol) {
        (Some(recording), _) => replay(recording, &args.sessions, command_line, &operator)?,
        (None, Some(protocol)) => new_run(args, protocol, command_line, output, &operator)?,
        (None, None) => {
            return Err(Failure::input(
                "expected a protocol file or --replay SESSION",
            ));
        }
    };
    conclude(&session, &report, args.no_analysis, args.max_rmse, output)
}

fn new_run(
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
    checked: check::CheckedProtocol,
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
    let notifier = notify::for_run(args.notify.as_deref(), None)?;
    let seed = args.seed.unwrap_or(protocol.seed);
    plan.seed = seed;
    let summary = plan.summary();
    let faults = [&protocol.faults[..], &args.faults].concat();
    if !output.json {
        outln!("{summary}");
        let scene = &protocol.scene;
        let needs = scene.needs.iter().map(|need| need.name().to_owned());
        let tolerances = scene
            .tolerances
            .iter()
            .map(|t| format!("{} within {} {}", t.figure.name(), t.most, t.figure.unit()));
        let twin = scene.twin_of.as_ref().map(|of| format!("the twin of {of}"));
        let parts = twin.or_else(|| Parts::of_paper(&scene.parts).label());
        let needs: Vec<String> = needs.chain(tolerances).chain(parts).collect();
        let needed_for = if needs.is_empty() {
            String::new()
        } else {
            format!(", for {}", needs.join(", "))
        };
        outln!("rig       simulated ({level}{needed_for}), seed {seed}\n");
    }
    if let Some(label) = planted::label(&faults) {
        errln!("warning: {label}\n");
    }
    let (mut rig, watch) = rig::simulated(&protocol, level, seed, args.real_time, &faults)?;
    if level < protocol.scene.level {
        // In the name, so that every report of this session shows it.
        let short = format!(
            "{level}, less than the scene needs: {}",
            protocol.scene.level
        );
        rig.name = rig.name.replacen(level.name(), &short, 1);
        errln!(
            "warning: --level {level} is less than the protocol's scene needs ({}): the data lack what needs that level\n",
            protocol.scene.level
        );
    }
    let preflight = gates::of_simulated(&rig, &args.sessions, summary.expected_bytes);
    let intent = RunInputs {
        fault_injector: FaultInjector::new(&faults, Some(watch)),
        looks: LookMode::of_simulation(args.real_time),
        sense: SenseMode::of_simulation(args.real_time),
        ..intent_of(&protocol, seed, summary.duration_s, command_line)
    };
    record(
        &intent,
        &plan,
        rig,
        &args.sessions,
        Some(preflight),
        notifier,
        operator,
    )
}

/// Runs a protocol on the bench of a rig file, within the limits of the bench.
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
            "\n  {} allows at most {} mm/s, {} N and {} mm; the tighter of its limits and the protocol's apply",
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
    let rig_notify = Some((file.file_name.as_str(), file.notify.as_ref()));
    let notifier = notify::for_run(args.notify.as_deref(), rig_notify)?;
    // Held until the session is closed.
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
        notifier,
        operator,
    );
    tolerated.propose(&file);
    recorded
}

/// Header data for a run of `protocol`.
pub(crate) fn intent_of<'a>(
    protocol: &'a Protocol,
    seed: u64,
    duration_s: f64,
    command_line: &'a str,
) -> RunInputs<'a> {
    RunInputs {
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
        fault_injector: FaultInjector::default(),
        looks: LookMode::default(),
        sense: SenseMode::default(),
    }
}

fn replay(
    recording: &Path,
    folder: &Path,
    command_line: &str,
    operator: &Operator,
) -> Result<(PathBuf, RunReport), Failure> {
    let reader = SessionReader::open_checked(recording).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    // A replay repeats one run of the plan on the recorded clocks; a further leg starts in the middle of the plan.
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
    let intent = RunInputs {
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
        fault_injector: FaultInjector::default(),
        looks: LookMode::Recorded(decision(&reader).map_err(Failure::session)?),
        sense: SenseMode::Recorded(reader.touches().map_err(Failure::session)?),
    };
    let rig = rig::replayed(recording, &header, &document)?;
    record(&intent, &plan, rig, folder, None, None, operator)
}

/// Facts from the recording that no device provides: schedule, exclusions, and the operator's actions.
fn expectations(reader: &SessionReader) -> Result<ReplayExpectations, RecorderError> {
    let outcomes = reader.last_outcomes()?;
    let outcomes = || outcomes.iter().flatten();
    let excluded = outcomes().filter_map(|o| match &o.verdict {
        PressVerdict::Excluded(rule) => Some((o.attempt.press, rule.clone())),
        _ => None,
    });
    // Scheduled times only, relative to the start of the attempt; measured times are measured again.
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
        matches!(i.kind, K::Stop | K::Abort | K::Halt) && decided(&i.reason).is_none()
    });
    Ok(ReplayExpectations {
        scheduled: outcomes().any(|o| o.scheduled),
        timings: timings.collect(),
        excluded: excluded.collect(),
        interruption: ending.map(|i| (i.t, i.kind)),
    })
}

/// When which look ended the recorded run, if one did.
fn decision(reader: &SessionReader) -> Result<Option<(HostTime, Look)>, RecorderError> {
    let rows = reader.interruptions()?;
    Ok(rows.iter().find_map(|i| Some((i.t, decided(&i.reason)?))))
}

fn decided(reason: &InterruptionReason) -> Option<Look> {
    match reason {
        InterruptionReason::End(end) => end.decision().copied(),
        _ => None,
    }
}
