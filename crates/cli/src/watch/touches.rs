//! `skinrig watch --touches`: what a run feels, for other programs.

use std::path::Path;
use std::time::Duration;

use serde_json::json;
use skinrig_recorder::writer_of;

use crate::exit::{Exit, Failure, Outcome};
use crate::paths::shell_path;
use crate::remote::{RemoteError, Reply, Request, follow as follow_run};
use crate::sessions;

/// Waits for a run at `place`, looking `every` so often, and prints its touches until it ends.
///
/// # Errors
/// [`Failure::input`] if the run feels none, or no run writes the session; [`Failure::internal`] if the connection is lost.
pub(super) fn follow(place: &Path, every: Duration) -> Outcome {
    let (mut is_announced, mut was_idle) = (false, false);
    loop {
        let mut is_idle = true;
        if let Some(session) = sessions::find_if_any(place)? {
            is_idle = writer_of(&session).is_none();
            let (mut has_ended, mut refused) = (false, None);
            let followed = follow_run(&session, &Request::Touches, |reply| match reply {
                Reply::Touch(touch) => outln!("{}", json!(touch)),
                Reply::TouchesEnded => has_ended = true,
                Reply::Refused(why) => refused = Some(why),
                _ => {}
            });
            match (followed, refused) {
                (_, Some(why)) => return Err(failure(&session, &why)),
                (Ok(()), None) if has_ended => return Ok(Exit::Ok),
                (Ok(()), None) => {
                    return Err(Failure::internal(format!(
                        "{0}: expected touches until the run ends, found the connection ended before: the run was killed, or this \
                         program read too slowly\n  next: `skinrig status {on}` shows whether it goes on; then repeat the command",
                        session.display(),
                        on = shell_path(&session)
                    )));
                }
                (Err(RemoteError::Failed(why)), None) => {
                    return Err(Failure::internal(format!("{}: {why}", session.display())));
                }
                // A run that has just made its session may not listen yet.
                (Err(RemoteError::NotListening), None)
                    if is_idle && was_idle && !place.is_dir() =>
                {
                    let why = "expected a run that writes this session, found none";
                    return Err(failure(&session, why));
                }
                (Err(RemoteError::NotListening), None) => {}
            }
        }
        if is_idle && !is_announced {
            is_announced = true;
            errln!(
                "{}: no run yet; waiting for one to start (ctrl-C quits)",
                place.display()
            );
        }
        was_idle = is_idle;
        std::thread::sleep(every);
    }
}

fn failure(session: &Path, why: &str) -> Failure {
    Failure::input(format!(
        "{0}: {why}\n  next: `skinrig show {on}` lists what was recorded",
        session.display(),
        on = shell_path(session)
    ))
}
