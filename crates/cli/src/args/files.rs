//! Arguments of what lists, shows and converts files.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

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

    /// List the variant of this name (`skinrig analyze --name`) of each session; the official analyses when absent.
    #[arg(long, value_name = "NAME", value_parser = crate::analyses::parse)]
    pub analysis: Option<String>,
}

/// Arguments of `tag`.
#[derive(Debug, Args)]
pub struct TagArgs {
    /// The session file.
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
    pub(crate) const fn is_tabular(self) -> bool {
        matches!(self, Self::Parquet | Self::Npz | Self::Csv)
    }
}

/// Which tables `export` writes; docs/reference/exports.md describes their columns.
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
