//! `skinrig control` and `skinrig note`: the operator's hand on a run from another terminal.

use std::path::Path;
use std::time::{Duration, Instant};

use skinrig_recorder::{SessionReader, writer_of};

use crate::args::{ControlArgs, NoteArgs};
use crate::exit::{Exit, Failure, Outcome};
use crate::host::user_name;
use crate::remote::{Live, RemoteError, Reply, Request, RunRequest, ask};
use crate::sessions;

/// The controller hears a request at its next tick; one that takes this long hangs.
const ACKNOWLEDGE_WITHIN: Duration = Duration::from_secs(10);
/// Between two questions to the run.
const ASK_EVERY: Duration = Duration::from_millis(20);

/// Hands a request to the run of a session, and waits until the run has acknowledged it.
///
/// # Errors
/// [`Failure::input`] when nobody runs it, [`Failure::rig`] when the run does not hear, [`Failure::limit`] when the
/// request has not had its effect within `--wait`.
pub(crate) fn control(args: &ControlArgs, json: bool) -> Outcome {
    let session = sessions::find_running(&args.session)?;
    let acknowledged = acknowledged(&session, args.what)?;
    let after = match args.wait {
        Some(seconds) => {
            let within = Duration::try_from_secs_f64(seconds)
                .map_err(|e| Failure::input(format!("--wait: {e}")))?;
            match wait(&session, within, |live| has_effect(args.what, &live.state))? {
                WaitOutcome::Late(live) => {
                    return Err(Failure::limit(format!(
                        "acknowledged, but not done within {seconds} s: the run is {}; it will follow as soon as it can",
                        live.state
                    )));
                }
                WaitOutcome::Until(live) => Some(live),
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

/// Hands a request to the run of `session`; the run once it has acknowledged it, `None` if it has ended.
///
/// # Errors
/// As [`control`].
pub(crate) fn acknowledged(session: &Path, what: RunRequest) -> Result<Option<Box<Live>>, Failure> {
    let number = handed(session, &Request::Control(what))?;
    match wait(session, ACKNOWLEDGE_WITHIN, |live| live.heard >= number)? {
        WaitOutcome::Until(live) => Ok(Some(live)),
        WaitOutcome::Late(live) => Err(no_acknowledgement(&live)),
        WaitOutcome::Ended => Ok(None),
    }
}

/// The run ended: what was asked for, or too early for it.
fn ended(what: RunRequest, session: &Path, json: bool) -> Outcome {
    if !matches!(
        what,
        RunRequest::Stop | RunRequest::Abort | RunRequest::Halt
    ) {
        return Err(Failure::input(format!(
            "{}: the run has ended meanwhile\n  next: `skinrig status {0}` tells how",
            session.display()
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

/// True when a run in `state` is where `what` leads to.
fn has_effect(what: RunRequest, state: &str) -> bool {
    match what {
        RunRequest::Pause | RunRequest::PauseNow => matches!(state, "paused" | "finished"),
        RunRequest::Resume => matches!(state, "running" | "finished"),
        RunRequest::Stop | RunRequest::Abort | RunRequest::Halt => state == "finished",
    }
}

/// Hands the run of a session a remark, and waits until it is written.
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
    let goes_on = written(&session, &by, &text)?;
    if !goes_on {
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

/// Hands the run of `session` a remark, and waits until it is written. False if the run has ended meanwhile.
///
/// # Errors
/// As [`control`].
pub(crate) fn written(session: &Path, by: &str, text: &str) -> Result<bool, Failure> {
    let request = Request::Note {
        by: by.to_owned(),
        text: text.to_owned(),
    };
    let number = handed(session, &request)?;
    match wait(session, ACKNOWLEDGE_WITHIN, |live| live.noted >= number)? {
        WaitOutcome::Until(_) => Ok(true),
        WaitOutcome::Late(live) => Err(no_acknowledgement(&live)),
        // Written at the end of the run, or lost with a run that was killed: the session tells.
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

/// Hands `request` to the run; its number.
fn handed(session: &Path, request: &Request) -> Result<u64, Failure> {
    match ask(session, request) {
        Ok(Reply::Handed(number)) => Ok(number),
        Ok(Reply::Refused(why)) => Err(Failure::input(format!("{}: {why}", session.display()))),
        Ok(Reply::Live(_)) => Err(Failure::internal(
            "the run answered another question: expected one of this version of skinrig",
        )),
        Err(error) => Err(remote_failure(session, error)),
    }
}

/// Nobody answered.
fn remote_failure(session: &Path, error: RemoteError) -> Failure {
    let session = session.display();
    match error {
        RemoteError::Failed(why) => Failure::internal(format!("{session}: {why}")),
        RemoteError::NotListening => Failure::internal(format!(
            "{session}: its run does not listen\n  next: press ctrl-C in its own terminal, or send SIGTERM to its process, \
             which counts as one ctrl-C; to stop the arm at once press the force button on its base"
        )),
    }
}

/// The run does not look at what it is asked.
fn no_acknowledgement(live: &Live) -> Failure {
    Failure::rig(format!(
        "the run ({}) has not acknowledged the request within {} s; it may still\n  next: look at the arm; to stop it at once press the \
         force button on its base",
        live.state,
        ACKNOWLEDGE_WITHIN.as_secs()
    ))
}

/// What waiting came to.
enum WaitOutcome {
    /// It is so.
    Until(Box<Live>),
    /// It is still not so.
    Late(Box<Live>),
    /// The run ended before.
    Ended,
}

/// Asks the run again and again until `done`, its end, or `within` is over.
fn wait(
    session: &Path,
    within: Duration,
    done: impl Fn(&Live) -> bool,
) -> Result<WaitOutcome, Failure> {
    let from = Instant::now();
    loop {
        match ask(session, &Request::Status) {
            Ok(Reply::Live(live)) if done(&live) => return Ok(WaitOutcome::Until(live)),
            Ok(Reply::Live(live)) if from.elapsed() >= within => {
                return Ok(WaitOutcome::Late(live));
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
    fn every_request_has_a_state_that_it_leads_to() {
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
