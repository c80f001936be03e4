//! `skinrig watch`: a run as it goes on, in another terminal.
//!
//! It reads: the session file, opened anew for each look and closed again at once, so that a run that ends can seal it; and what the
//! run tells of itself to whoever asks. Nothing it does or does not do reaches the run.

mod draw;
mod frame;
mod signal;

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::Duration;

use skinrig_recorder::{RecorderError, writer_of};

use crate::args::WatchArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::sessions;

use frame::{Follower, Frame};

/// Cursor to the upper left corner, and all below it is empty.
const CLEAR: &str = "\u{1b}[H\u{1b}[J";

/// Shows a run until it has ended and its session is sealed, or nobody runs it any more.
///
/// # Errors
/// [`Failure::input`] for what is no session; with `--once` also when there is none yet.
pub(crate) fn watch(args: &WatchArgs, json: bool) -> Outcome {
    let every = Duration::try_from_secs_f64(args.every)
        .map_err(|e| Failure::input(format!("--every: {e}")))?;
    let mut told = false;
    let mut follower = None;
    loop {
        let frame = match follower.as_mut() {
            Some(follower) => look(follower, args.once)?,
            None => match found(&args.session)? {
                Some(session) => look(follower.insert(Follower::new(session)), args.once)?,
                None => None,
            },
        };
        match frame {
            Some(frame) => {
                show(&frame, json, args.once)?;
                if args.once || frame.is_over() {
                    return Ok(Exit::Ok);
                }
            }
            None if args.once => {
                return Err(Failure::input(format!(
                    "{}: expected a session, found none yet\n  next: leave out --once to wait for it",
                    args.session.display()
                )));
            }
            None if !told && follower.is_none() => {
                told = true;
                errln!(
                    "{}: no session yet; waiting for a run to start (ctrl-C quits)",
                    args.session.display()
                );
            }
            None => {}
        }
        std::thread::sleep(every);
    }
}

/// The session that is meant, once there is one.
fn found(place: &Path) -> Result<Option<PathBuf>, Failure> {
    let mut folder = match place.is_dir() {
        true => std::fs::read_dir(place).map_err(Failure::input)?,
        false => return Ok(place.exists().then(|| place.to_owned())),
    };
    let is_session = |entry: std::io::Result<std::fs::DirEntry>| {
        entry.is_ok_and(|e| {
            let name = e.file_name();
            name.to_string_lossy()
                .ends_with(skinrig_recorder::SESSION_SUFFIX)
        })
    };
    if folder.any(is_session) {
        sessions::find(place).map(Some)
    } else {
        Ok(None)
    }
}

/// The next frame; `None` when there is nothing new, as before the first records of the run are on the disk.
fn look(follower: &mut Follower, once: bool) -> Result<Option<Frame>, Failure> {
    // The writer first: a run that ends in between has then left its end in the file.
    let writer = writer_of(follower.session());
    match follower.look(writer.as_deref(), !once) {
        Ok(frame) => Ok(frame),
        Err(RecorderError::Empty { .. } | RecorderError::NotASession { .. })
            if writer.is_some() =>
        {
            Ok(None)
        }
        Err(e) => Err(Failure::session(e)),
    }
}

fn show(frame: &Frame, json: bool, once: bool) -> Result<(), Failure> {
    if json {
        let value = serde_json::to_value(frame).map_err(Failure::internal)?;
        crate::terminal::print_json(&value);
        return Ok(());
    }
    let clear = if once || !std::io::stdout().is_terminal() {
        ""
    } else {
        CLEAR
    };
    crate::terminal::out(format_args!("{clear}{}\n", draw::text(frame)));
    Ok(())
}
