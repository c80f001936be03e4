//! The command line as the user types it.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use skinrig_protocol::PlantedFault;
use skinrig_protocol::limits::Margin;
use skinrig_protocol::quantity::{self, Dimension};

use crate::doctor::DoctorArgs;
use crate::exit::Exit;
use crate::hil::args::{HilArgs, HoldArmArgs};
use crate::remote::What;

/// Runs tactile-skin experiments: protocol, robot, event cameras, session, analysis, report.
#[derive(Debug, Parser)]
#[command(name = "skinrig", version = crate::version::VERSION, about, after_help = Exit::HELP, arg_required_else_help = true)]
pub struct Cli {
    /// Print results as JSON on standard output; progress and messages stay on standard error.
    #[arg(long, global = true)]
    pub json: bool,

    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Check a protocol and every motion it would make; touch nothing.
    #[command(after_help = "Example:\n  skinrig check protocols/demo.yaml")]
    Check(ProtocolArgs),

    /// Compile a protocol into steps; print them, or draw the path.
    #[command(
        after_help = "Examples:\n  skinrig plan protocols/paper-meander.yaml --svg path.svg\n  \
        skinrig plan protocols/demo.yaml --set path.meander.pitch=6mm --steps\n  \
        skinrig plan --detect \"1 mm\" --power 0.8 --from sessions/NAME.session.sqlite"
    )]
    Plan(PlanArgs),

    /// Run a protocol (on the simulated rig, or on the bench of a rig file), record, analyse, report.
    #[command(after_help = "Examples:\n  skinrig run protocols/demo.yaml\n  \
        skinrig run protocols/demo.yaml --level optical --seed 7\n  \
        skinrig run protocols/quick-check.yaml --rig hil/rigs/NAME.yaml\n  \
        skinrig run --replay sessions/NAME.session.sqlite\n\n\
        ctrl-C once stops after the current press, twice retracts and stops now,\n\
        three times switches the motors off where the tip is. The session is closed and stays readable.")]
    Run(RunArgs),

    /// Go on with a session that was cut off, stopped or broken off by a fault.
    #[command(
        after_help = "Examples:\n  skinrig resume sessions/NAME.session.sqlite\n  \
        skinrig resume sessions/NAME.session.sqlite --rig hil/rigs/NAME.yaml\n\n\
        The rig is checked and the sync presses are made again; then every press without an outcome is taken, one that was\n\
        cut off as a new attempt. A valid press is never pressed again."
    )]
    Resume(ResumeArgs),

    /// Tell how a run is going, or how it ended; reads only.
    #[command(after_help = "Examples:\n  skinrig status\n  \
        skinrig status sessions/NAME.session.sqlite --json")]
    Status(StatusArgs),

    /// Pause, resume, stop, abort or halt a run from another terminal.
    #[command(after_help = "Examples:\n  skinrig control sessions/ pause\n  \
        skinrig control sessions/NAME.session.sqlite pause-now --wait 30s\n\n\
        Comes back when the run has heard it, and tells the run's state. Only the user of the run (and root) is heard.")]
    Control(ControlArgs),

    /// Write a note into the session of a run, with its time and your name.
    #[command(after_help = "Example:\n  skinrig note sessions/ \"the lamp flickers\"")]
    Note(NoteArgs),

    /// List what is connected: robot, cameras, trigger box; and what keeps it from being used.
    #[command(
        after_help = "Examples:\n  skinrig devices\n  skinrig devices --rig hil/rigs/NAME.yaml"
    )]
    Devices(DevicesArgs),

    /// Say whether this machine is fit for the bench: permissions, cables, versions, disk, real-time limits, clock; and what to do.
    #[command(
        after_help = "Examples:\n  skinrig doctor\n  skinrig doctor --rig hil/rigs/NAME.yaml --sessions sessions/\n\n\
        Nothing moves. Opening the trigger box's port resets the box. Exit code 3 when there is a problem."
    )]
    Doctor(DoctorArgs),

    /// Move the robot by hand under the limits of the rig file, and record touched points; lines from standard input.
    #[command(after_help = "Examples:\n  skinrig jog --rig hil/rigs/NAME.yaml\n  \
        printf 'z +5mm\\ntouch 20mm\\npoint nw at -30 40 0 mm\\n' | skinrig jog\n\n\
        ctrl-C holds, rises and disarms; three times switches the motors off where the tip is. Coordinates are the robot's own. `help` lists what can be typed.")]
    Jog(JogArgs),

    /// Check a bench: every night, before a campaign, or after something was changed on it.
    Hil(HilArgs),

    /// Follow a run in the terminal until it ends; reads only, and cannot hold the run up.
    #[command(after_help = "Examples:\n  skinrig watch\n  \
        skinrig watch sessions/NAME.session.sqlite --once")]
    Watch(WatchArgs),

    /// List recorded sessions.
    #[command(after_help = "Examples:\n  skinrig sessions sessions/\n  \
        skinrig sessions --prototype \"skin 7\" --tag good-skin")]
    Sessions(SessionsArgs),

    /// List the prototypes of a folder: sessions, best and last RMSE, trend over time.
    #[command(after_help = "Examples:\n  skinrig prototypes\n  \
        skinrig prototypes sessions/ --prototype \"skin 7\"")]
    Prototypes(PrototypesArgs),

    /// Give a session tags, take tags away, or remark something after the fact; the session itself stays as it is.
    #[command(
        after_help = "Examples:\n  skinrig tag sessions/NAME.session.sqlite good-skin -bad\n  \
        skinrig tag sessions/NAME.session.sqlite --note \"the lamp had been replaced\"\n\n\
        Without tags and note: what was said of it so far. A tag has 1 to 40 of a-z, 0-9, `.`, `_`, `-`."
    )]
    Tag(TagArgs),

    /// Describe one session: protocol, rig, devices, presses, losses.
    #[command(after_help = "Example:\n  skinrig show sessions/NAME.session.sqlite --presses")]
    Show(ShowArgs),

    /// Analyse a session; write its results beside it and print them.
    #[command(
        after_help = "Examples:\n  skinrig analyze sessions/NAME.session.sqlite\n  \
        skinrig analyze sessions/NAME.session.sqlite --set analysis.centroid=all_clusters --out other.json\n  \
        skinrig analyze sessions/NAME.session.sqlite --reference-code"
    )]
    Analyze(AnalyzeArgs),

    /// Write the HTML report of a session (analysing it first when needed).
    #[command(
        after_help = "Example:\n  skinrig report sessions/NAME.session.sqlite --out report.html"
    )]
    Report(ReportArgs),

    /// Say whether one skin is better than another: may they be compared, which is better at what, where, and why.
    #[command(
        after_help = "Examples:\n  skinrig compare sessions/OLD.session.sqlite sessions/NEW.session.sqlite --margin rmse=0.5mm\n  \
        skinrig compare \"mold 3\" \"mold 4\" \"mold 5\" --sessions sessions/ --limits protocols/comparison.limits.yaml\n\n\
        Each skin is compared with the first, place by place. Skins that may not be compared end with exit code 2 and the reason;\n\
        --despite KEY goes on in spite of it, and the table and the page say so. docs/comparison.md has the rules."
    )]
    Compare(CompareArgs),

    /// Measure speed against accuracy on a session: estimators, windows, thinning, bins, rows.
    #[command(
        after_help = "Examples:\n  skinrig tradeoff sessions/NAME.session.sqlite\n  \
        skinrig tradeoff sessions/NAME.session.sqlite --target-rmse 6mm --budget 100us"
    )]
    Tradeoff(TradeoffArgs),

    /// Recompute every checksum, count and hash of a session, or of a bundle made by `export`.
    #[command(
        after_help = "Examples:\n  skinrig verify sessions/NAME.session.sqlite\n  skinrig verify NAME.bundle"
    )]
    Verify(SessionArg),

    /// Copy what is whole of a damaged session into a new file; list what is lost.
    #[command(
        after_help = "Example:\n  skinrig salvage sessions/NAME.session.sqlite\n\n\
        The damaged file is only read. Exit code 4 when something is known to be lost."
    )]
    Salvage(SalvageArgs),

    /// Make a session from the published dataset's files.
    #[command(
        after_help = "Example:\n  skinrig import --camera1 camera1.hdf5 --camera2 camera2.hdf5 \\\n    \
        --presses press_positions.csv --schedule protocols/paper-recording.schedule.yaml"
    )]
    Import(ImportArgs),

    /// Write a session's data in other programs' formats.
    #[command(
        after_help = "Examples:\n  skinrig export sessions/NAME.session.sqlite --to parquet --out export/\n  \
        skinrig export sessions/NAME.session.sqlite --to csv --only presses --only results\n  \
        skinrig export sessions/NAME.session.sqlite --to bundle --out NAME.bundle"
    )]
    Export(ExportArgs),

    /// Print what is in a RAW, HDF5 or session file.
    #[command(after_help = "Example:\n  skinrig inspect recording.raw")]
    Inspect(InspectArgs),

    /// Print the JSON Schema of protocols, schedules, rig files or limits, for editors.
    #[command(after_help = "Example:\n  skinrig schema > skinrig.schema.json")]
    Schema(SchemaArgs),

    /// Brake the robot's arm when the program that started this one dies.
    #[command(hide = true)]
    SuperviseArm,

    /// Hold the arm in free air as long as the program that started this one lives.
    #[command(hide = true)]
    HoldArm(HoldArmArgs),
}

/// A limit that something can be above or below.
fn limit_mm(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(mm) if mm > 0.0 && mm.is_finite() => Ok(mm),
        _ => Err(format!("expected a number of mm above 0, found {text}")),
    }
}

/// A protocol with overrides.
#[derive(Debug, Args)]
pub struct ProtocolArgs {
    /// The protocol file.
    pub protocol: PathBuf,

    /// Override one value of the protocol, for example `path.meander.pitch=6mm`. Can be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,
}

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

    /// Seed of the run and of the simulated rig; the protocol's seed when absent.
    #[arg(long, conflicts_with = "replay")]
    pub seed: Option<u64>,

    /// Simulation level (kinematic, geometric, optical); the cheapest that the protocol's scene needs when absent.
    #[arg(long, conflicts_with = "replay")]
    pub level: Option<String>,

    /// Run the simulated rig at the speed of a real one.
    #[arg(long, conflicts_with = "replay")]
    pub real_time: bool,

    /// Make this fault on purpose, for rehearsals on the simulated rig, such as camera1-stalled@hold:3 (docs/faults.md lists
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

    /// Run the simulated rig at the speed of a real one.
    #[arg(long, conflicts_with = "rig")]
    pub real_time: bool,

    /// Record only.
    #[arg(long)]
    pub no_analysis: bool,

    /// Accept a robot or camera with another serial number than the session's; it is recorded.
    #[arg(long)]
    pub allow_other_device: bool,

    /// Make this fault on purpose, for rehearsals on the simulated rig, such as camera1-stalled@hold:3 (docs/faults.md lists
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

/// Arguments of `sessions`.
#[derive(Debug, Args)]
pub struct SessionsArgs {
    /// The folder.
    #[arg(default_value = "sessions")]
    pub folder: PathBuf,

    /// Only sessions of this prototype.
    #[arg(long)]
    pub prototype: Option<String>,

    /// Only sessions with this tag. Can be given several times: with all of them.
    #[arg(long = "tag", value_name = "TAG")]
    pub tags: Vec<String>,
}

/// Arguments of `prototypes`.
#[derive(Debug, Args)]
pub struct PrototypesArgs {
    /// The folder.
    #[arg(default_value = "sessions")]
    pub folder: PathBuf,

    /// Only this prototype, with every session of it.
    #[arg(long)]
    pub prototype: Option<String>,
}

/// Arguments of `tag`.
#[derive(Debug, Args)]
pub struct TagArgs {
    /// The session file; of a folder the session that is being written, else the newest.
    pub session: PathBuf,

    /// Tags to give, and with a `-` before them tags to take away.
    #[arg(value_name = "TAG|-TAG")]
    pub tags: Vec<String>,

    /// A tag to take away: the same as `-TAG`.
    #[arg(long, value_name = "TAG")]
    pub remove: Vec<String>,

    /// A remark.
    #[arg(long, value_name = "TEXT")]
    pub note: Option<String>,

    /// Who says so; the name under which you are logged in when absent.
    #[arg(long, value_name = "NAME")]
    pub by: Option<String>,
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

/// A session file or a bundle.
#[derive(Debug, Args)]
pub struct SessionArg {
    /// The session file, or the folder of a bundle.
    pub session: PathBuf,
}

/// Arguments of `show`.
#[derive(Debug, Args)]
pub struct ShowArgs {
    /// The session file.
    pub session: PathBuf,

    /// Also list every press.
    #[arg(long)]
    pub presses: bool,

    /// Also print the protocol text.
    #[arg(long)]
    pub protocol: bool,
}

/// Arguments of `analyze`.
#[derive(Debug, Args)]
pub struct AnalyzeArgs {
    /// The session file.
    pub session: PathBuf,

    /// Override one analysis setting of the session's protocol, for example `analysis.min_samples=5`.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,

    /// Make the choices of the public analysis code (docs/paper.md lists them) and report its numbers beside; `--set`
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

/// A length above 0, mm.
fn length_mm(text: &str) -> Result<f64, String> {
    above_zero(text, Dimension::Length)
}

/// A time above 0, s.
fn time_s(text: &str) -> Result<f64, String> {
    above_zero(text, Dimension::Time)
}

fn above_zero(text: &str, dimension: Dimension) -> Result<f64, String> {
    match quantity::parse(text, &[dimension]) {
        Ok(found) if found.value > 0.0 => Ok(found.value),
        Ok(_) => Err(format!(
            "expected {} above 0, found {text}",
            dimension.name()
        )),
        Err(e) => Err(format!("expected {}, found {}", e.expected, e.found)),
    }
}

/// A probability, neither 0 nor 1.
fn probability(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value < 1.0 => Ok(value),
        _ => Err(format!(
            "expected a probability between 0 and 1, found {text}"
        )),
    }
}

/// A share from 0 to 1.
fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err(format!("expected a share from 0 to 1, found {text}")),
    }
}

/// A share of presses.
fn percent(text: &str) -> Result<f64, String> {
    match text.trim_end_matches('%').trim().parse::<f64>() {
        Ok(value) if (0.0..=100.0).contains(&value) => Ok(value),
        _ => Err(format!("expected a share from 0% to 100%, found {text}")),
    }
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

    /// Where to write the page; beside the session when absent.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Arguments of `import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// Camera 1: bimvee HDF5 or Prophesee RAW.
    #[arg(long, value_name = "FILE")]
    pub camera1: PathBuf,

    /// Camera 2: bimvee HDF5 or Prophesee RAW.
    #[arg(long, value_name = "FILE")]
    pub camera2: PathBuf,

    /// Press positions, CSV with a header naming at least x and y.
    #[arg(long, value_name = "CSV")]
    pub presses: PathBuf,

    /// How the recording was made.
    #[arg(long, value_name = "YAML")]
    pub schedule: PathBuf,

    /// Override one value of the schedule. Can be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,

    /// Which event stream to take from a file that holds several, for example `data/left/dvs`.
    #[arg(long, value_name = "NAME")]
    pub stream1: Option<String>,

    /// The same for camera 2.
    #[arg(long, value_name = "NAME")]
    pub stream2: Option<String>,

    /// Folder for the session file, its results and its report.
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    pub sessions: PathBuf,

    /// Import only; analyse later.
    #[arg(long)]
    pub no_analysis: bool,
}

/// In which formats `export` can write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExportKind {
    /// Tables as Parquet, one file each.
    Parquet,
    /// Tables as one numpy archive of structured arrays.
    Npz,
    /// Tables as CSV, one file each.
    Csv,
    /// One Prophesee RAW file per camera, bytes as recorded.
    Raw,
    /// One bimvee HDF5 file per camera.
    Hdf5,
    /// A folder with the session, results, report, RAW files and tables, that `skinrig verify` proves elsewhere.
    Bundle,
    /// All of them but a bundle.
    All,
}

impl ExportKind {
    /// Whether it holds tables.
    #[must_use]
    pub const fn is_tabular(self) -> bool {
        matches!(self, Self::Parquet | Self::Npz | Self::Csv)
    }
}

/// Which tables `export` writes; docs/python.md describes their columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExportTable {
    /// One row per press, with what both cameras saw and where the skin says it was touched.
    Presses,
    /// One row per metric.
    Results,
    /// One row per sample of the robot's path.
    Pose,
    /// One row per event, a table for each camera.
    Events,
}

/// Arguments of `export`.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The session file.
    pub session: PathBuf,

    /// The format. Can be given several times.
    #[arg(long = "to", value_enum, required = true)]
    pub kinds: Vec<ExportKind>,

    /// Only these tables, in the formats that hold tables; all of them when absent. Can be given several times.
    #[arg(long, value_enum)]
    pub only: Vec<ExportTable>,

    /// Folder to write into, and nowhere else; `NAME.export` (or `NAME.bundle`) beside the session when absent.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,

    /// Replace files of an earlier export.
    #[arg(long)]
    pub overwrite: bool,
}

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub struct InspectArgs {
    /// The file.
    pub file: PathBuf,

    /// Report silences longer than this, in ms.
    #[arg(long, value_name = "MS", default_value_t = 1000.0)]
    pub gap: f64,
}

/// Which schema.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SchemaKind {
    /// Protocols (`run`, `check`, `plan`).
    Protocol,
    /// Schedules (`import`).
    Schedule,
    /// Rig files (`--rig`).
    Rig,
    /// Limits (`compare`).
    Limits,
    /// Suites (`hil run`).
    Suite,
}

/// Arguments of `schema`.
#[derive(Debug, Args)]
pub struct SchemaArgs {
    /// Which schema.
    #[arg(value_enum, default_value = "protocol")]
    pub kind: SchemaKind,
}

/// `salvage`.
#[derive(Debug, Args)]
pub struct SalvageArgs {
    /// The damaged session file; its log (`-wal`) is read too when it lies beside it.
    pub session: PathBuf,

    /// The new file (default: NAME.salvaged.session.sqlite beside it).
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}
