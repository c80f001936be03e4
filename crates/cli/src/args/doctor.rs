//! Arguments of `doctor`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `doctor`.
#[derive(Debug, Args)]
pub(crate) struct DoctorArgs {
    /// Also compare this rig file with the hardware that is connected.
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,

    /// Also send a test message on every channel of the `notify` in this rig file or suite.
    #[arg(long, value_name = "FILE")]
    pub notify: Option<PathBuf>,

    /// The folder where sessions will be written.
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    pub sessions: PathBuf,
}
