//! Owns the errors of an export.

use std::path::{Path, PathBuf};

use skinrig_recorder::RecorderError;

/// A session could not be exported, or a bundle could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The session could not be read.
    #[error(transparent)]
    Session(#[from] RecorderError),
    /// A file could not be written or read.
    #[error("{}: {found}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// Message of the writer or the operating system.
        found: String,
    },
    /// Another file exists at the destination.
    #[error("{}: another file exists\n  next: move an older export away, choose another folder with --out, or --overwrite it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The session grew during the export.
    #[error(
        "{table}: expected {expected} rows, found {found}: the session is being written\n  next: export it again when the run has ended"
    )]
    Changed {
        /// Name of the table.
        table: &'static str,
        /// Number of rows counted before.
        expected: u64,
        /// Number of rows found.
        found: u64,
    },
    /// A lake has the session with another content.
    #[error(
        "{}: expected the content of session {session_id} as the lake has it, found another: the session was resumed, or it is \
         another bench's\n  next: choose another lake, or remove the session's files from this one",
        path.display()
    )]
    OtherContent {
        /// Its commit.
        path: PathBuf,
        /// The session.
        session_id: String,
    },
    /// The folder is not an RO-Crate.
    #[error("{}: expected an RO-Crate 1.1, found {found}\n  next: create one with `skinrig publish`", path.display())]
    NotACrate {
        /// Its description.
        path: PathBuf,
        /// Why it is not one.
        found: String,
    },
    /// The folder is not a bundle.
    #[error("{}: expected a bundle, found {found}\n  next: create one with `skinrig export SESSION --to bundle`", path.display())]
    NotABundle {
        /// The folder or its manifest.
        path: PathBuf,
        /// Why it is not a bundle.
        found: String,
    },
}

impl ExportError {
    /// [`ExportError::Changed`] unless `found` rows of `table` are as many as `expected`.
    pub(crate) fn check_rows(table: &'static str, expected: u64, found: u64) -> Result<(), Self> {
        if found == expected {
            return Ok(());
        }
        Err(Self::Changed {
            table,
            expected,
            found,
        })
    }

    /// Converts an error on `path`.
    pub(crate) fn file<E: ToString>(path: &Path) -> impl Fn(E) -> Self + '_ {
        move |e| Self::File {
            path: path.to_owned(),
            found: e.to_string(),
        }
    }
}
