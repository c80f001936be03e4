//! Owns the errors of challenges, and those of a table of estimates, each with its row.

use std::path::PathBuf;

use crate::error::ExportError;

/// A challenge could not be made or scored.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ChallengeError {
    /// A file could not be written, or the session not be read.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// The session has nothing to learn from, or nothing to locate.
    #[error(
        "expected presses of both roles with events and a measured position, found {calibrating} calibrating and {scored} scored"
    )]
    TooFew {
        /// Usable calibration presses.
        calibrating: usize,
        /// Usable scored presses.
        scored: usize,
    },
    /// The numbers of the session must not be used.
    #[error("expected a session whose numbers can be used, found an INVALID one: {}", because.join("; "))]
    InvalidSession {
        /// Why, as the report states it.
        because: Vec<String>,
    },
    /// The folder holds more than the challenge, for example its session.
    #[error(
        "{}: expected a folder for the challenge alone, which is given away whole, found this file in it\n  next: name a new folder \
         with --out",
        path.display()
    )]
    NotAlone {
        /// A file that does not belong to it.
        path: PathBuf,
    },
    /// The answers of another challenge are there.
    #[error(
        "{}: expected no file, or the answers of the challenge in {} to be replaced with it, found others: without them their challenge \
         can never be scored\n  next: choose another file with --answers",
        path.display(), folder.display()
    )]
    AnswersOfAnother {
        /// The file of answers.
        path: PathBuf,
        /// Folder of the new challenge.
        folder: PathBuf,
    },
    /// The answers would lie in the folder that is given away.
    #[error("{}: the answers would lie in the folder of the challenge\n  next: choose another file with --answers", path.display())]
    Unsealed {
        /// The file of answers.
        path: PathBuf,
    },
    /// A file is not what it should be.
    #[error("{}: expected {expected}, found {found}", path.display())]
    NotAChallenge {
        /// The file.
        path: PathBuf,
        /// What it should be.
        expected: &'static str,
        /// Message of the reader.
        found: String,
    },
    /// The answers belong to another challenge.
    #[error("{}: these answers are not those of the challenge (SHA-256 expected {expected}, found {found})", path.display())]
    OtherAnswers {
        /// The file of answers.
        path: PathBuf,
        /// The hash in the description.
        expected: String,
        /// The hash of the file.
        found: String,
    },
    /// A guest did not do its part.
    #[error(transparent)]
    Guest(#[from] super::guest::GuestError),
    /// The table of estimates is refused.
    #[error("{}: {error}", path.display())]
    Table {
        /// The table.
        path: PathBuf,
        /// Why.
        error: EstimateError,
    },
}

/// Why a table of estimates is refused. Rows are lines of the file: the header is row 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EstimateError {
    /// Not a CSV file.
    #[error("row {row}: expected comma-separated values, found {found}")]
    Csv {
        /// The row.
        row: u64,
        /// Message of the reader.
        found: String,
    },
    /// The header lacks a column.
    #[error("row 1: expected a column `{column}`, found {found:?}")]
    NoColumn {
        /// The column.
        column: &'static str,
        /// The header.
        found: Vec<String>,
    },
    /// The header has a column of an unknown name or unit, or the same one twice.
    #[error(
        "row 1: unexpected column `{column}`\n  help: press, x_mm, y_mm; region_major_mm, region_minor_mm, region_angle_deg"
    )]
    UnknownColumn {
        /// The column.
        column: String,
    },
    /// A cell is not a finite number.
    #[error("row {row}: {column}: expected a finite number, found `{found}`")]
    NotANumber {
        /// The row.
        row: u64,
        /// The column.
        column: &'static str,
        /// The cell.
        found: String,
    },
    /// A press has no number.
    #[error("row {row}: press: expected the number of a press of the challenge, found `{found}`")]
    NotAPress {
        /// The row.
        row: u64,
        /// The cell.
        found: String,
    },
    /// A cell is empty and its partner is not.
    #[error(
        "row {row}: expected {column}, found an empty cell\n  help: leave x_mm, y_mm and the region empty for a press that is not located"
    )]
    Empty {
        /// The row.
        row: u64,
        /// The column.
        column: &'static str,
    },
    /// A semi-axis is not positive.
    #[error("row {row}: {column}: expected a length above 0 mm, found {found}")]
    SemiAxis {
        /// The row.
        row: u64,
        /// The column.
        column: &'static str,
        /// The cell.
        found: f64,
    },
    /// The angle of a region is that of the longer semi-axis: with the axes exchanged it means another ellipse.
    #[error(
        "row {row}: expected region_minor_mm at most region_major_mm ({major_mm}), found {minor_mm}\n  help: region_angle_deg is that of the longer semi-axis, region_major_mm"
    )]
    AxesExchanged {
        /// The row.
        row: u64,
        /// The stated longer semi-axis.
        major_mm: f64,
        /// The stated shorter one.
        minor_mm: f64,
    },
    /// The challenge has no such press.
    #[error("row {row}: the challenge has no press {press}")]
    UnknownPress {
        /// The row.
        row: u64,
        /// The press.
        press: u32,
    },
    /// The position of the press is given: it does not count.
    #[error("row {row}: press {press} calibrates: its position is given and does not count")]
    CalibrationPress {
        /// The row.
        row: u64,
        /// The press.
        press: u32,
    },
    /// A press has two rows.
    #[error("row {row}: press {press} is already in row {first}")]
    Duplicate {
        /// The row.
        row: u64,
        /// Its earlier row.
        first: u64,
        /// The press.
        press: u32,
    },
    /// Presses have no row.
    #[error("{count} presses have no row; the first is press {first}, after row {row}")]
    Missing {
        /// Number of presses.
        count: usize,
        /// The first of them.
        first: u32,
        /// Last row of the table.
        row: u64,
    },
    /// A position is far from the skin: probably pixels, or another frame.
    #[error(
        "row {row}: ({x_mm}, {y_mm}) mm is {away_mm:.0} mm from the centre of the skin, expected at most {most_mm:.0} mm\n  \
        help: positions are in mm in the skin frame, as in the table of presses"
    )]
    FarAway {
        /// The row.
        row: u64,
        /// The estimate.
        x_mm: f64,
        /// The estimate.
        y_mm: f64,
        /// Its distance.
        away_mm: f64,
        /// The largest allowed one.
        most_mm: f64,
    },
    /// All positions together are tiny: probably metres.
    #[error(
        "rows 2 to {row}: all positions are within {extent_mm} mm of zero, expected millimetres (metres times 1000)"
    )]
    Tiny {
        /// Last row.
        row: u64,
        /// Largest distance from zero.
        extent_mm: f64,
    },
}
