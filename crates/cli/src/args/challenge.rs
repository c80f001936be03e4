//! Arguments of `challenge`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Arguments of `challenge`.
#[derive(Debug, Args)]
pub(crate) struct ChallengeArgs {
    /// The command.
    #[command(subcommand)]
    pub command: ChallengeCommand,
}

/// The commands of `challenge`.
#[derive(Debug, Subcommand)]
pub(crate) enum ChallengeCommand {
    /// Write the events of every press and the positions of the calibration presses; seal the positions of the scored ones.
    #[command(
        after_help = "Example:\n  skinrig challenge make sessions/NAME.session.sqlite --out challenge/\n\n\
        Give the folder away and keep the answers. Presses have new numbers in random order."
    )]
    Make(MakeArgs),

    /// Score a table of estimates: RMSE, located share, and coverage if it states regions.
    #[command(
        after_help = "Example:\n  skinrig challenge score challenge/ estimates.csv --answers sessions/NAME.answers.json\n\n\
        Columns: press, x_mm, y_mm; optionally region_major_mm, region_minor_mm (semi-axes), region_angle_deg.\n\
        One row per scored press; empty cells: not located. Exit code 2 names the row that is wrong."
    )]
    Score(ScoreArgs),

    /// Let another program learn and locate presses, and score it beside skinrig.
    #[command(
        after_help = "Example:\n  skinrig challenge run sessions/NAME.session.sqlite -- python3 guest.py\n\n\
        The program reads JSON lines from standard input and answers on standard output; docs/how-to/guests.md states them.\n\
        It never receives the position of a scored press. Exit code 2 tells what was wrong with which answer."
    )]
    Run(ExamineArgs),
}

/// Arguments of `challenge make`.
#[derive(Debug, Args)]
pub(crate) struct MakeArgs {
    /// The session file, or a selection of one session.
    pub session: PathBuf,

    /// Folder to give away.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,

    /// File of the answers, outside that folder [default: `NAME.answers.json` beside the session].
    #[arg(long, value_name = "FILE")]
    pub answers: Option<PathBuf>,

    /// Overwrite the files of an earlier challenge.
    #[arg(long)]
    pub overwrite: bool,
}

/// Arguments of `challenge score`.
#[derive(Debug, Args)]
pub(crate) struct ScoreArgs {
    /// Folder of the challenge.
    pub folder: PathBuf,

    /// The estimates: a CSV file.
    pub table: PathBuf,

    /// File of the answers.
    #[arg(long, value_name = "FILE")]
    pub answers: PathBuf,
}

/// Arguments of `challenge run`.
#[derive(Debug, Args)]
pub(crate) struct ExamineArgs {
    /// The session file, or a selection of one session.
    pub session: PathBuf,

    /// Send the events of every press, too.
    #[arg(long)]
    pub events: bool,

    /// Seconds that the program may take for one press, 60 times as much to learn [default: 10].
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..=86_400))]
    pub timeout: Option<u64>,

    /// The program and its arguments.
    #[arg(last = true, required = true, value_name = "COMMAND")]
    pub command: Vec<String>,
}
