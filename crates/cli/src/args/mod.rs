//! The command line: commands, and the arguments that several of them share.

mod bench;
mod challenge;
mod doctor;
mod evaluate;
mod files;
mod groups;
mod repeated;
mod scene;
mod twin;
mod values;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

pub(crate) use self::bench::{
    ControlArgs, DetectArgs, DevicesArgs, JogArgs, LearnSkinArgs, NoteArgs, PlanArgs, ResumeArgs,
    RunArgs, StatusArgs, TakeLookArgs, ViewArgs, WatchArgs,
};
pub(crate) use self::challenge::{
    ChallengeArgs, ChallengeCommand, ExamineArgs, MakeArgs, ScoreArgs,
};
pub(crate) use self::doctor::DoctorArgs;
pub(crate) use self::evaluate::{
    AnalyzeArgs, CompareArgs, CostKind, OnlineArgs, ReportArgs, TradeoffArgs,
};
pub(crate) use self::files::{
    CompletionsArgs, Exclude, ExportArgs, ExportKind, ExportTable, ImportArgs, InitArgs,
    InspectArgs, LakeArgs, ManArgs, NewArgs, PrototypesArgs, PublishArgs, ReproduceArgs,
    SalvageArgs, SchemaArgs, SchemaKind, SelectArgs, SessionsArgs, ShowArgs, TagArgs,
};
pub(crate) use self::groups::{command, parse};
pub(crate) use self::scene::{SceneArgs, SceneCheckArgs, SceneCommand, ScenePredictArgs};
pub(crate) use self::twin::TwinArgs;
pub(crate) use self::values::StopRule;
use crate::catalogue::args::CatalogueArgs;
use crate::exit::Exit;
use crate::hil::args::{HilArgs, HoldArmArgs};
use crate::reanalyze::args::ReanalyzeArgs;
use crate::store::args::StoreArgs;

/// Runs tactile-skin experiments: protocol, robot, event cameras, session, analysis, report.
#[derive(Debug, Parser)]
#[command(name = "skinrig", version = crate::version::VERSION, about, after_help = Exit::HELP, arg_required_else_help = true)]
pub(crate) struct Cli {
    /// Print results as JSON; messages go to standard error.
    #[arg(long, global = true)]
    pub json: bool,

    /// Print all figures of an analysis, not only the answer
    #[arg(short, long, global = true)]
    pub verbose: bool,

    /// The command.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Create a lab folder: protocols to copy from, rig file, suites of checks, schemas for editors.
    #[command(
        after_help = "Example:\n  skinrig init lab && cd lab && skinrig run protocols/demo.yaml\n\n\
        Existing files are kept; schemas are updated."
    )]
    Init(InitArgs),

    /// Write a starter protocol.
    #[command(after_help = "Examples:\n  skinrig new depth-sweep\n  \
        skinrig new own-outline protocols/round-skin.yaml")]
    New(NewArgs),

    /// Check a protocol and every motion it would make, without moving anything.
    #[command(after_help = "Example:\n  skinrig check protocols/demo.yaml")]
    Check(ProtocolArgs),

    /// Compile a protocol into steps; print them or draw the path.
    #[command(
        after_help = "Examples:\n  skinrig plan protocols/paper-meander.yaml --svg path.svg\n  \
        skinrig plan protocols/demo.yaml --set path.meander.pitch=6mm --steps\n  \
        skinrig plan --detect \"1 mm\" --power 0.8 --from sessions/NAME.session.sqlite"
    )]
    Plan(PlanArgs),

    /// Run a protocol on the simulated rig or a bench: record, analyse and report.
    #[command(after_help = "Examples:\n  skinrig run protocols/demo.yaml\n  \
        skinrig run protocols/demo.yaml --level optical --seed 7\n  \
        skinrig run protocols/quick-check.yaml --rig hil/rigs/NAME.yaml\n  \
        skinrig run --replay sessions/NAME.session.sqlite\n\n\
        ctrl-C once stops after the current press, twice retracts and stops now,\n\
        three times switches the motors off where the tip is. The session is closed and stays readable.")]
    Run(RunArgs),

    /// Continue a session that was interrupted, stopped or ended by a fault, or retake presses lost to a rig fault.
    #[command(
        after_help = "Examples:\n  skinrig resume sessions/NAME.session.sqlite\n  \
        skinrig resume sessions/NAME.session.sqlite --rig hil/rigs/NAME.yaml\n\n\
        The rig is checked and the sync presses are repeated. Then every press without an outcome is made; an interrupted\n\
        press gets a new attempt. A valid press is never repeated."
    )]
    Resume(ResumeArgs),

    /// Show how a run is going, or how it ended (read-only).
    #[command(after_help = "Examples:\n  skinrig status\n  \
        skinrig status sessions/NAME.session.sqlite --json")]
    Status(StatusArgs),

    /// Pause, resume, stop, abort or halt a run from another terminal.
    #[command(after_help = "Examples:\n  skinrig control sessions/ pause\n  \
        skinrig control sessions/NAME.session.sqlite pause-now --wait 30s\n\n\
        Returns when the run has acknowledged the request, with the run's state. Only the run's own user and root may control it.")]
    Control(ControlArgs),

    /// Add a note to a running session, with the time and your name.
    #[command(after_help = "Example:\n  skinrig note sessions/ \"the lamp flickers\"")]
    Note(NoteArgs),

    /// List the connected robot, cameras and trigger box, and what prevents their use.
    #[command(
        after_help = "Examples:\n  skinrig devices\n  skinrig devices --rig hil/rigs/NAME.yaml"
    )]
    Devices(DevicesArgs),

    /// Check that this computer is ready for the bench (permissions, cables, versions, disk, real-time limits, clock) and say what to fix.
    #[command(
        after_help = "Examples:\n  skinrig doctor\n  skinrig doctor --rig hil/rigs/NAME.yaml --sessions sessions/\n\n\
        Nothing moves. Opening the trigger box's port resets the box. Exit code 3 when there is a problem."
    )]
    Doctor(DoctorArgs),

    /// Move the robot with typed commands, within the rig file's limits, and record touched points.
    #[command(after_help = "Examples:\n  skinrig jog --rig hil/rigs/NAME.yaml\n  \
        printf 'z +5mm\\ntouch 20mm\\npoint nw at -30 40 0 mm\\n' | skinrig jog\n\n\
        ctrl-C holds, retracts and disarms; pressed three times, it cuts the motors where the tip is. Coordinates are in the robot's frame. Type `help` for the commands.")]
    Jog(JogArgs),

    /// Run hardware-in-the-loop checks of a bench: nightly, before a campaign, or after a change.
    Hil(HilArgs),

    /// Follow a run in the terminal until it ends (read-only; it cannot slow the run down).
    #[command(after_help = "Examples:\n  skinrig watch\n  \
        skinrig watch sessions/NAME.session.sqlite --once")]
    Watch(WatchArgs),

    /// Show sessions in the browser, live and afterwards: press map, events, poses, the folder's shelf.
    #[command(after_help = "Examples:\n  skinrig view sessions/\n  \
        skinrig view sessions/NAME.session.sqlite --control\n\n\
        Prints a link with a random token. Only this computer can open it, unless --bind names another address.")]
    View(ViewArgs),

    /// List recorded sessions.
    #[command(after_help = "Examples:\n  skinrig sessions sessions/\n  \
        skinrig sessions --prototype \"skin 7\" --tag good-skin")]
    Sessions(SessionsArgs),

    /// Search all sessions: a database of sessions, analyses, devices, nights and prototypes that answers questions.
    #[command(
        after_help = "Example:\n  skinrig catalogue query best-prototypes min_sessions=5 --folder sessions/\n\n\
        Everything in it is read from the files: delete it, and `skinrig catalogue rebuild` makes it again."
    )]
    Catalogue(CatalogueArgs),

    /// Keep sessions in an S3-compatible store, and read them there (builds with `--features s3`).
    #[command(
        after_help = "Example:\n  skinrig store put sessions/NAME.session.sqlite --to s3://lab/2026\n\n\
        Every command reads a session through its reference, by ranges. AWS_ENDPOINT_URL, AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and\n\
        AWS_DEFAULT_REGION name the store and its user, as for Amazon's tools."
    )]
    Store(StoreArgs),

    /// List the prototypes in a folder: sessions, best and latest RMSE, trend over time.
    #[command(after_help = "Examples:\n  skinrig prototypes\n  \
        skinrig prototypes sessions/ --prototype \"skin 7\"")]
    Prototypes(PrototypesArgs),

    /// Add or remove tags and remarks on a session; the session file itself does not change.
    #[command(
        after_help = "Examples:\n  skinrig tag sessions/NAME.session.sqlite good-skin -bad\n  \
        skinrig tag sessions/NAME.session.sqlite --note \"the lamp had been replaced\"\n\n\
        Without tags and notes, prints those of the session. A tag has 1 to 40 of a-z, 0-9, `.`, `_`, `-`."
    )]
    Tag(TagArgs),

    /// Describe one session: protocol, rig, devices, presses and losses.
    #[command(after_help = "Example:\n  skinrig show sessions/NAME.session.sqlite --presses")]
    Show(ShowArgs),

    /// Analyse a session, write the results beside it and print them.
    #[command(
        after_help = "Examples:\n  skinrig analyze sessions/NAME.session.sqlite\n  \
        skinrig analyze sessions/NAME.session.sqlite --set analysis.centroid=all_clusters --out other.json\n  \
        skinrig analyze sessions/NAME.session.sqlite --reference-code"
    )]
    Analyze(AnalyzeArgs),

    /// Analyse many sessions again with other settings; each result is a variant beside its session.
    #[command(
        after_help = "Examples:\n  skinrig reanalyze --settings wider.yaml sessions/\n  \
        skinrig reanalyze --settings wider.yaml --name wider --jobs 4 lamp-on.selection.yaml\n\n\
        Repeat an interrupted command to finish it: sealed sessions with complete results of these settings are not analysed\n\
        again. A session that fails does not stop the others."
    )]
    Reanalyze(ReanalyzeArgs),

    /// Write a session's HTML report, analysing the session first if needed.
    #[command(
        after_help = "Example:\n  skinrig report sessions/NAME.session.sqlite --out report.html"
    )]
    Report(ReportArgs),

    /// Compare skins: whether they are comparable, which one is better, at what, where and why.
    #[command(
        after_help = "Examples:\n  skinrig compare sessions/OLD.session.sqlite sessions/NEW.session.sqlite --margin rmse=0.5mm\n  \
        skinrig compare \"mold 3\" \"mold 4\" \"mold 5\" --sessions sessions/ --limits protocols/comparison.limits.yaml\n\n\
        Each skin is compared with the first, location by location. Skins that are not comparable end with exit code 2 and the reason;\n\
        --despite KEY overrides it, and the table and the page say so. docs/reference/comparison.md has the rules."
    )]
    Compare(CompareArgs),

    /// Measure the trade-off between speed and accuracy on a session: estimators, windows, thinning, bins, rows.
    #[command(
        after_help = "Examples:\n  skinrig tradeoff sessions/NAME.session.sqlite\n  \
        skinrig tradeoff sessions/NAME.session.sqlite --target-rmse 6mm --budget 100us --pixels 64x48"
    )]
    Tradeoff(TradeoffArgs),

    /// Check how like a camera the events of a session are, and how like its scene the session is.
    #[command(
        after_help = "Examples:\n  skinrig scene check sessions/NAME.session.sqlite\n  \
        skinrig scene predict sessions/NAME.session.sqlite"
    )]
    Scene(SceneArgs),

    /// Fit the simulated skin that resembles the skin of a session, and predict errors of other presses with it.
    #[command(
        after_help = "Examples:\n  skinrig twin sessions/NAME.session.sqlite\n  \
        skinrig twin sessions/NAME.session.sqlite --set depth=3mm\n  \
        skinrig twin IMPORTED.session.sqlite --protocol protocols/paper.yaml\n\n\
        The fit sees the calibration presses alone; the scored ones test it. The twin is a protocol that every command takes.\n\
        Prediction of the changed protocol (--set) takes the time of the fit again."
    )]
    Twin(TwinArgs),

    /// Replay a session as a live source: how soon touches are felt, where, and how often wrongly.
    #[command(
        after_help = "Examples:\n  skinrig online sessions/NAME.session.sqlite\n  \
        skinrig online sessions/NAME.session.sqlite --speed 1 --json\n  \
        skinrig online sessions/NAME.session.sqlite --stop-at 2mm --false-alarms 0.01\n\n\
        Learns from the calibration presses, replays all presses, evaluates the scored ones. --json prints one line per estimate.\n\
        ctrl-C ends the replay with the answer so far (exit code 5)."
    )]
    Online(OnlineArgs),

    /// Verify every checksum, count and hash of a session or of a bundle made by `export`.
    #[command(
        after_help = "Examples:\n  skinrig verify sessions/NAME.session.sqlite\n  skinrig verify NAME.bundle --signers signers"
    )]
    Verify(VerifyArgs),

    /// Copy the intact part of a damaged session into a new file, and list what was lost.
    #[command(
        after_help = "Example:\n  skinrig salvage sessions/NAME.session.sqlite\n\n\
        The damaged file is only read. Exit code 4 if something is known to be lost."
    )]
    Salvage(SalvageArgs),

    /// Write a selection: sessions by the hash of their content, and presses that do not count, with reasons.
    #[command(
        after_help = "Example:\n  skinrig select sessions/NAME.session.sqlite --name \"mold 3, lamp on\" \\\n    \
        --exclude \"7,12-14=the lamp failed\" --decided-by \"A. Person\" --out lamp-on.selection.yaml\n\n\
        `analyze`, `report`, `compare`, `tradeoff`, `export` and `verify` take a selection for a session. Results from it are variants,\n\
        name its hash, and state the RMSE without it."
    )]
    Select(SelectArgs),

    /// Import the published dataset's files as a session.
    #[command(
        after_help = "Example:\n  skinrig import --camera1 camera1.hdf5 --camera2 camera2.hdf5 \\\n    \
        --presses press_positions.csv --schedule protocols/paper-recording.schedule.yaml"
    )]
    Import(ImportArgs),

    /// Export a session's data to other programs' formats.
    #[command(
        after_help = "Examples:\n  skinrig export sessions/NAME.session.sqlite --to parquet --out export/\n  \
        skinrig export sessions/NAME.session.sqlite --to csv --only presses --only results\n  \
        skinrig export sessions/NAME.session.sqlite --to bundle --out NAME.bundle"
    )]
    Export(ExportArgs),

    /// Add sessions to a data lake: presses, estimates, features, metrics and poses as one Parquet dataset.
    #[command(after_help = "Example:\n  skinrig lake sessions/ --to lake/\n\n\
        Partitions: analysis version, prototype, bench, day. Sessions that are there are not added again. In DuckDB, the\n\
        mean error of the scored presses that count:\n  \
        SELECT p.prototype, avg(e.error_mm)\n  \
        FROM read_parquet('lake/estimates/**/*.parquet', hive_partitioning = true) e\n  \
        JOIN read_parquet('lake/presses/**/*.parquet', hive_partitioning = true) p USING (analysis, session_id, press)\n  \
        WHERE p.role = 'score' AND p.verdict = 'valid' GROUP BY p.prototype")]
    Lake(LakeArgs),

    /// Publish sessions or a selection as an RO-Crate: data card, checksums, bundles, protocols, and numbers to derive again.
    #[command(
        after_help = "Example:\n  skinrig publish sessions/NAME.session.sqlite --about publication.yaml --out crate/\n\n\
        `skinrig schema publication` has the keys of the file for --about: title, description, people, licence, known limits."
    )]
    Publish(PublishArgs),

    /// Check a published crate: every checksum, and every headline number derived again, bit by bit.
    #[command(
        after_help = "Example:\n  skinrig reproduce crate/\n\nExit code 4 if anything differs."
    )]
    Reproduce(ReproduceArgs),

    /// Give a session's events away with the scored positions sealed, and score estimates from anywhere.
    #[command(
        after_help = "Examples:\n  skinrig challenge make sessions/NAME.session.sqlite --out challenge/\n  \
        skinrig challenge score challenge/ estimates.csv --answers sessions/NAME.answers.json"
    )]
    Challenge(ChallengeArgs),

    /// Print what a RAW, HDF5 or session file contains.
    #[command(after_help = "Example:\n  skinrig inspect recording.raw")]
    Inspect(InspectArgs),

    /// Print the JSON Schema of protocols, schedules, rig files, suites or limits, for editors.
    #[command(after_help = "Example:\n  skinrig schema > skinrig.schema.json")]
    Schema(SchemaArgs),

    /// Print shell completions: the Tab key completes commands, options and their values.
    #[command(
        after_help = "Examples:\n  skinrig completions bash > ~/.local/share/bash-completion/completions/skinrig\n  \
                      skinrig completions zsh > ~/.zfunc/_skinrig        (with ~/.zfunc in fpath)\n  \
                      skinrig completions fish > ~/.config/fish/completions/skinrig.fish"
    )]
    Completions(CompletionsArgs),

    /// Write a manual page for each command.
    #[command(after_help = "Example:\n  skinrig man ~/.local/share/man/man1 && man skinrig-run")]
    Man(ManArgs),

    /// Look at the data of a campaign that is under way.
    #[command(hide = true)]
    TakeLook(TakeLookArgs),

    /// Learn what a touch is from a session that is under way.
    #[command(hide = true)]
    LearnSkin(LearnSkinArgs),

    /// Carry out one request of a re-analysis.
    #[command(hide = true)]
    AnalyzeRequest,

    /// Brake the robot's arm if the program that started this one dies.
    #[command(hide = true)]
    SuperviseArm,

    /// Hold the arm in free air while the program that started this one is running.
    #[command(hide = true)]
    HoldArm(HoldArmArgs),
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

/// Arguments of `verify`.
#[derive(Debug, Args)]
pub(crate) struct VerifyArgs {
    /// The session file, a selection, or the folder of a bundle.
    pub session: PathBuf,

    /// Require a signature of the bundle by a key in this file of allowed signers, with lines such as `NAME ssh-ed25519 KEY`.
    #[arg(long, value_name = "FILE")]
    pub signers: Option<PathBuf>,
}
