//! `skinrig control` and `skinrig note`: the operator's hand on a run from another terminal.

use std::path::Path;
use std::time::{Duration, Instant};

use skinrig_recorder::{SessionReader, writer_of};

use crate::args::{ControlArgs, NoteArgs};
use crate::exit::{Exit, Failure, Outcome};
use crate::host::user_name;
use crate::remote::{Live, Reply, Request, Silence, What, ask};
use crate::sessions;

/// The controller hears a request at its next tick; one that takes this long hangs.
const HEARD_WITHIN: Duration = Duration::from_secs(10);
/// Between two questions to the run.
const ASK_EVERY: Duration = Duration::from_millis(20);

/// Hands a request to the run of a session, and waits until the run has heard it.
///
/// # Errors
/// [`Failure::input`] when nobody runs it, [`Failure::rig`] when the run does not hear, [`Failure::limit`] when the
/// request has not had its effect within `--wait`.
pub fn control(args: &ControlArgs, json: bool) -> Outcome {
    let session = sessions::find_running(&args.session)?;
    let number = handed(&session, &Request::Control(args.what))?;
    let heard = wait(&session, HEARD_WITHIN, |live| live.heard >= number)?;
    let after = match (heard, args.wait) {
        (Waited::Late(live), _) => return Err(deaf(&live)),
        (Waited::Until(_), Some(seconds)) => {
            let within = Duration::try_from_secs_f64(seconds)
                .map_err(|e| Failure::input(format!("--wait: {e}")))?;
            match wait(&session, within, |live| has_effect(args.what, &live.state))? {
                Waited::Late(live) => {
                    return Err(Failure::limit(format!(
                        "heard, but not done within {seconds} s: the run is {}; it will be as soon as it can",
                        live.state
                    )));
                }
                other => other,
            }
        }
        (other, _) => other,
    };
    let state = match after {
        Waited::Until(live) | Waited::Late(live) => live.state,
        Waited::Ended => return ended(args.what, &session, json),
    };
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "session": session, "request": args.what, "heard": true, "state": state,
        }));
    } else {
        outln!("{}: heard; the run is {state}", session.display());
    }
    Ok(Exit::Ok)
}

/// The run ended: what was asked for, or too early for it.
fn ended(what: What, session: &Path, json: bool) -> Outcome {
    if !matches!(what, What::Stop | What::Abort | What::Halt) {
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
fn has_effect(what: What, state: &str) -> bool {
    match what {
        What::Pause | What::PauseNow => matches!(state, "paused" | "finished"),
        What::Resume => matches!(state, "running" | "finished"),
        What::Stop | What::Abort | What::Halt => state == "finished",
    }
}

/// Hands the run of a session a remark, and waits until it is written.
///
/// # Errors
/// As [`control`].
pub fn note(args: &NoteArgs, json: bool) -> Outcome {
    let session = sessions::find_running(&args.session)?;
    let by = match &args.by {
        Some(name) => name.clone(),
        None => user_name(),
    };
    let text = args.text.join(" ");
    let request = Request::Note {
        by: by.clone(),
        text: text.clone(),
    };
    let number = handed(&session, &request)?;
    match wait(&session, HEARD_WITHIN, |live| live.noted >= number)? {
        Waited::Until(_) if json => crate::terminal::print_json(&serde_json::json!({
            "session": session, "by": by, "note": text, "written": true,
        })),
        Waited::Until(_) => outln!("{}: noted", session.display()),
        Waited::Late(live) => return Err(deaf(&live)),
        // Written at the end of the run, or lost with a run that was killed: the session tells.
        Waited::Ended if is_noted(&session, &format!("{by}: {text}")) => {
            outln!("{}: noted; the run has ended", session.display());
        }
        Waited::Ended => {
            return Err(Failure::input(format!(
                "{}: the run ended before the note was written",
                session.display()
            )));
        }
    }
    Ok(Exit::Ok)
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
        Err(silence) => Err(silent(session, silence)),
    }
}

/// Nobody answered.
fn silent(session: &Path, silence: Silence) -> Failure {
    let session = session.display();
    match silence {
        Silence::Trouble(why) => Failure::internal(format!("{session}: {why}")),
        Silence::Nobody => Failure::internal(format!(
            "{session}: its run does not listen\n  next: press ctrl-C in its own terminal, or send SIGTERM to its process, \
             which counts as one ctrl-C; to stop the arm at once press the force button on its base"
        )),
    }
}

/// The run does not look at what it is asked.
fn deaf(live: &Live) -> Failure {
    Failure::rig(format!(
        "the run ({}) has not heard the request within {} s; it may still\n  next: look at the arm; to stop it at once press the \
         force button on its base",
        live.state,
        HEARD_WITHIN.as_secs()
    ))
}

/// What waiting came to.
enum Waited {
    /// It is so.
    Until(Box<Live>),
    /// It is still not so.
    Late(Box<Live>),
    /// The run ended before.
    Ended,
}

/// Asks the run again and again until `done`, its end, or `within` is over.
fn wait(session: &Path, within: Duration, done: impl Fn(&Live) -> bool) -> Result<Waited, Failure> {
    let from = Instant::now();
    loop {
        match ask(session, &Request::Status) {
            Ok(Reply::Live(live)) if done(&live) => return Ok(Waited::Until(live)),
            Ok(Reply::Live(live)) if from.elapsed() >= within => return Ok(Waited::Late(live)),
            Ok(Reply::Live(_)) => {}
            Ok(other) => return Err(Failure::internal(format!("unexpected answer {other:?}"))),
            Err(Silence::Nobody) if writer_of(session).is_none() => return Ok(Waited::Ended),
            Err(Silence::Nobody) if from.elapsed() < within => {}
            Err(silence) => return Err(silent(session, silence)),
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
            (What::Pause, "paused"),
            (What::PauseNow, "paused"),
            (What::Resume, "running"),
            (What::Stop, "finished"),
            (What::Abort, "finished"),
            (What::Halt, "finished"),
        ] {
            assert!(has_effect(what, state) && has_effect(what, "finished"));
            assert!(!has_effect(what, "stopping") && !has_effect(what, "pausing"));
        }
    }
}
