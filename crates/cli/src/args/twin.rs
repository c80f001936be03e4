//! Arguments of `twin`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `twin`.
#[derive(Debug, Args)]
pub(crate) struct TwinArgs {
    /// The session file.
    pub session: PathBuf,

    /// Also predict the session with this setting of the protocol, for example `depth=3mm`.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,

    /// Simulate this protocol [default: that of the session].
    #[arg(long, value_name = "FILE")]
    pub protocol: Option<PathBuf>,

    /// Simulated skins: more narrow the intervals down to what the session tells. Some fail; 40 must be left.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(50..=2000))]
    pub skins: u32,

    /// Seed of the first skin; each further one has the next [default: the session's seed plus 1].
    #[arg(long)]
    pub seed: Option<u64>,

    /// Folder for the simulated sessions, each deleted after its analysis [default: the temporary folder].
    #[arg(long, value_name = "DIR")]
    pub sessions: Option<PathBuf>,

    /// Write the page here, and the results and the twin's protocol beside it [default: beside the session].
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}
