//! `skinrig status`: progress or end of a run, from the session file and from the run itself.

mod state;
mod text;

use skinrig_recorder::{RecorderError, writer_of};

use self::state::{Status, stored};
use crate::args::StatusArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::paths;
use crate::remote::{RemoteError, Reply, Request, ask};
use crate::rig::gates;
use crate::sessions;

/// Prints the state of a session.
///
/// # Errors
/// [`Failure::input`] if there is no readable session.
pub(crate) fn status(args: &StatusArgs, as_json: bool) -> Outcome {
    let session = sessions::find(&args.session)?;
    // Look for the writer first: if the run ends in between, its end is then in the file.
    let writer = writer_of(&session);
    let (live, silence) = match ask(&session, &Request::Status) {
        Ok(Reply::Live(live)) => (Some(live), None),
        Ok(Reply::Refused(why)) => (None, Some(why)),
        Err(RemoteError::Failed(why)) => (None, Some(why.to_string())),
        Ok(Reply::Handed(_) | Reply::Newest(_) | Reply::Touch(_) | Reply::TouchesEnded)
        | Err(RemoteError::NotListening) => (None, None),
    };
    let stored = match stored(&session) {
        Ok(stored) => Some(stored),
        // The first records of a run are not yet on the disk.
        Err(RecorderError::Empty { .. }) if writer.is_some() => None,
        Err(e) => return Err(Failure::session(e)),
    };
    let free = gates::free_bytes(paths::folder_of(&session));
    let status = Status {
        session,
        writer,
        live,
        silence,
        disk_free_bytes: free.ok().map(|bytes| bytes as u64),
        stored,
    };
    if as_json {
        crate::terminal::print_json(&serde_json::to_value(&status).map_err(Failure::internal)?);
    } else {
        text::print(&status);
    }
    Ok(Exit::Ok)
}
