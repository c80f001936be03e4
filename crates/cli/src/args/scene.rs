//! Arguments of `scene`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Arguments of `scene`.
#[derive(Debug, Args)]
pub(crate) struct SceneArgs {
    /// The command.
    #[command(subcommand)]
    pub command: SceneCommand,
}

/// The commands of `scene`.
#[derive(Debug, Subcommand)]
pub(crate) enum SceneCommand {
    /// Print statistics of each camera's events: law of a pixel's intervals, refractory floor, equal timestamps, neighbours.
    #[command(
        after_help = "Example:\n  skinrig scene check sessions/NAME.session.sqlite\n\n\
        Compare a recording with a simulation of its protocol: where they differ, the simulation is not like the camera."
    )]
    Check(SceneCheckArgs),
}

/// Arguments of `scene check`.
#[derive(Debug, Args)]
pub(crate) struct SceneCheckArgs {
    /// The session file.
    pub session: PathBuf,
}
