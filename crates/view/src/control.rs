//! Owns requests that reach a run: only of a server with control, and through the lab's own hand on it.

use serde::Deserialize;
use serde_json::{Value, json};

use crate::folder::Folder;
use crate::lab::Lab;
use crate::problem::Problem;

/// A request to the run that writes a session.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ControlRequest {
    session: String,
    request: String,
}

/// A note for a running session.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NoteRequest {
    session: String,
    by: String,
    text: String,
}

/// Rejects requests to a server without control.
pub(crate) fn check(has_control: bool) -> Result<(), Problem> {
    if has_control {
        return Ok(());
    }
    Err(Problem::forbidden(
        "this server only reads\n  next: start it with `skinrig view --control`",
    ))
}

/// Sends the request to the run; returns the state after its acknowledgement.
pub(crate) fn control(
    lab: &dyn Lab,
    folder: &Folder,
    message: &ControlRequest,
) -> Result<Value, Problem> {
    let session = folder.session(&message.session)?;
    let state = lab.request(&session, &message.request)?;
    Ok(json!({ "state": state }))
}

/// Stores the note.
pub(crate) fn note(
    lab: &dyn Lab,
    folder: &Folder,
    message: &NoteRequest,
) -> Result<Value, Problem> {
    let session = folder.session(&message.session)?;
    lab.note(&session, &message.by, &message.text)?;
    Ok(json!({ "written": true }))
}
