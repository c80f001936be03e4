//! `skinrig control` and `skinrig note`: requests to a run from another terminal.

use std::path::Path;
use std::time::{Duration, Instant};

use skinrig_recorder::{SessionReader, writer_of};

use crate::args::{ControlArgs, NoteArgs};
use crate::exit::{Exit, Failure, Outcome};
use crate::host::user_name;
use crate::paths::shell_path;
use crate::remote::{RemoteError, Reply, Request, RunRequest, RunSnapshot, ask};
use crate::sessions;

/// The controller reads requests at every tick; a run that takes longer than this hangs.
const ACKNOWLEDGE_WITHIN: Duration = Duration::from_secs(10);
/// Interval between status queries.
const ASK_EVERY: Duration = Duration::from_millis(20);

/// Sends a request to a session's run and waits for the acknowledgement.
///
/// # Errors
/// [`Failure::input`] when no run writes the session, [`Failure::rig`] when the run does not acknowledge the request,
/// [`Failure::limit`] when the request has not taken effect within `--wait`.
pub(crate) fn control(args: &ControlArgs, json: bool) -> Outcome {
    let session = sessions::find_running(&args.session)?;
    let acknowledged = request(&session, args.what)?;
    let after = match args.wait {
        Some(seconds) => {
            let within = Duration::try_from_secs_f64(seconds)
                .map_err(|e| Failure::input(format!("--wait: {e}")))?;
            match wait(&session, within, |live| has_effect(args.what, &live.state))? {
                WaitOutcome::TimedOut(live) => {
                    return Err(Failure::limit(format!(
                        "acknowledged, but not done within {seconds} s: the run is {}; it will follow as soon as it can",
                        live.state
                    )));
                }
                WaitOutcome::Done(live) => Some(live),
                WaitOutcome::Ended => None,
            }
        }
        None => acknowledged,
    };
    let Some(live) = after else {
        return ended(args.what, &session, json);
    };
    let state = live.state;
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "session": session, "request": args.what, "heard": true, "state": state,
        }));
    } else {
        outln!("{}: acknowledged; the run is {state}", session.display());
    }
    Ok(Exit::Ok)
}

/// Sends a request to a session's run. Returns the run's status after the acknowledgement; `None` if the run has ended.
///
/// # Errors
/// As [`control`].
pub(crate) fn request(
    session: &Path,
    what: RunRequest,
) -> Result<Option<Box<RunSnapshot>>, Failure> {
    let number = send(session, &Request::Control(what))?;
    match wait(session, ACKNOWLEDGE_WITHIN, |live| live.heard >= number)? {
        WaitOutcome::Done(live) => Ok(Some(live)),
        WaitOutcome::TimedOut(live) => Err(no_acknowledgement(&live)),
        WaitOutcome::Ended => Ok(None),
    }
}

/// Result for a run that ended: success if the request was to end it, otherwise an error.
fn ended(what: RunRequest, session: &Path, json: bool) -> Outcome {
    if !matches!(
        what,
        RunRequest::Stop | RunRequest::Abort | RunRequest::Halt
    ) {
        return Err(Failure::input(format!(
            "{}: the run has already ended\n  next: `skinrig status {on}` shows how",
            session.display(),
            on = shell_path(session)
        )));
    }
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "session": session, "request": what, "heard": true, "state": "finished",
        }));
    } else {
        outln!("{}: the run has ended", session.display());
    }
    Ok(Exit::Ok)
}

/// True when a run in `state` has done what was requested.
fn has_effect(what: RunRequest, state: &str) -> bool {
    match what {
        RunRequest::Pause | RunRequest::PauseNow => matches!(state, "paused" | "finished"),
        RunRequest::Resume => matches!(state, "running" | "finished"),
        RunRequest::Stop | RunRequest::Abort | RunRequest::Halt => state == "finished",
    }
}

/// Adds a note to a running session and waits until it is stored.
///
/// # Errors
/// As [`control`].
pub(crate) fn note(args: &NoteArgs, json: bool) -> Outcome {
    let session = sessions::find_running(&args.session)?;
    let by = match &args.by {
        Some(name) => name.clone(),
        None => user_name(),
    };
    let text = args.text.join(" ");
    let is_running = add_note(&session, &by, &text)?;
    if !is_running {
        outln!("{}: noted; the run has ended", session.display());
    } else if json {
        crate::terminal::print_json(&serde_json::json!({
            "session": session, "by": by, "note": text, "written": true,
        }));
    } else {
        outln!("{}: noted", session.display());
    }
    Ok(Exit::Ok)
}

/// Adds a note to a session's run and waits until it is stored. Returns false if the run has ended since.
///
/// # Errors
/// As [`control`].
pub(crate) fn add_note(session: &Path, by: &str, text: &str) -> Result<bool, Failure> {
    let request = Request::Note {
        by: by.to_owned(),
        text: text.to_owned(),
    };
    let number = send(session, &request)?;
    match wait(session, ACKNOWLEDGE_WITHIN, |live| live.noted >= number)? {
        WaitOutcome::Done(_) => Ok(true),
        WaitOutcome::TimedOut(live) => Err(no_acknowledgement(&live)),
        // Written at the end of the run, or lost if the run was killed: check the session.
        WaitOutcome::Ended if is_noted(session, &format!("{by}: {text}")) => Ok(false),
        WaitOutcome::Ended => Err(Failure::input(format!(
            "{}: the run ended before the note was written",
            session.display()
        ))),
    }
}

fn is_noted(session: &Path, note: &str) -> bool {
    let notes = SessionReader::open(session).and_then(|reader| reader.notes());
    notes.is_ok_and(|notes| notes.iter().any(|n| n.text == note))
}

/// Sends `request` to the run and returns its number.
fn send(session: &Path, request: &Request) -> Result<u64, Failure> {
    match ask(session, request) {
        Ok(Reply::Handed(number)) => Ok(number),
        Ok(Reply::Refused(why)) => Err(Failure::input(format!("{}: {why}", session.display()))),
        Ok(Reply::Live(_) | Reply::Newest(_) | Reply::Touch(_) | Reply::TouchesEnded) => {
            Err(Failure::internal(
                "expected the number of the request, found another reply: is the run of another version of skinrig?",
            ))
        }
        Err(error) => Err(remote_failure(session, error)),
    }
}

/// The failure for a run that did not answer.
fn remote_failure(session: &Path, error: RemoteError) -> Failure {
    let session = session.display();
    match error {
        RemoteError::Failed(why) => Failure::internal(format!("{session}: {why}")),
        RemoteError::NotListening => Failure::internal(format!(
            "{session}: its run does not accept requests\n  next: press ctrl-C in its own terminal, or send SIGTERM to its process, \
             which counts as one ctrl-C; to stop the arm at once press the force button on its base"
        )),
    }
}

/// The failure for a run that did not acknowledge a request in time.
fn no_acknowledgement(live: &RunSnapshot) -> Failure {
    Failure::rig(format!(
        "the run ({}) has not acknowledged the request within {} s; it may do so later\n  next: look at the arm; to stop it at once press the \
         force button on its base",
        live.state,
        ACKNOWLEDGE_WITHIN.as_secs()
    ))
}

/// Outcome of the wait.
enum WaitOutcome {
    /// The condition holds.
    Done(Box<RunSnapshot>),
    /// Timed out: the condition still does not hold.
    TimedOut(Box<RunSnapshot>),
    /// The run ended first.
    Ended,
}

/// Polls the run until `done` holds, the run ends, or `within` has passed.
fn wait(
    session: &Path,
    within: Duration,
    done: impl Fn(&RunSnapshot) -> bool,
) -> Result<WaitOutcome, Failure> {
    let from = Instant::now();
    loop {
        match ask(session, &Request::Status) {
            Ok(Reply::Live(live)) if done(&live) => return Ok(WaitOutcome::Done(live)),
            Ok(Reply::Live(live)) if from.elapsed() >= within => {
                return Ok(WaitOutcome::TimedOut(live));
            }
            Ok(Reply::Live(_)) => {}
            Ok(other) => return Err(Failure::internal(format!("unexpected answer {other:?}"))),
            Err(RemoteError::NotListening) if writer_of(session).is_none() => {
                return Ok(WaitOutcome::Ended);
            }
            Err(RemoteError::NotListening) if from.elapsed() < within => {}
            Err(error) => return Err(remote_failure(session, error)),
        }
        std::thread::sleep(ASK_EVERY);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_request_leads_to_its_state() {
        for (what, state) in [
            (RunRequest::Pause, "paused"),
            (RunRequest::PauseNow, "paused"),
            (RunRequest::Resume, "running"),
            (RunRequest::Stop, "finished"),
            (RunRequest::Abort, "finished"),
            (RunRequest::Halt, "finished"),
        ] {
            assert!(has_effect(what, state) && has_effect(what, "finished"));
            assert!(!has_effect(what, "stopping") && !has_effect(what, "pausing"));
        }
    }
}
