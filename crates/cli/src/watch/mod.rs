//! `skinrig watch`: follows a run in another terminal.
//!
//! It only reads: the session file, which it opens for each frame and closes at once, so that the run can seal it, and the state
//! that the run reports on request. It cannot affect the run.

mod draw;
mod failures;
mod frame;
mod map;
mod signal;
mod touches;

use std::io::IsTerminal;
use std::time::Duration;

use console::Term;
use skinrig_recorder::{RecorderError, writer_of};
use skinrig_text::Paint;

use crate::args::WatchArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::sessions;

use frame::{Follower, Frame};

/// Shows a run until its session is sealed or its process has ended.
///
/// # Errors
/// [`Failure::input`] if the file is not a session; with `--once` also if there is none yet.
pub(crate) fn watch(args: &WatchArgs, json: bool) -> Outcome {
    let every = Duration::try_from_secs_f64(args.every)
        .map_err(|e| Failure::input(format!("--every: {e}")))?;
    if args.touches {
        return touches::follow(&args.session, every);
    }
    let mut is_announced = false;
    let mut follower = None;
    loop {
        let frame = match follower.as_mut() {
            Some(follower) => read_frame(follower, args.once)?,
            None => match sessions::find_if_any(&args.session)? {
                Some(session) => read_frame(follower.insert(Follower::new(session)), args.once)?,
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
            None if !is_announced && follower.is_none() => {
                is_announced = true;
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

/// The next frame; `None` if there is nothing new, for example before the first records of the run are on the disk.
fn read_frame(follower: &mut Follower, once: bool) -> Result<Option<Frame>, Failure> {
    // Look for the writer first: if the run ends in between, its end is then in the file.
    let writer = writer_of(follower.session());
    match follower.read_frame(writer.as_deref(), !once) {
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
    let stdout = std::io::stdout();
    let size = stdout.is_terminal().then(|| Term::stdout().size());
    let paint = Paint::new(crate::terminal::is_coloured(&stdout));
    let redraws = size.is_some() && !once;
    // What was printed once can be scrolled back.
    let size = size.map(|(rows, columns)| (if once { u16::MAX } else { rows }, columns));
    let text = draw::text(frame, draw::Canvas::new(size, paint));
    if redraws {
        crate::terminal::clear_screen();
    }
    crate::terminal::out(format_args!("{text}\n"));
    Ok(())
}
