//! `skinrig scene`: how like a camera the events of recordings are, and how like its scene a session is.

mod check;
mod predict;
pub(crate) mod replicates;

use crate::args::{SceneArgs, SceneCommand};
use crate::exit::Outcome;
use crate::terminal::Output;

/// Runs the command of `scene`.
///
/// # Errors
/// As the command.
pub(crate) fn scene(args: &SceneArgs, command_line: &str, output: Output) -> Outcome {
    match &args.command {
        SceneCommand::Check(args) => check::check(args, output.json),
        SceneCommand::Predict(args) => predict::predict(args, command_line, output),
    }
}
