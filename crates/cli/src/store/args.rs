//! The command line of `skinrig store`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Arguments of `store`.
#[derive(Debug, Args)]
pub(crate) struct StoreArgs {
    /// The command.
    #[command(subcommand)]
    pub command: StoreCommand,
}

/// The commands of `store`.
#[derive(Debug, Subcommand)]
pub(crate) enum StoreCommand {
    /// Move sealed sessions into a store; a reference stays in the place of each.
    #[command(
        after_help = "Example:\n  skinrig store put sessions/*.session.sqlite --to s3://lab/2026\n\n\
        Every byte is read back before a file is replaced. Results, tags and reports stay beside the reference."
    )]
    Put(StorePutArgs),

    /// Fetch sessions back from their store, each checked in full, in the place of its reference.
    #[command(after_help = "Example:\n  skinrig store get sessions/NAME.session.sqlite")]
    Get(StoreGetArgs),

    /// Write a reference to each session of a store, to read it from another computer.
    #[command(after_help = "Example:\n  skinrig store link s3://lab/2026 --to sessions/")]
    Link(StoreLinkArgs),
}

/// Arguments of `store put`.
#[derive(Debug, Args)]
pub(crate) struct StorePutArgs {
    /// The sessions.
    #[arg(required = true, value_name = "SESSION")]
    pub sessions: Vec<PathBuf>,

    /// Where to: `s3://BUCKET/FOLDER`.
    #[arg(long, value_name = "ADDRESS")]
    pub to: String,

    /// Keep the files; write no references.
    #[arg(long)]
    pub keep: bool,
}

/// Arguments of `store get`.
#[derive(Debug, Args)]
pub(crate) struct StoreGetArgs {
    /// The references.
    #[arg(required = true, value_name = "SESSION")]
    pub sessions: Vec<PathBuf>,
}

/// Arguments of `store link`.
#[derive(Debug, Args)]
pub(crate) struct StoreLinkArgs {
    /// Where the sessions are: `s3://BUCKET/FOLDER`.
    #[arg(value_name = "ADDRESS")]
    pub from: String,

    /// The folder of sessions.
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    pub to: PathBuf,
}
