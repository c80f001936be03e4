//! The command line of `skinrig hil`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Arguments of `hil`.
#[derive(Debug, Args)]
pub struct HilArgs {
    /// What to do.
    #[command(subcommand)]
    pub command: HilCommand,
}

/// The commands of `hil`.
#[derive(Debug, Subcommand)]
pub enum HilCommand {
    /// Make the checks of a suite on a bench, with limits that were stated before; tell rig, skin and software apart.
    #[command(
        after_help = "Examples:\n  skinrig hil run hil/nightly.yaml --rig hil/rigs/NAME.yaml\n  \
        skinrig hil run hil/nightly.yaml --rig hil/rigs/NAME.yaml --only identity,trigger_loopback\n\n\
        Exit codes:\n  \
        0  every check is PASS, MARGINAL or SKIPPED for a stated reason\n  \
        1  FAIL: a limit was broken, or too little was measured\n  \
        2  bad input: command line, suite, rig file, golden protocol; a plan that does not fit the suite's budget\n  \
        3  infrastructure: computer, disk, cable, permission; another program or another suite holds the bench\n  \
        4  INVALID: a device of the rig was at fault, so the night says nothing about the skin\n\n\
        ctrl-C ends the suite with the check under way; what was not measured is INCONCLUSIVE. docs/nightly.md has the rules."
    )]
    Run(HilRunArgs),

    /// Show who holds a bench: a suite, a run or a jog, each alone.
    #[command(
        after_help = "Examples:\n  skinrig hil lease\n  skinrig hil lease --rig hil/rigs/NAME.yaml"
    )]
    Lease(HilLeaseArgs),
}

/// Arguments of `hil lease`.
#[derive(Debug, Args)]
pub struct HilLeaseArgs {
    /// The rig file of the bench; all leases of this computer when absent.
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,
}

/// Arguments of `hold-arm`.
#[derive(Debug, Args)]
pub struct HoldArmArgs {
    /// The rig file of the bench.
    #[arg(long, value_name = "FILE")]
    pub rig: PathBuf,
}

/// Arguments of `hil run`.
#[derive(Debug, Args)]
pub struct HilRunArgs {
    /// The suite.
    pub suite: PathBuf,

    /// The rig file of the bench.
    #[arg(long, value_name = "FILE")]
    pub rig: PathBuf,

    /// Folder in which the night gets a folder of its own, with its results, its page and its golden session.
    #[arg(long, value_name = "DIR", default_value = "nights")]
    pub out: PathBuf,

    /// Only these checks; the others are SKIPPED.
    #[arg(long, value_name = "CHECK", value_delimiter = ',')]
    pub only: Option<Vec<String>>,

    /// The history of nights that this one is added to.
    #[arg(long, value_name = "FILE")]
    pub history: Option<PathBuf>,
}
