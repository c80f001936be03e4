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

    /// Test whether a session is like its scene: simulates its protocol many times and compares figures.
    #[command(
        after_help = "Examples:\n  skinrig scene predict sessions/NAME.session.sqlite\n  \
        skinrig scene predict sessions/NAME.session.sqlite --set scene.skin.creep_time=2s\n  \
        skinrig scene predict IMPORTED.session.sqlite --protocol protocols/paper-meander.yaml\n\n\
        If the scene is right, the session is one more simulated session with another seed. Of right scenes, one in twenty has a\n\
        figure that is \"not as predicted\". The report of the session shows the result in its next analysis."
    )]
    Predict(ScenePredictArgs),
}

/// Arguments of `scene predict`.
#[derive(Debug, Args)]
pub(crate) struct ScenePredictArgs {
    /// The session file.
    pub session: PathBuf,

    /// Simulate this protocol [default: that of the session].
    #[arg(long, value_name = "FILE")]
    pub protocol: Option<PathBuf>,

    /// Override one setting of the protocol, for example `scene.skin.creep_time=2s`.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,

    /// Simulation level [default: that of a simulated session, or what the scene needs if the protocol is another one].
    #[arg(long)]
    pub level: Option<String>,

    /// Simulated sessions.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(8..=1000))]
    pub replicates: u32,

    /// Seed of the first one; each further one has the next [default: the session's seed plus 1].
    #[arg(long)]
    pub seed: Option<u64>,

    /// Folder for the simulated sessions, each deleted after its analysis [default: the temporary folder].
    #[arg(long, value_name = "DIR")]
    pub sessions: Option<PathBuf>,

    /// Write the page here, and the results beside it [default: beside the session].
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
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
