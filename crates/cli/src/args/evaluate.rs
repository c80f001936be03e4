//! Arguments of what turns sessions into results.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use skinrig_protocol::limits::Margin;

use super::values::{length_mm, limit_mm, percent, time_s};

/// Arguments of `analyze`.
#[derive(Debug, Args)]
pub struct AnalyzeArgs {
    /// The session file.
    pub session: PathBuf,

    /// Override one analysis setting of the session's protocol, for example `analysis.min_samples=5`. The result is a variant beside
    /// the official one.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,

    /// Name of the variant; by what it changes when absent.
    #[arg(long, value_name = "NAME", value_parser = crate::analyses::parse)]
    pub name: Option<String>,

    /// Make the choices of the public analysis code (docs/reference/paper.md lists them) and report its numbers beside; `--set`
    /// still wins.
    #[arg(long)]
    pub reference_code: bool,

    /// Where to write the results; beside the session when absent.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,

    /// Fail (exit code 4) when the scored RMSE is above this, in mm.
    #[arg(long, value_name = "MM", value_parser = limit_mm)]
    pub max_rmse: Option<f64>,
}

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// Two skins or more: session files, folders of sessions, or names of prototypes (all their sessions in `--sessions`).
    #[arg(required = true, num_args = 2.., value_name = "SKIN")]
    pub skins: Vec<String>,

    /// Where sessions of prototypes are looked for.
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    pub sessions: PathBuf,

    /// The file of limits: what counts as a difference. `limits.yaml` where skinrig is started, when that is there.
    #[arg(long, value_name = "FILE")]
    pub limits: Option<PathBuf>,

    /// The largest difference of a metric that is none, for example `rmse=0.5mm`; goes before the file's. Can be given several
    /// times.
    #[arg(long = "margin", value_name = "METRIC=MARGIN", value_parser = Margin::parse)]
    pub margins: Vec<Margin>,

    /// The error that the pass rate asks about; that of the limits, else of the first skin's analysis, when absent.
    #[arg(long, value_name = "LENGTH", value_parser = length_mm)]
    pub within: Option<f64>,

    /// Compare in spite of a blocking difference with this key. Can be given several times.
    #[arg(long, value_name = "KEY")]
    pub despite: Vec<String>,

    /// Compare the variant of this name (`skinrig analyze --name`) of every session; the official analyses when absent.
    #[arg(long, value_name = "NAME", value_parser = crate::analyses::parse)]
    pub analysis: Option<String>,

    /// Where to write the page, and beside it the results as JSON; beside the first session when absent.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// What accuracy is traded for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum CostKind {
    /// CPU time per press.
    Cpu,
    /// Bytes per second.
    Bytes,
    /// Time from the contact to the estimate.
    Delay,
}

/// Arguments of `tradeoff`.
#[derive(Debug, Args)]
pub struct TradeoffArgs {
    /// The session file.
    pub session: PathBuf,

    /// Override one analysis setting of the session's protocol before anything is traded.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,

    /// Name the cheapest choice whose RMSE is at most this at the upper end of its 95 % interval, for example `6mm`.
    #[arg(long, value_name = "LENGTH", value_parser = length_mm)]
    pub target_rmse: Option<f64>,

    /// What is cheap with `--target-rmse`.
    #[arg(long, value_enum, default_value = "cpu")]
    pub cost: CostKind,

    /// Name the most accurate choice within this CPU time per press, for example `100us`.
    #[arg(long, value_name = "TIME", value_parser = time_s)]
    pub budget: Option<f64>,

    /// Smallest share of located presses that competes; that of the session's own settings less 1 % when absent.
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    pub min_located: Option<f64>,

    /// Timed runs per choice.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeats: u32,

    /// Try every combination (thousands) instead of one change at a time and promising combinations.
    #[arg(long)]
    pub full: bool,

    /// Where to write the page, and beside it the results as JSON; beside the session when absent.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Arguments of `report`.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// The session file.
    pub session: PathBuf,

    /// The variant of this name (`skinrig analyze --name`); the official analysis when absent.
    #[arg(long, value_name = "NAME", value_parser = crate::analyses::parse)]
    pub analysis: Option<String>,

    /// Where to write the page; beside the session when absent.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}
