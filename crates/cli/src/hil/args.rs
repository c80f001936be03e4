//! The command line of `skinrig hil`.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Arguments of `hil`.
#[derive(Debug, Args)]
pub(crate) struct HilArgs {
    /// The command.
    #[command(subcommand)]
    pub command: HilCommand,
}

/// The commands of `hil`.
#[derive(Debug, Subcommand)]
pub(crate) enum HilCommand {
    /// Run a suite's checks on a bench against limits stated in advance, and attribute failures to rig, skin, computer or software.
    #[command(
        after_help = "Examples:\n  skinrig hil run hil/nightly.yaml --rig hil/rigs/NAME.yaml\n  \
        skinrig hil run hil/nightly.yaml --rig hil/rigs/NAME.yaml --only identity,trigger_loopback\n\n\
        Exit codes:\n  \
        0  every check is PASS, MARGINAL or SKIPPED for a stated reason\n  \
        1  FAIL: a limit was broken, or too little was measured\n  \
        2  bad input: command line, suite, rig file, golden protocol; a plan that does not fit the suite's budget\n  \
        3  infrastructure: computer, disk, cable, permission; another program or another suite holds the bench\n  \
        4  INVALID: a device of the rig was at fault, so the night says nothing about the skin\n\n\
        ctrl-C ends the suite after the current check; checks without a measurement are INCONCLUSIVE. docs/reference/nightly.md has the rules."
    )]
    Run(HilRunArgs),

    /// Show what holds a bench: one suite, run or jog at a time.
    #[command(
        after_help = "Examples:\n  skinrig hil lease\n  skinrig hil lease --rig hil/rigs/NAME.yaml"
    )]
    Lease(HilLeaseArgs),

    /// Show what changed over the nights, since when, and whether rig, skin or software is the likely cause.
    #[command(
        after_help = "Examples:\n  skinrig hil trend\n  skinrig hil trend nights/history.sqlite --series golden --html trends.html\n  \
        skinrig hil trend --rebuild nights/\n\n\
        Exit codes:\n  \
        0  nothing moved, or there are too few nights to say\n  \
        1  an alarm: something moved and is still off\n  \
        2  bad input: no history, another program's file, a bench or series that it does not have\n  \
        3  nothing moved, but --rebuild could not read all nights\n\n\
        docs/reference/nightly.md explains the rules for alarms and their false alarm rate."
    )]
    Trend(HilTrendArgs),

    /// Accept a change, such as a new skin or software baseline: from that night on, the series starts a new baseline.
    #[command(
        after_help = "Examples:\n  skinrig hil accept golden/skin/press_events --night 2026-11-20T02-00-00Z-nightly --reason 'new lamp'\n  \
        skinrig hil accept --all --night 2026-11-20T02-00-00Z-nightly --reason 'new golden skin'"
    )]
    Accept(HilAcceptArgs),
}

/// Arguments of `hil lease`.
#[derive(Debug, Args)]
pub(crate) struct HilLeaseArgs {
    /// The rig file of the bench [default: all leases on this computer].
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,
}

/// Arguments of `hold-arm`.
#[derive(Debug, Args)]
pub(crate) struct HoldArmArgs {
    /// The rig file of the bench.
    #[arg(long, value_name = "FILE")]
    pub rig: PathBuf,
}

/// Arguments of `hil run`.
#[derive(Debug, Args)]
pub(crate) struct HilRunArgs {
    /// The suite.
    pub suite: PathBuf,

    /// The rig file of the bench.
    #[arg(long, value_name = "FILE")]
    pub rig: PathBuf,

    /// Accept camera mismatches in every check and the golden campaign, as `run --tolerant` does. Accepted mismatches count as differences in the check `settings`.
    #[arg(long)]
    pub tolerant: bool,

    /// Folder in which the night gets its own folder for results, page and golden session.
    #[arg(long, value_name = "DIR", default_value = "nights")]
    pub out: PathBuf,

    /// Run only these checks; the others are SKIPPED.
    #[arg(long, value_name = "CHECK", value_delimiter = ',')]
    pub only: Option<Vec<String>>,

    /// The history to which this night is added; the page then shows the changes over the nights.
    #[arg(long, value_name = "FILE")]
    pub history: Option<PathBuf>,
}

/// Arguments of `hil trend`.
#[derive(Debug, Args)]
pub(crate) struct HilTrendArgs {
    /// The history of nights [default: nights/history.sqlite, or the catalogue that SKINRIG_CATALOGUE names].
    pub history: Option<PathBuf>,

    /// Judge the nights of this catalogue: a file, or `postgres://USER@HOST/DATABASE`. `catalogue register --nights` registers them.
    #[arg(long, value_name = "ADDRESS", conflicts_with_all = ["history", "rebuild"])]
    pub catalogue: Option<OsString>,

    /// Show only series whose name contains this, or matches it entirely if it has a `*`. All series are still judged.
    #[arg(long, value_name = "PATTERN")]
    pub series: Option<String>,

    /// How many nights the terminal charts go back. All nights are still judged.
    #[arg(long, value_name = "N", default_value_t = 60)]
    pub nights: usize,

    /// Write a page with every chart.
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,

    /// The bench [default: that of the newest night].
    #[arg(long, value_name = "NAME")]
    pub rig: Option<String>,

    /// The suite [default: that of the newest night].
    #[arg(long, value_name = "NAME")]
    pub suite: Option<String>,

    /// Before judging, add the nights of this folder that are missing from the history; this
    /// rebuilds a lost history from the results of its nights.
    #[arg(long, value_name = "DIR")]
    pub rebuild: Option<PathBuf>,

    /// Draw with ASCII characters only.
    #[arg(long)]
    pub ascii: bool,
}

/// Arguments of `hil accept`.
#[derive(Debug, Args)]
pub(crate) struct HilAcceptArgs {
    /// Name of the series, as `hil trend` shows it.
    #[arg(required_unless_present = "all", conflicts_with = "all")]
    pub series: Option<String>,

    /// Every series of the bench.
    #[arg(long)]
    pub all: bool,

    /// The first night with the change.
    #[arg(long, value_name = "ID")]
    pub night: String,

    /// The reason.
    #[arg(long, value_name = "TEXT")]
    pub reason: String,

    /// Author [default: your login name].
    #[arg(long, value_name = "NAME")]
    pub by: Option<String>,

    /// The history of nights.
    #[arg(long, value_name = "FILE", default_value = "nights/history.sqlite")]
    pub history: PathBuf,

    /// The bench [default: that of the newest night].
    #[arg(long, value_name = "NAME")]
    pub rig: Option<String>,

    /// The suite [default: that of the newest night].
    #[arg(long, value_name = "NAME")]
    pub suite: Option<String>,
}
