//! Arguments of what plans, runs and watches: the commands about a bench.

use std::path::PathBuf;

use clap::Args;
use skinrig_protocol::PlantedFault;

use super::values::{length_mm, limit_mm, probability, share, time_s};
use crate::remote::What;

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

    /// Draw the path, numbered, as SVG.
    #[arg(long, value_name = "FILE", conflicts_with = "detect")]
    pub svg: Option<PathBuf>,

    /// What to press to find a difference.
    #[command(flatten)]
    pub detect: DetectArgs,
}

/// What to press on two skins to find a difference between them.
#[derive(Debug, Args)]
pub struct DetectArgs {
    /// Propose locations x repetitions that show a difference this large between the RMSE of two skins, for example "1 mm".
    #[arg(long, value_name = "LENGTH", value_parser = length_mm, requires = "from")]
    pub detect: Option<f64>,

    /// The session whose variance is taken.
    #[arg(long, value_name = "SESSION", requires = "detect")]
    pub from: Option<PathBuf>,

    /// Probability of finding the difference.
    #[arg(long, value_name = "SHARE", default_value = "0.8", value_parser = probability)]
    pub power: f64,

    /// Probability of claiming a difference when there is none.
    #[arg(long, value_name = "SHARE", default_value = "0.05", value_parser = probability)]
    pub alpha: f64,

    /// Share of the variance between locations that the two skins have in common, from 0 (not known) to 1.
    #[arg(long, value_name = "SHARE", default_value = "0", value_parser = share)]
    pub common: f64,
}

/// Arguments of `run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// The protocol file; not needed with `--replay`.
    #[arg(required_unless_present = "replay", conflicts_with = "replay")]
    pub protocol: Option<PathBuf>,

    /// Override one value of the protocol. Can be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE", conflicts_with = "replay")]
    pub overrides: Vec<String>,

    /// Serve this recorded session through the device interfaces instead of a rig.
    #[arg(long, value_name = "SESSION")]
    pub replay: Option<PathBuf>,

    /// The rig file of a bench; the simulated rig when absent.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["replay", "level", "real_time"])]
    pub rig: Option<PathBuf>,

    /// Let mismatches of the cameras of `--rig` pass (status bytes, resets, transfers, registers that read back differently), and tell the
    /// keys of the rig file that accept them. The session says that it was recorded so.
    #[arg(long, requires = "rig")]
    pub tolerant: bool,

    /// Seed of the run and of the simulated rig; the protocol's seed when absent.
    #[arg(long, conflicts_with = "replay")]
    pub seed: Option<u64>,

    /// Simulation level (kinematic, geometric, optical); the cheapest that the protocol's scene needs when absent.
    #[arg(long, conflicts_with = "replay")]
    pub level: Option<String>,

    /// Run the simulated rig at the speed of a real one.
    #[arg(long, conflicts_with = "replay")]
    pub real_time: bool,

    /// Make this fault on purpose, for rehearsals on the simulated rig, such as camera1-stalled@hold:3 (docs/reference/runs.md lists
    /// them). Can be given several times.
    #[arg(long = "fault", value_name = "FAULT", conflicts_with = "replay")]
    pub faults: Vec<PlantedFault>,

    /// Folder for the session file, its results and its report.
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    pub sessions: PathBuf,

    /// Record only.
    #[arg(long)]
    pub no_analysis: bool,

    /// Fail (exit code 4) when the scored RMSE is above this, in mm.
    #[arg(long, value_name = "MM", value_parser = limit_mm)]
    pub max_rmse: Option<f64>,
}

/// Arguments of `resume`.
#[derive(Debug, Args)]
pub struct ResumeArgs {
    /// The session file.
    pub session: PathBuf,

    /// The rig file of the bench; that of the session, where it was, when absent.
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,

    /// As `run --tolerant`, for this leg, on a bench: it is noted with the leg.
    #[arg(long, conflicts_with = "real_time")]
    pub tolerant: bool,

    /// Run the simulated rig at the speed of a real one.
    #[arg(long, conflicts_with = "rig")]
    pub real_time: bool,

    /// Record only.
    #[arg(long)]
    pub no_analysis: bool,

    /// Accept a robot or camera with another serial number than the session's; it is recorded.
    #[arg(long)]
    pub allow_other_device: bool,

    /// Make this fault on purpose, for rehearsals on the simulated rig, such as camera1-stalled@hold:3 (docs/reference/runs.md lists
    /// them). Can be given several times.
    #[arg(long = "fault", value_name = "FAULT")]
    pub faults: Vec<PlantedFault>,
}

/// Arguments of `status`.
#[derive(Debug, Args)]
pub struct StatusArgs {
    /// The session file; of a folder the session that is being written, else the newest.
    #[arg(default_value = "sessions")]
    pub session: PathBuf,
}

/// Arguments of `control`.
#[derive(Debug, Args)]
pub struct ControlArgs {
    /// The session file, or a folder in which one session is being written.
    pub session: PathBuf,

    /// What the run is to do.
    #[arg(value_enum)]
    pub what: What,

    /// Come back only when it is done (paused, running again, ended), at most after this time (exit code 4).
    #[arg(long, value_name = "TIME", value_parser = time_s)]
    pub wait: Option<f64>,
}

/// Arguments of `note`.
#[derive(Debug, Args)]
pub struct NoteArgs {
    /// The session file, or a folder in which one session is being written.
    pub session: PathBuf,

    /// The note.
    #[arg(required = true)]
    pub text: Vec<String>,

    /// Who says so; the name under which you are logged in when absent.
    #[arg(long, value_name = "NAME")]
    pub by: Option<String>,
}

/// Arguments of `devices`.
#[derive(Debug, Args)]
pub struct DevicesArgs {
    /// Also ask what this rig file names: its robot library and its trigger box's port.
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,
}

/// Arguments of `jog`.
#[derive(Debug, Args)]
pub struct JogArgs {
    /// The rig file of a bench; the simulated rig when absent.
    #[arg(long, value_name = "FILE")]
    pub rig: Option<PathBuf>,

    /// Where everything is logged; a new file in `sessions/` when absent.
    #[arg(long, value_name = "FILE")]
    pub log: Option<PathBuf>,

    /// Let the tip go deeper below the surface of the rig file's frame than its `limits.max_depth`, down to the end of the
    /// workspace: for touching off a skin that lies elsewhere. It is logged.
    #[arg(long)]
    pub beyond_frame: bool,

    /// Hold, rise, disarm and end after this long without a typed line.
    #[arg(long, value_name = "TIME", default_value = "5 min", value_parser = time_s)]
    pub idle: f64,
}

/// Arguments of `watch`.
#[derive(Debug, Args)]
pub struct WatchArgs {
    /// The session file; of a folder the session that is being written, else the newest. It need not be there yet.
    #[arg(default_value = "sessions")]
    pub session: PathBuf,

    /// Show it once and end.
    #[arg(long)]
    pub once: bool,

    /// How often to look.
    #[arg(long, value_name = "TIME", default_value = "1 s", value_parser = time_s)]
    pub every: f64,
}
