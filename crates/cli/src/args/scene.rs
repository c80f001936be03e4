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
        after_help = "Examples:\n  skinrig scene check sessions/NAME.session.sqlite\n  \
        skinrig scene check recorded.session.sqlite simulated.session.sqlite --out check.html\n\n\
        Compare a recording with a simulation of its protocol: where they differ, the simulation is not like the camera."
    )]
    Check(SceneCheckArgs),
}

/// Arguments of `scene check`.
#[derive(Debug, Args)]
pub(crate) struct SceneCheckArgs {
    /// Sessions, or Prophesee RAW files of one camera.
    #[arg(required = true, value_name = "RECORDING")]
    pub recordings: Vec<PathBuf>,

    /// Also write a page with figures of all recordings side by side, at most four.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}
