//! Arguments of the commands that plan, run and watch experiments.

use std::path::PathBuf;

use clap::Args;
use skinrig_protocol::PlantedFault;

use super::values::{length_mm, limit_mm, probability, share, time_s};
use crate::remote::RunRequest;

/// Arguments of `plan`.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// The protocol file; not needed with `--detect`.
    #[arg(required_unless_present = "detect", conflicts_with = "detect")]
    pub protocol: Option<PathBuf>,

    /// Override one value of the protocol, for example `path.meander.pitch=6mm`. Can be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE", conflicts_with = "detect")]
    pub overrides: Vec<String>,

    /// Print every step.
    #[arg(long, conflicts_with = "detect")]
    pub steps: bool,

    /// Draw the numbered path as SVG.
    #[arg(long, value_name = "FILE", conflicts_with = "detect")]
    pub svg: Option<PathBuf>,

    /// Power analysis: the presses needed to find a difference.
    #[command(flatten)]
    pub detect: DetectArgs,
}

/// Options of the power analysis: the presses needed to find a difference between two skins.
#[derive(Debug, Args)]
pub struct DetectArgs {
    /// Propose the locations and repetitions that would show an RMSE difference this large between two skins, for example "1 mm".
    #[arg(long, value_name = "LENGTH", value_parser = length_mm, requires = "from")]
    pub detect: Option<f64>,

    /// The session from which the variance is estimated.
    #[arg(
        long,
        value_name = "SESSION",
        requires = "detect",
        conflicts_with = "protocol"
    )]
    pub from: Option<PathBuf>,

    /// Power: probability of detecting the difference.
    #[arg(long, value_name = "SHARE", default_value = "0.8", value_parser = probability, requires = "detect", conflicts_with = "protocol")]
    pub power: f64,

    /// Significance level: probability of claiming a difference when there is none.
    #[arg(long, value_name = "SHARE", default_value = "0.05", value_parser = probability, requires = "detect", conflicts_with = "protocol")]
    pub alpha: f64,

    /// Share of the between-location variance that the two skins have in common, from 0 (unknown) to 1.
    #[arg(long, value_name = "SHARE", default_value = "0", value_parser = share, requires = "detect", conflicts_with = "protocol")]
    pub common: f64,
}

/// Arguments of `run`.
#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    /// The protocol file; not needed with `--replay`.
    #[arg(required_unless_present = "replay", conflicts_with = "replay")]
    pub protocol: Option<PathBuf>,

    /// Override one value of the protocol. Can be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE", conflicts_with = "replay")]
    pub overrides: Vec<String>,

    /// Replay this recorded session through the device interfaces instead of driving a rig.
    #[arg(long, value_name = "SESSION")]
    pub replay: Option<PathBuf>,

    /// The rig file of a bench [default: the simulated rig].
    #[arg(long, value_name = "FILE", conflicts_with_all = ["replay", "level", "real_time"])]
    pub rig: Option<PathBuf>,

    /// Send messages by the `notify` of this rig file or suite [default: of the rig file].
    #[arg(long, value_name = "FILE", conflicts_with = "replay")]
    pub notify: Option<PathBuf>,

    /// Accept mismatches of the rig's cameras (status bytes, resets, transfers, register read-backs), and print the rig file keys that
    /// accept them permanently. The session records it.
    #[arg(long, requires = "rig")]
    pub tolerant: bool,

    /// Seed of the simulated rig [default: the protocol's `seed`, which also draws random paths and orders].
    #[arg(long, conflicts_with = "replay")]
    pub seed: Option<u64>,

    /// Simulation level: kinematic, geometric or optical [default: the cheapest that the protocol's scene needs].
    #[arg(long, conflicts_with = "replay")]
    pub level: Option<String>,

    /// Run the simulated rig in real time.
    #[arg(long, conflicts_with = "replay")]
    pub real_time: bool,

    /// Inject this fault, to rehearse on the simulated rig: for example camera1-stalled@hold:3 (docs/reference/runs.md lists them).
    /// Can be given several times.
    #[arg(long = "fault", value_name = "FAULT", conflicts_with = "replay")]
    pub faults: Vec<PlantedFault>,

    /// Folder for the session file, results and report.
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    pub sessions: PathBuf,

    /// Record only; skip the analysis.
    #[arg(long)]
    pub no_analysis: bool,

    /// Fail (exit code 4) when the scored RMSE exceeds this, in mm, or fewer than half of the scored presses are located.
    #[arg(long, value_name = "MM", value_parser = limit_mm, conflicts_with = "no_analysis")]
    pub max_rmse: Option<f64>,
}

/// Arguments of `resume`.
#[derive(Debug, Args)]
pub(crate) struct ResumeArgs {
    /// The session file.
    pub session: PathBuf,

    /// The rig file of the bench [default: the one the session was recorded with].
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,

    /// Send messages by the `notify` of this rig file or suite [default: of the rig file].
    #[arg(long, value_name = "FILE")]
    pub notify: Option<PathBuf>,

    /// Accept camera mismatches for this leg, as `run --tolerant` does; the leg records it.
    #[arg(long, conflicts_with = "real_time")]
    pub tolerant: bool,

    /// Run the simulated rig in real time.
    #[arg(long, conflicts_with = "rig")]
    pub real_time: bool,

    /// Record only; skip the analysis.
    #[arg(long)]
    pub no_analysis: bool,

    /// Accept a robot or camera whose serial number differs from the session's; the leg records it.
    #[arg(long)]
    pub allow_other_device: bool,

    /// Inject this fault, to rehearse on the simulated rig: for example camera1-stalled@hold:3 (docs/reference/runs.md lists them).
    /// Can be given several times.
    #[arg(long = "fault", value_name = "FAULT")]
    pub faults: Vec<PlantedFault>,
}

/// Arguments of `status`.
#[derive(Debug, Args)]
pub(crate) struct StatusArgs {
    /// The session file, or a folder: its running session, or else its newest.
    #[arg(default_value = "sessions")]
    pub session: PathBuf,
}

/// Arguments of `control`.
#[derive(Debug, Args)]
pub(crate) struct ControlArgs {
    /// The session file, or a folder with one running session.
    pub session: PathBuf,

    /// What the run should do.
    #[arg(value_enum)]
    pub what: RunRequest,

    /// Wait until the run has done it (paused, resumed, ended), but no longer than this (then exit code 4).
    #[arg(long, value_name = "TIME", value_parser = time_s)]
    pub wait: Option<f64>,
}

/// Arguments of `note`.
#[derive(Debug, Args)]
pub(crate) struct NoteArgs {
    /// The session file, or a folder with one running session.
    pub session: PathBuf,

    /// The text of the note.
    #[arg(required = true)]
    pub text: Vec<String>,

    /// Author [default: your login name].
    #[arg(long, value_name = "NAME")]
    pub by: Option<String>,
}

/// Arguments of `devices`.
#[derive(Debug, Args)]
pub(crate) struct DevicesArgs {
    /// Also query what this rig file names: the robot library and the trigger box's port.
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,
}

/// Arguments of `jog`.
#[derive(Debug, Args)]
pub(crate) struct JogArgs {
    /// The rig file of a bench [default: the simulated rig].
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,

    /// The log file [default: a new file in `sessions/`].
    #[arg(long, value_name = "FILE")]
    pub log: Option<PathBuf>,

    /// Let the tip go deeper below the frame's surface than the rig file's `limits.max_depth`, down to the end of the
    /// workspace, to touch off a skin that is mounted elsewhere. The log records it.
    #[arg(long)]
    pub beyond_frame: bool,

    /// After this long without input, hold, retract, disarm and exit.
    #[arg(long, value_name = "TIME", default_value = "5 min", value_parser = time_s)]
    pub idle: f64,
}

/// Arguments of `watch`.
#[derive(Debug, Args)]
pub(crate) struct WatchArgs {
    /// The session file, or a folder: its running session, or else its newest. It does not have to exist yet.
    #[arg(default_value = "sessions")]
    pub session: PathBuf,

    /// Print one frame and exit.
    #[arg(long)]
    pub once: bool,

    /// Print every touch that the run feels from now on as a line of JSON, as soon as it is felt, until the run ends.
    #[arg(long, conflicts_with = "once")]
    pub touches: bool,

    /// How often to refresh.
    #[arg(long, value_name = "TIME", default_value = "1 s", value_parser = time_s)]
    pub every: f64,
}

/// Arguments of `view`.
#[derive(Debug, Args)]
pub(crate) struct ViewArgs {
    /// A folder of sessions, or the session that the page opens first; its folder is the shelf.
    #[arg(default_value = "sessions")]
    pub session: PathBuf,

    /// Open this address of this computer instead, as ADDRESS or ADDRESS:PORT: other computers that reach it and have the link can read,
    /// over an unencrypted connection [default: 127.0.0.1 and a free port].
    #[arg(long, value_name = "ADDRESS", value_parser = crate::view::address)]
    pub bind: Option<std::net::SocketAddr>,

    /// Let pages pause, resume, stop, abort and annotate runs, with the rights of `skinrig control`.
    #[arg(long)]
    pub control: bool,
}

/// Arguments of `take-look`.
#[derive(Debug, Args)]
pub(crate) struct TakeLookArgs {
    /// The session.
    pub session: PathBuf,

    /// Number of the look, from 1.
    #[arg(long, value_name = "N")]
    pub number: u32,
}

/// Arguments of `learn-skin`.
#[derive(Debug, Args)]
pub(crate) struct LearnSkinArgs {
    /// The session.
    pub session: PathBuf,

    /// False alarms per second, at most.
    #[arg(long, value_name = "HZ")]
    pub false_alarms: f64,
}
