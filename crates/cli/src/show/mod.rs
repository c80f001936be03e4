//! `skinrig show`: one session described.

mod description;
mod text;

use crate::args::ShowArgs;
use crate::exit::{Exit, Failure, Outcome};
use description::Description;

/// Describes a session.
///
/// # Errors
/// [`Failure::input`] when the file is not a readable session.
pub(crate) fn show(args: &ShowArgs, json: bool) -> Outcome {
    let session = Description::read(args).map_err(Failure::session)?;
    if json {
        crate::terminal::print_json(&serde_json::to_value(&session).map_err(Failure::internal)?);
    } else {
        text::print(&session);
    }
    Ok(Exit::Ok)
}
