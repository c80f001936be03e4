//! The command line of `skinrig catalogue`.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use skinrig_catalogue::{Address, Question, ROLES};

/// Arguments of `catalogue`.
#[derive(Debug, Args)]
pub(crate) struct CatalogueArgs {
    /// The command.
    #[command(subcommand)]
    pub command: CatalogueCommand,
}

/// The commands of `catalogue`.
#[derive(Debug, Subcommand)]
pub(crate) enum CatalogueCommand {
    /// Read every session of a folder into its catalogue again; creates a missing or damaged one.
    #[command(after_help = "Examples:\n  skinrig catalogue rebuild sessions/\n  \
        skinrig catalogue rebuild sessions/ --nights nights/")]
    Rebuild(FolderArgs),

    /// Show which sessions of a folder are not in its catalogue as they are, and which cannot be read.
    #[command(after_help = "Example:\n  skinrig catalogue status sessions/")]
    Status(StatusArgs),

    /// Register sessions, or whatever is stale in a folder. Repeating it changes nothing.
    #[command(after_help = "Examples:\n  skinrig catalogue register sessions/\n  \
        skinrig catalogue register sessions/NAME.session.sqlite\n  \
        skinrig catalogue register sessions/ --catalogue postgres://ann@db.lab/skins\n\n\
        `run`, `resume`, `import`, `analyze` and `tag` register their session by themselves, in the file of its folder; a server learns of it by\n\
        this command.")]
    Register(RegisterArgs),

    /// Create the roles of a catalogue on a server, and give them their rights.
    #[command(after_help = roles_help())]
    Roles(RolesArgs),

    /// Answer a question about all sessions; without a name, list the questions.
    #[command(
        after_help = "Examples:\n  skinrig catalogue query\n  skinrig catalogue query best-prototypes min_sessions=5\n  \
        skinrig catalogue query clock-drift camera=camera2 since=2026-01-01 --json"
    )]
    Query(QueryArgs),
}

fn roles_help() -> String {
    let roles = ROLES.map(|role| format!("  {:<18}{}\n", role.name, role.may));
    format!(
        "Example:\n  skinrig catalogue roles --catalogue postgres://owner@db.lab/skins\n\nRoles:\n{}\n\
        `GRANT skinrig_record TO bench1;` gives one to a user of the server. Call it again after an update of skinrig.\n\
        `?sslmode=verify-full` at the end of an address demands an encrypted connection (builds with `--features tls`).",
        roles.concat()
    )
}

/// The catalogue to use.
#[derive(Debug, Args)]
pub(crate) struct CatalogueOption {
    /// Catalogue: a file, or `postgres://USER@HOST/DATABASE` [default: `catalogue.sqlite` in the folder].
    #[arg(
        long = "catalogue",
        value_name = "ADDRESS",
        env = "SKINRIG_CATALOGUE",
        hide_env_values = true
    )]
    address: Option<OsString>,
}

impl CatalogueOption {
    /// Its address; by default that of the embedded catalogue of `folder`.
    pub(crate) fn of_folder(&self, folder: &std::path::Path) -> Address {
        let given = self.address.as_deref().filter(|text| !text.is_empty());
        given.map_or_else(|| Address::of_folder(folder), Address::parse)
    }
}

/// Arguments of `catalogue rebuild`.
#[derive(Debug, Args)]
pub(crate) struct FolderArgs {
    /// The folder of sessions.
    #[arg(default_value = "sessions")]
    pub folder: PathBuf,

    /// Also register the nights in this folder.
    #[arg(long, value_name = "FOLDER")]
    pub nights: Option<PathBuf>,

    #[command(flatten)]
    pub catalogue: CatalogueOption,
}

/// Arguments of `catalogue status`.
#[derive(Debug, Args)]
pub(crate) struct StatusArgs {
    /// The folder of sessions.
    #[arg(default_value = "sessions")]
    pub folder: PathBuf,

    #[command(flatten)]
    pub catalogue: CatalogueOption,
}

/// Arguments of `catalogue register`.
#[derive(Debug, Args)]
pub(crate) struct RegisterArgs {
    /// Session files, or one folder of sessions.
    #[arg(default_value = "sessions", value_name = "SESSION")]
    pub sessions: Vec<PathBuf>,

    /// Also register the nights in this folder.
    #[arg(long, value_name = "FOLDER")]
    pub nights: Option<PathBuf>,

    /// Replace only the tags and notes of these session files.
    #[arg(long, conflicts_with = "nights")]
    pub annotations: bool,

    #[command(flatten)]
    pub catalogue: CatalogueOption,
}

/// Arguments of `catalogue roles`.
#[derive(Debug, Args)]
pub(crate) struct RolesArgs {
    #[command(flatten)]
    pub catalogue: CatalogueOption,
}

/// Arguments of `catalogue query`.
#[derive(Debug, Args)]
pub(crate) struct QueryArgs {
    /// Name of the question.
    #[arg(value_parser = question)]
    pub name: Option<&'static Question>,

    /// Values of its parameters.
    #[arg(value_name = "KEY=VALUE", value_parser = assignment)]
    pub parameters: Vec<(String, String)>,

    /// The folder of sessions.
    #[arg(long, default_value = "sessions")]
    pub folder: PathBuf,

    #[command(flatten)]
    pub catalogue: CatalogueOption,
}

/// Invalid argument of `catalogue query`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
enum ArgumentError {
    /// No such question.
    #[error("expected the name of a question{}; `skinrig catalogue query` lists them", .help.as_ref().map(|h| format!(" ({h})")).unwrap_or_default())]
    Question { help: Option<String> },
    /// Not a parameter.
    #[error("expected KEY=VALUE")]
    Assignment,
}

fn question(text: &str) -> Result<&'static Question, ArgumentError> {
    Question::find(text).ok_or_else(|| ArgumentError::Question {
        help: skinrig_settings::did_you_mean(text, Question::all().iter().map(|q| q.name)),
    })
}

fn assignment(text: &str) -> Result<(String, String), ArgumentError> {
    let (key, value) = text.split_once('=').ok_or(ArgumentError::Assignment)?;
    Ok((key.to_owned(), value.to_owned()))
}
