//! Arguments of `skinrig reanalyze`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `reanalyze`.
#[derive(Debug, Args)]
pub(crate) struct ReanalyzeArgs {
    /// Session files, folders of sessions, or selections.
    #[arg(required = true, value_name = "SESSION")]
    pub sessions: Vec<PathBuf>,

    /// The file of settings that change: `skinrig_settings: 1` and a mapping `analysis`, as in a protocol.
    #[arg(long, value_name = "FILE")]
    pub settings: PathBuf,

    /// Name of the variant [default: that of the file of settings].
    #[arg(long, value_name = "VARIANT", value_parser = crate::analyses::parse)]
    pub name: Option<String>,

    /// Sessions analysed at the same time, each by its own process [default: the number of cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub jobs: Option<u32>,
}
