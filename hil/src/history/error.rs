//! What can go wrong with a history file.

use std::path::{Path, PathBuf};

/// A history could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HistoryError {
    /// The operating system refused.
    #[error("{}: {doing}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was being done.
        doing: &'static str,
        /// Its answer.
        source: std::io::Error,
    },
    /// SQLite refused.
    #[error("{}: {doing}: {source}", path.display())]
    Sql {
        /// The file.
        path: PathBuf,
        /// What was being done.
        doing: &'static str,
        /// Its answer.
        source: Box<sqlx::Error>,
    },
    /// No such file.
    #[error("{}: expected a history of nights, found nothing; `skinrig hil run` begins one, `skinrig hil trend --rebuild FOLDER` makes one from the nights in a folder", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The file is something else.
    #[error("{}: expected a history of nights, found {found}; name another file", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What it is.
        found: String,
    },
    /// Written by a newer skinrig.
    #[error("{}: expected schema version up to {supported}, found {found}; use the newer skinrig that wrote it", path.display())]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its version.
        found: u32,
        /// The newest that this program knows.
        supported: u32,
    },
    /// The file contradicts itself.
    #[error("{}: damaged: {found}; move it away and rebuild it from the nights: `skinrig hil trend {} --rebuild FOLDER`", path.display(), path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What was found.
        found: String,
    },
    /// Two different nights of one name.
    #[error("{}: expected one night {night} of {rig}, found another one of that name in the history; one of them was changed", path.display())]
    OtherNight {
        /// The file.
        path: PathBuf,
        /// Its name.
        night: String,
        /// The bench.
        rig: String,
    },
    /// Something that the history does not hold.
    #[error("{}: expected {wanted}, found {found}", path.display())]
    NotThere {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        wanted: String,
        /// What there is.
        found: String,
    },
    /// A night that is not over, or none.
    #[error("{}: expected the JSON of a night that came to its end, found {found}", path.display())]
    NoNight {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        found: String,
    },
}

/// A fault of one query, before it is known of which file.
#[derive(Debug)]
pub(super) enum Fault {
    Sql(Box<sqlx::Error>),
    Damaged(String),
}

impl From<sqlx::Error> for Fault {
    fn from(e: sqlx::Error) -> Self {
        Self::Sql(Box::new(e))
    }
}

impl Fault {
    /// `place` holds `found` where `expected` should be.
    pub fn damaged(place: &str, expected: &str, found: impl std::fmt::Display) -> Self {
        Self::Damaged(format!("{place}: expected {expected}, found {found}"))
    }

    /// The error for the user.
    pub fn at(self, path: &Path, doing: &'static str) -> HistoryError {
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

/// SQLITE_CORRUPT and SQLITE_NOTADB (sqlite.org/rescode.html), and columns of another type.
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
