//! The end of a run, import or replay: seals the session, analyses it, and turns the outcome into an exit code.

use std::path::{Path, PathBuf};

use skinrig_controller::{Problem, RunFault, RunReport, SinkFault};
use skinrig_model::{PressRole, PressVerdict, RunEnd, StopReason};
use skinrig_protocol::{Plan, PlantedFault};
use skinrig_recorder::{RecorderError, SessionReader};

use crate::analysis_request::AnalysisRequest;
use crate::exit::{Exit, Failure, Outcome};
use crate::paths::shell_path;
use crate::results;
use crate::signals::Operator;
use crate::sink::SessionSink;
use crate::terminal::Output;

/// Sends messages about the end of the run, seals the session and prints further problems. Returns the path of the session, which differs if the file was moved or
/// removed during the run.
pub(crate) fn close(
    mut sink: SessionSink,
    mut path: PathBuf,
    mut report: RunReport,
    operator: &Operator,
) -> Result<(PathBuf, RunReport), Failure> {
    sink.notify(&report, &path);
    let never_struck = sink.faults_never_struck();
    let mut lost = None;
    if let Err(error) = sink.seal() {
        let is_complete = matches!(error, RecorderError::HeldOpen { .. });
        match &error {
            RecorderError::Rescued { to, .. } => path = shortest(to),
            RecorderError::Lost { .. } => lost = Some(error.to_string()),
            _ => {}
        }
        let error = RunFault::from(SinkFault::Rejected(error.to_string()));
        if report.end.is_complete() && !is_complete {
            report.end = RunEnd::fault(error);
        } else if !report.end.faults().contains(&error) {
            // The data of a complete run are on the disk: a missing seal is not a fault of the run.
            report.problems.push(Problem { doing: "", error });
        }
    }
    operator.run_is_over();
    for problem in &report.problems {
        if !report.end.faults().contains(&problem.error) {
            errln!("warning: {problem}");
        }
    }
    if lost.is_none() && report.end.is_complete() && !never_struck.is_empty() {
        return Err(faults_missed(&never_struck, &path));
    }
    match lost {
        Some(lost) => Err(Failure::rig(format!(
            "{lost}\n  next: start again with `skinrig run`, and do not move a session before its run has ended"
        ))),
        None => Ok((path, report)),
    }
}

/// A rehearsal whose faults did not all occur shows nothing about them.
fn faults_missed(faults: &[PlantedFault], session: &Path) -> Failure {
    let names: Vec<String> = faults.iter().map(ToString::to_string).collect();
    Failure::input(format!(
        "expected every injected fault to occur, but the run ended without {}\n  the session is kept: {}\n  next: choose \
         times that the run reaches; `skinrig plan` lists its presses",
        names.join(", "),
        session.display()
    ))
}

/// The path relative to the current folder, if it is inside.
fn shortest(path: &Path) -> PathBuf {
    let current = std::env::current_dir().ok();
    let below = current.and_then(|current| path.strip_prefix(current).ok().map(Path::to_path_buf));
    below.unwrap_or_else(|| path.to_owned())
}

/// Analyses a recorded session, prints its results, and turns the run's end into an exit code.
///
/// # Errors
/// [`Failure`] with the exit code of its kind.
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
    crate::catalogue::automatic::register(session);
    // The end of the run takes precedence: a failed analysis must not hide a rig fault.
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

/// How the run of `session` ended: the message for a stop by the operator, `None` for success.
///
/// # Errors
/// [`Failure::rig`] for a fault, for presses lost to rig faults, and for a device that failed at the end.
pub(crate) fn end_of(session: &Path, report: &RunReport) -> Result<Option<String>, Failure> {
    let kept_message = format!("everything recorded so far is kept: {}", session.display());
    match &report.end {
        RunEnd::Stopped(StopReason::Decided(_)) => Ok(None),
        RunEnd::Completed => match presses_lost_to_the_rig(session)? {
            Some(lost) => Err(Failure::rig(format!(
                "{lost}\n  the session is kept: {}\n  next: fix the cause that they name (device, cable, disk), then repeat these presses \
            with `skinrig resume {on}`",
                session.display(),
                on = shell_path(session)
            ))),
            None => match device_problem(session, report)? {
                Some(problem) => Err(Failure::rig(format!(
                    "{problem}\n  all presses of the plan are done, and the session is kept: {}\n  next: check that device before \
                     the next run; `skinrig show {on}` lists what was kept",
                    session.display(),
                    on = shell_path(session)
                ))),
                None => Ok(None),
            },
        },
        RunEnd::Stopped(reason) => Ok(Some(format!(
            "stopped: {reason}; {kept_message}\n  next: {}",
            next_step(session)
        ))),
        RunEnd::Faulted(causes) => Err(Failure::rig(format!(
            "{causes}\n  {kept_message}\n  next: fix the cause named above (device, cable, file, disk space), then {}; \
             `skinrig show` lists what was kept",
            next_step(session)
        ))),
    }
}

/// A device of a rig that failed at the end of the run. A file of an import or replay is not a device.
fn device_problem<'a>(
    session: &Path,
    report: &'a RunReport,
) -> Result<Option<&'a Problem>, Failure> {
    let is_of_a_device = |p: &&Problem| matches!(p.error, RunFault::Device(_));
    let Some(problem) = report.problems.iter().find(is_of_a_device) else {
        return Ok(None);
    };
    let reader = SessionReader::open(session).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    Ok(header.is_of_a_rig().then_some(problem))
}

/// Lists the presses of a completed session that were lost to the rig or the operator; `None` if there are none, or if no rig can
/// repeat them.
fn presses_lost_to_the_rig(session: &Path) -> Result<Option<String>, Failure> {
    const NAMED: usize = 3;
    let reader = SessionReader::open(session).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    let histories = reader.history().map_err(Failure::session)?;
    if !header.is_of_a_rig() {
        return Ok(None);
    }
    let plan: Plan = serde_json::from_str(&header.plan_json).map_err(|e| {
        Failure::rig(format!(
            "{0}: expected the plan that was just executed, found: {e}
  next: `skinrig verify {on}`",
            session.display(),
            on = shell_path(session)
        ))
    })?;
    let pending = plan.pending(&histories);
    let all = plan.presses.iter().zip(&histories).zip(pending);
    let lost: Vec<_> = all
        .filter(|((press, _), pending)| *pending && press.role != PressRole::Sync)
        .map(|((press, known), _)| {
            let reason = known.verdict.as_ref().and_then(PressVerdict::reason);
            format!(
                "{}: {}",
                press.id,
                reason.unwrap_or_else(|| "no verdict".to_owned())
            )
        })
        .collect();
    if lost.is_empty() {
        return Ok(None);
    }
    let mut words = format!(
        "the plan is complete, but {} of {} presses are invalid because of the rig, not the skin: {}",
        lost.len(),
        plan.presses.len(),
        lost.iter()
            .take(NAMED)
            .cloned()
            .collect::<Vec<_>>()
            .join("; ")
    );
    if lost.len() > NAMED {
        words += &format!("; and {} more", lost.len() - NAMED);
    }
    Ok(Some(words))
}

/// Next step for an unfinished session: resume on a rig, repeat an import or a replay.
fn next_step(session: &Path) -> String {
    let header = SessionReader::open(session).and_then(|reader| reader.header());
    match header {
        Ok(header) if header.is_of_a_rig() => {
            format!("continue with `skinrig resume {}`", shell_path(session))
        }
        _ => "run again".to_owned(),
    }
}

fn analyse(session: &Path, max_rmse_mm: Option<f64>, output: Output) -> Outcome {
    let results = results::analyze_shown(session, AnalysisRequest::default())?;
    let written = results::write_shown(&results, None, None)?;
    results::print_results(&results, None, output, &written);
    results::check_limit(&results, max_rmse_mm)
}
