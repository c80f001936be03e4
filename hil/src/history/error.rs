//! Errors of a history file.

use std::path::{Path, PathBuf};

/// A history file could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HistoryError {
    /// An operation of the file system failed.
    #[error("{}: {doing}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The failed operation.
        doing: &'static str,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A query failed.
    #[error("{}: {doing}: {source}", path.display())]
    Sql {
        /// The file.
        path: PathBuf,
        /// The failed operation.
        doing: &'static str,
        /// Error of SQLite.
        source: Box<sqlx::Error>,
    },
    /// The file does not exist.
    #[error("{}: expected a history of nights, found no file; `skinrig hil run` creates one, `skinrig hil trend --rebuild FOLDER` creates one from the nights in a folder", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The file is not a history.
    #[error("{}: expected a history of nights, found {found}; choose another file", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Kind of file.
        found: String,
    },
    /// Written by a newer skinrig.
    #[error("{}: expected schema version up to {supported}, found {found}; use the newer skinrig that wrote it", path.display())]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its schema version.
        found: u32,
        /// The newest supported version.
        supported: u32,
    },
    /// The file is damaged.
    #[error("{}: damaged: {found}; move it away and rebuild it from the nights: `skinrig hil trend {} --rebuild FOLDER`", path.display(), path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Description of the damage.
        found: String,
    },
    /// The history has a different night with the same name.
    #[error("{}: the history already has a different night {night} of {rig}; one of the two was changed", path.display())]
    ConflictingNight {
        /// The file.
        path: PathBuf,
        /// Name of the night.
        night: String,
        /// Name of the bench.
        rig: String,
    },
    /// A night that has just ended is dated before one that the history has.
    #[error("{}: expected a night after {newest}, the newest one there, found one of {started}: the clock of this computer went back, or was ahead before; a night of an earlier date joins the reference instead of being judged", path.display())]
    DatedEarlier {
        /// The file.
        path: PathBuf,
        /// Start of the night.
        started: String,
        /// Start of the newest night in the history.
        newest: String,
    },
    /// The history does not contain the requested night or series.
    #[error("{}: expected {expected}, found {found}", path.display())]
    NotFound {
        /// The file.
        path: PathBuf,
        /// The request.
        expected: String,
        /// What the history contains instead.
        found: String,
    },
    /// The file is not the JSON of a finished night.
    #[error("{}: expected the JSON of a finished night, found {found}", path.display())]
    InvalidNight {
        /// The file.
        path: PathBuf,
        /// Description of the content.
        found: String,
    },
}

/// A failed query, before the path of the file is known.
#[derive(Debug)]
pub(super) enum QueryError {
    Sql(Box<sqlx::Error>),
    Damaged(String),
}

impl From<sqlx::Error> for QueryError {
    fn from(e: sqlx::Error) -> Self {
        Self::Sql(Box::new(e))
    }
}

impl QueryError {
    /// `found` at `place`, where `expected` should be.
    pub(super) fn damaged(place: &str, expected: &str, found: impl std::fmt::Display) -> Self {
        Self::Damaged(format!("{place}: expected {expected}, found {found}"))
    }

    /// Adds the file and the operation.
    pub(super) fn at(self, path: &Path, doing: &'static str) -> HistoryError {
        let path = path.to_owned();
        match self {
            Self::Sql(source) if is_damage(&source) => HistoryError::Damaged {
                path,
                found: source.to_string(),
            },
            Self::Sql(source) => HistoryError::Sql {
                path,
                doing,
                source,
            },
            Self::Damaged(found) => HistoryError::Damaged { path, found },
        }
    }
}

/// SQLITE_CORRUPT and SQLITE_NOTADB (sqlite.org/rescode.html), and columns with an unexpected type.
fn is_damage(e: &sqlx::Error) -> bool {
    match e {
        sqlx::Error::Database(e) => e
            .code()
            .and_then(|code| code.parse::<i32>().ok())
            .is_some_and(|code| matches!(code & 0xff, 11 | 26)),
        sqlx::Error::ColumnDecode { .. } | sqlx::Error::ColumnNotFound(_) => true,
        _ => false,
    }
}
