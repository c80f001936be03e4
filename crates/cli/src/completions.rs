//! `skinrig completions`.

use clap::Command;

use crate::args::CompletionsArgs;
use crate::exit::{Exit, Outcome};

/// Prints the completions of a shell.
///
/// # Errors
/// Never.
pub(crate) fn completions(args: &CompletionsArgs) -> Outcome {
    let mut script = Vec::new();
    let mut command = visible(&crate::args::command());
    clap_complete::generate(args.shell, &mut command, "skinrig", &mut script);
    let script = String::from_utf8_lossy(&script);
    crate::terminal::out(format_args!("{script}"));
    Ok(Exit::Ok)
}

/// The command without the subcommands that skinrig starts itself.
fn visible(command: &Command) -> Command {
    let subcommands = command.get_subcommands().filter(|c| !c.is_hide_set());
    Command::new("skinrig")
        .about(command.get_about().cloned().unwrap_or_default())
        .args(command.get_arguments().cloned())
        .subcommands(subcommands.cloned())
}
