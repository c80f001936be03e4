//! Arguments of the commands that turn sessions into results.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use skinrig_protocol::limits::Margin;

use super::values::{
    Grid, ReplaySpeed, StopRule, grid, length_mm, limit_mm, per_second, percent, replay_speed,
    stop_rule, time_s,
};

/// Arguments of `analyze`.
#[derive(Debug, Args)]
pub(crate) struct AnalyzeArgs {
    /// The session file, or a selection.
    pub session: PathBuf,

    /// Override one analysis setting of the session's protocol, for example `analysis.min_samples=5`. The result is a variant beside
    /// the official one.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,

    /// Name of the variant [default: what it changes].
    #[arg(long, value_name = "NAME", value_parser = crate::analyses::parse)]
    pub name: Option<String>,

    /// Make the same choices as the public analysis code (docs/reference/paper.md lists them) and report its numbers too; `--set`
    /// takes precedence.
    #[arg(long)]
    pub reference_code: bool,

    /// Take the calibration of an earlier session of the same skin and correct it by the calibration presses of this one (three or
    /// more): the skin was mounted again. The result is a variant.
    #[arg(long, value_name = "SESSION")]
    pub calibration_from: Option<PathBuf>,

    /// Repeat the analysis with measured numbers moved by one unit in the last place, and print how many digits of the results
    /// are true [default: 100 repetitions].
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "100",
          value_parser = clap::value_parser!(u32).range(1..=10_000), conflicts_with = "calibration_from")]
    pub digits: Option<u32>,

    /// Where to write the results [default: beside the session].
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,

    /// Fail (exit code 4) when the scored RMSE exceeds this, in mm, or fewer than half of the scored presses are located.
    #[arg(long, value_name = "MM", value_parser = limit_mm)]
    pub max_rmse: Option<f64>,
}

/// Arguments of `compare`.
#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// Two or more skins: session files, selections, folders of sessions, or names of prototypes (all of their sessions in `--sessions`).
    #[arg(required = true, num_args = 2.., value_name = "SKIN")]
    pub skins: Vec<String>,

    /// Folder in which to look for the prototypes' sessions.
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    pub sessions: PathBuf,

    /// The limits file, which defines what counts as a difference [default: `limits.yaml` in the current folder, if it exists].
    #[arg(long, value_name = "FILE")]
    pub limits: Option<PathBuf>,

    /// The largest difference of a metric that does not count, for example `rmse=0.5mm`; overrides the limits file. Can be given
    /// several times.
    #[arg(long = "margin", value_name = "METRIC=MARGIN", value_parser = Margin::parse)]
    pub margins: Vec<Margin>,

    /// Error threshold of the pass rate [default: from the limits file, or else from the first skin's analysis].
    #[arg(long, value_name = "LENGTH", value_parser = length_mm)]
    pub within: Option<f64>,

    /// Compare despite the blocking difference with this key. Can be given several times.
    #[arg(long, value_name = "KEY")]
    pub despite: Vec<String>,

    /// Look after each complete repetition of exactly two skins and stop at the first look that decides on the RMSE. Alpha is spent
    /// over the looks, so it may be asked again after every new repetition.
    #[arg(long)]
    pub sequential: bool,

    /// Number of looks, declared before the first, which share alpha equally [default: unlimited; look k spends alpha / (k (k + 1))].
    #[arg(long, value_name = "N", requires = "sequential", value_parser = clap::value_parser!(u32).range(1..=i64::from(skinrig_statistics::MOST_LOOKS)))]
    pub looks: Option<u32>,

    /// Compare this named variant (`skinrig analyze --name`) of every session [default: the official analyses].
    #[arg(long, value_name = "NAME", value_parser = crate::analyses::parse)]
    pub analysis: Option<String>,

    /// Where to write the page, with its results as JSON beside it [default: beside the first session].
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Cost that is traded against accuracy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum CostKind {
    /// CPU time per press.
    Cpu,
    /// Bytes per second.
    Bytes,
    /// Time from contact to estimate.
    Delay,
    /// Pixels that are read, after cropping and binning.
    Pixels,
}

/// Arguments of `tradeoff`.
#[derive(Debug, Args)]
pub(crate) struct TradeoffArgs {
    /// The session file, or a selection.
    pub session: PathBuf,

    /// Override one analysis setting of the session's protocol first.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,

    /// Recommend the cheapest choice whose RMSE stays within this, at the upper end of its 95 % interval, for example `6mm`.
    #[arg(long, value_name = "LENGTH", value_parser = length_mm)]
    pub target_rmse: Option<f64>,

    /// The cost that `--target-rmse` minimises.
    #[arg(long, value_enum, default_value = "cpu", requires = "target_rmse")]
    pub cost: CostKind,

    /// Recommend the most accurate choice within this CPU time per press, for example `100us`.
    #[arg(long, value_name = "TIME", value_parser = time_s)]
    pub budget: Option<f64>,

    /// Recommend the most accurate choice that reads at most as many pixels of a camera as a grid of this size, for example
    /// `64x48`.
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = grid)]
    pub pixels: Option<Grid>,

    /// Smallest share of located presses for a choice to qualify [default: that of the session's own settings less 1 %].
    #[arg(long, value_name = "PERCENT", value_parser = percent)]
    pub min_located: Option<f64>,

    /// Timed runs per choice.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeats: u32,

    /// Try every combination (thousands) instead of single changes, random draws and promising combinations.
    #[arg(long)]
    pub full: bool,

    /// Measure this many further random combinations, and count how many measure what was predicted of them.
    #[arg(long, value_name = "N", default_value_t = 0, conflicts_with = "full")]
    pub check: u16,

    /// Where to write the page, with its results as JSON beside it [default: beside the session].
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Arguments of `online`.
#[derive(Debug, Args)]
pub(crate) struct OnlineArgs {
    /// The session file, or a selection of one session.
    pub session: PathBuf,

    /// Speed of the replay relative to the recording: a factor, or `max`.
    #[arg(long, value_name = "FACTOR", default_value = "max", value_parser = replay_speed)]
    pub speed: ReplaySpeed,

    /// When a press could end: `2mm`, the longer semi-axis of its region; `20ms`, time after it was felt.
    #[arg(long, value_name = "LIMIT", default_value = "50ms", value_parser = stop_rule)]
    pub stop_at: StopRule,

    /// False alarms per second that the threshold allows.
    #[arg(long, value_name = "PER_S", default_value = "0.13", value_parser = per_second)]
    pub false_alarms: f64,
}

/// Arguments of `report`.
#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// The session file, or a selection.
    pub session: PathBuf,

    /// Report this named variant (`skinrig analyze --name`) [default: the official analysis].
    #[arg(long, value_name = "NAME", value_parser = crate::analyses::parse)]
    pub analysis: Option<String>,

    /// Where to write the page [default: beside the session].
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}
