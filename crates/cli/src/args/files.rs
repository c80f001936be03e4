//! Arguments of the commands that list, show and convert files.

use std::path::PathBuf;

use crate::new::ProtocolKind;
use clap::{Args, ValueEnum};

/// Arguments of `sessions`.
#[derive(Debug, Args)]
pub(crate) struct SessionsArgs {
    /// The folder of sessions.
    #[arg(default_value = "sessions")]
    pub folder: PathBuf,

    /// List only sessions of this prototype.
    #[arg(long)]
    pub prototype: Option<String>,

    /// List only sessions with this tag. Given several times, a session needs all of them.
    #[arg(long = "tag", value_name = "TAG")]
    pub tags: Vec<String>,
}

/// Arguments of `prototypes`.
#[derive(Debug, Args)]
pub(crate) struct PrototypesArgs {
    /// The folder of sessions.
    #[arg(default_value = "sessions")]
    pub folder: PathBuf,

    /// Show only this prototype, with each of its sessions.
    #[arg(long)]
    pub prototype: Option<String>,

    /// List this named variant (`skinrig analyze --name`) of each session [default: the official analyses].
    #[arg(long, value_name = "NAME", value_parser = crate::analyses::parse)]
    pub analysis: Option<String>,
}

/// Arguments of `tag`.
#[derive(Debug, Args)]
pub(crate) struct TagArgs {
    /// The session file.
    pub session: PathBuf,

    /// Tags to add; a leading `-` removes a tag.
    #[arg(value_name = "TAG|-TAG")]
    pub tags: Vec<String>,

    /// Remove this tag: the same as `-TAG`.
    #[arg(long, value_name = "TAG")]
    pub remove: Vec<String>,

    /// Add a remark.
    #[arg(long, value_name = "TEXT")]
    pub note: Option<String>,

    /// Author [default: your login name].
    #[arg(long, value_name = "NAME")]
    pub by: Option<String>,
}

/// Arguments of `show`.
#[derive(Debug, Args)]
pub(crate) struct ShowArgs {
    /// The session file.
    pub session: PathBuf,

    /// Also list every press.
    #[arg(long)]
    pub presses: bool,

    /// Also print the protocol text.
    #[arg(long)]
    pub protocol: bool,
}

/// Arguments of `import`.
#[derive(Debug, Args)]
pub(crate) struct ImportArgs {
    /// Camera 1: bimvee HDF5 or Prophesee RAW.
    #[arg(long, value_name = "FILE")]
    pub camera1: PathBuf,

    /// Camera 2: bimvee HDF5 or Prophesee RAW.
    #[arg(long, value_name = "FILE")]
    pub camera2: PathBuf,

    /// Press positions: a CSV file whose header names at least x and y.
    #[arg(long, value_name = "CSV")]
    pub presses: PathBuf,

    /// The schedule: how the recording was made.
    #[arg(long, value_name = "YAML")]
    pub schedule: PathBuf,

    /// Override one value of the schedule. Can be given several times.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub overrides: Vec<String>,

    /// Event stream to read from a file that holds several, for example `data/left/dvs`.
    #[arg(long, value_name = "NAME")]
    pub stream1: Option<String>,

    /// Likewise for camera 2.
    #[arg(long, value_name = "NAME")]
    pub stream2: Option<String>,

    /// Folder for the session file, results and report.
    #[arg(long, value_name = "DIR", default_value = "sessions")]
    pub sessions: PathBuf,

    /// Import only; skip the analysis.
    #[arg(long)]
    pub no_analysis: bool,
}

/// Formats that `export` can write.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportKind {
    /// Tables as Parquet, one file each.
    Parquet,
    /// Tables as one NumPy archive of structured arrays.
    Npz,
    /// Tables as CSV, one file each.
    Csv,
    /// One Prophesee RAW file per camera, with the bytes as recorded.
    Raw,
    /// One bimvee HDF5 file per camera.
    Hdf5,
    /// A folder with the session, results, report, RAW files and tables, which `skinrig verify` can check anywhere.
    Bundle,
    /// All formats except the bundle.
    All,
}

impl ExportKind {
    /// True for formats that hold tables.
    #[must_use]
    pub(crate) const fn is_tabular(self) -> bool {
        matches!(self, Self::Parquet | Self::Npz | Self::Csv)
    }
}

/// Which tables `export` writes; docs/reference/exports.md describes their columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ExportTable {
    /// One row per press: events of both cameras and the estimated location.
    Presses,
    /// One row per metric.
    Results,
    /// One row per robot pose.
    Pose,
    /// One row per event, one table per camera.
    Events,
}

/// Arguments of `export`.
#[derive(Debug, Args)]
pub(crate) struct ExportArgs {
    /// The session file, or a selection.
    pub session: PathBuf,

    /// Output format. Can be given several times.
    #[arg(long = "to", value_enum, required = true)]
    pub kinds: Vec<ExportKind>,

    /// Write only these tables, in the formats that hold tables [default: all]. Can be given several times.
    #[arg(long, value_enum)]
    pub only: Vec<ExportTable>,

    /// Folder to write into [default: `NAME.export`, or `NAME.bundle`, beside the session].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,

    /// Sign the manifest of a bundle with this private key of `ssh-keygen`.
    #[arg(long, value_name = "KEY")]
    pub sign: Option<PathBuf>,

    /// Overwrite the files of an earlier export.
    #[arg(long)]
    pub overwrite: bool,
}

/// Presses that do not count, and why.
#[derive(Debug, Clone)]
pub(crate) struct Exclude {
    /// Numbers and spans, separated by commas.
    pub presses: String,
    pub reason: String,
}

/// Arguments of `select`.
#[derive(Debug, Args)]
pub(crate) struct SelectArgs {
    /// Sealed session files.
    #[arg(required = true, value_name = "SESSION")]
    pub sessions: Vec<PathBuf>,

    /// Name of the selection; results from it show the name.
    #[arg(long)]
    pub name: String,

    /// Presses that do not count, and why, for example `"7,12-14=the lamp failed"`. Can be given several times.
    #[arg(long, value_name = "PRESSES=REASON", value_parser = super::values::exclude, requires = "decided_by")]
    pub exclude: Vec<Exclude>,

    /// Who decided on the exclusions.
    #[arg(long, value_name = "PERSON")]
    pub decided_by: Option<String>,

    /// The file to write.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

/// Arguments of `lake`.
#[derive(Debug, Args)]
pub(crate) struct LakeArgs {
    /// Sealed session files, or folders of sessions.
    #[arg(required = true, value_name = "SESSION")]
    pub sessions: Vec<PathBuf>,

    /// Folder of the lake; created if missing.
    #[arg(long, value_name = "DIR")]
    pub to: PathBuf,
}

/// Arguments of `publish`.
#[derive(Debug, Args)]
pub(crate) struct PublishArgs {
    /// Sealed session files, or one selection.
    #[arg(required = true, value_name = "SESSION")]
    pub sessions: Vec<PathBuf>,

    /// File with what skinrig cannot know: title, description, people, licence, known limits.
    #[arg(long, value_name = "FILE")]
    pub about: PathBuf,

    /// A new folder for the crate.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,

    /// Sign the description with this private key of `ssh-keygen`.
    #[arg(long, value_name = "KEY")]
    pub sign: Option<PathBuf>,
}

/// Arguments of `reproduce`.
#[derive(Debug, Args)]
pub(crate) struct ReproduceArgs {
    /// The folder of the crate.
    #[arg(value_name = "CRATE")]
    pub folder: PathBuf,

    /// Require a signature by a key in this file of allowed signers, with lines such as `NAME ssh-ed25519 KEY`.
    #[arg(long, value_name = "FILE")]
    pub signers: Option<PathBuf>,
}

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub(crate) struct InspectArgs {
    /// The file.
    pub file: PathBuf,

    /// Report silences longer than this, in ms.
    #[arg(long, value_name = "MS", default_value_t = 1000.0)]
    pub gap: f64,
}

/// The schema to print.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SchemaKind {
    /// Protocols (`run`, `check`, `plan`).
    Protocol,
    /// Schedules (`import`).
    Schedule,
    /// Rig files (`--rig`).
    Rig,
    /// Limits (`compare`).
    Limits,
    /// Selections (`select`).
    Selection,
    /// What a publication states (`publish --about`).
    Publication,
    /// Settings (`reanalyze --settings`).
    Settings,
    /// Suites (`hil run`).
    Suite,
}

/// `new`.
#[derive(Debug, Args)]
pub(crate) struct NewArgs {
    /// What the protocol is for.
    #[arg(value_enum)]
    pub kind: ProtocolKind,
    /// The file to write [default: the kind's name in this folder].
    pub file: Option<PathBuf>,
}

/// `init`.
#[derive(Debug, Args)]
pub(crate) struct InitArgs {
    /// The folder; created if it is missing.
    #[arg(default_value = ".")]
    pub folder: PathBuf,
}

/// Arguments of `schema`.
#[derive(Debug, Args)]
pub(crate) struct SchemaArgs {
    /// The schema to print.
    #[arg(value_enum, default_value = "protocol")]
    pub kind: SchemaKind,
}

/// `completions`.
#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell.
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// `man`.
#[derive(Debug, Args)]
pub(crate) struct ManArgs {
    /// The folder; created if it is missing.
    pub folder: PathBuf,
}

/// `salvage`.
#[derive(Debug, Args)]
pub(crate) struct SalvageArgs {
    /// The damaged session file; its write-ahead log (`-wal`) is also read if it is beside it.
    pub session: PathBuf,

    /// The new file [default: NAME.salvaged.session.sqlite beside it].
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}
