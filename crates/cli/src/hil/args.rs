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
        ctrl-C ends the suite with the check under way; what was not measured is INCONCLUSIVE. docs/reference/nightly.md has the rules."
    )]
    Run(HilRunArgs),

    /// Show who holds a bench: a suite, a run or a jog, each alone.
    #[command(
        after_help = "Examples:\n  skinrig hil lease\n  skinrig hil lease --rig hil/rigs/NAME.yaml"
    )]
    Lease(HilLeaseArgs),

    /// What moved over the nights, since when, and whether rig, skin or software moved it, probably.
    #[command(
        after_help = "Examples:\n  skinrig hil trend\n  skinrig hil trend nights/history.sqlite --series golden --html trends.html\n  \
        skinrig hil trend --rebuild nights/\n\n\
        Exit codes:\n  \
        0  nothing moved, or there are too few nights to say\n  \
        1  an alarm: something moved and is still off\n  \
        2  bad input: no history, another program's file, a bench or series that it does not have\n\n\
        docs/reference/nightly.md says how an alarm is raised, and how seldom a false one."
    )]
    Trend(HilTrendArgs),

    /// Take a change as it is: a new skin, a new baseline of the software. From that night on the series is learnt anew.
    #[command(
        after_help = "Examples:\n  skinrig hil accept golden/skin/press_events --night 2026-11-20T02-00-00Z-nightly --reason 'new lamp'\n  \
        skinrig hil accept --all --night 2026-11-20T02-00-00Z-nightly --reason 'new golden skin'"
    )]
    Accept(HilAcceptArgs),
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

    /// As `run --tolerant`, for every check and the golden campaign. What is let pass counts as a difference of the check `settings`.
    #[arg(long)]
    pub tolerant: bool,

    /// Folder in which the night gets a folder of its own, with its results, its page and its golden session.
    #[arg(long, value_name = "DIR", default_value = "nights")]
    pub out: PathBuf,

    /// Only these checks; the others are SKIPPED.
    #[arg(long, value_name = "CHECK", value_delimiter = ',')]
    pub only: Option<Vec<String>>,

    /// The history of nights that this one is added to; its page then says what moved over them.
    #[arg(long, value_name = "FILE")]
    pub history: Option<PathBuf>,
}

/// Arguments of `hil trend`.
#[derive(Debug, Args)]
pub struct HilTrendArgs {
    /// The history of nights.
    #[arg(default_value = "nights/history.sqlite")]
    pub history: PathBuf,

    /// Only series whose name has this in it, or that match it as a whole when it has a `*`. All are judged all the same.
    #[arg(long, value_name = "PATTERN")]
    pub series: Option<String>,

    /// How many nights the charts in the terminal go back. All are judged all the same.
    #[arg(long, value_name = "N", default_value_t = 60)]
    pub nights: usize,

    /// Write a page with all charts.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,

    /// The bench; without it that of the newest night.
    #[arg(long, value_name = "NAME")]
    pub rig: Option<String>,

    /// The suite; without it that of the newest night.
    #[arg(long, value_name = "NAME")]
    pub suite: Option<String>,

    /// First add the nights of this folder that the history does not have, from their results: makes a lost history again.
    #[arg(long, value_name = "DIR")]
    pub rebuild: Option<PathBuf>,

    /// Draw with ASCII characters alone.
    #[arg(long)]
    pub ascii: bool,
}

/// Arguments of `hil accept`.
#[derive(Debug, Args)]
pub struct HilAcceptArgs {
    /// The series, as `hil trend` calls it.
    #[arg(required_unless_present = "all", conflicts_with = "all")]
    pub series: Option<String>,

    /// All series of the bench.
    #[arg(long)]
    pub all: bool,

    /// The first night with the change.
    #[arg(long, value_name = "ID")]
    pub night: String,

    /// Why.
    #[arg(long, value_name = "TEXT")]
    pub reason: String,

    /// Who says so; without it who is logged in.
    #[arg(long, value_name = "NAME")]
    pub by: Option<String>,

    /// The history of nights.
    #[arg(long, value_name = "FILE", default_value = "nights/history.sqlite")]
    pub history: PathBuf,

    /// The bench; without it that of the newest night.
    #[arg(long, value_name = "NAME")]
    pub rig: Option<String>,

    /// The suite; without it that of the newest night.
    #[arg(long, value_name = "NAME")]
    pub suite: Option<String>,
}
