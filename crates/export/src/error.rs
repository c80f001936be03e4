//! What can go wrong with an export.

use std::path::{Path, PathBuf};

use skinrig_recorder::RecorderError;

/// A session could not be exported, or a bundle not be read.
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
        /// What its writer or the operating system said.
        found: String,
    },
    /// There is a file already.
    #[error("{}: expected no file there, or the very one that this export writes, found another\n  next: move an older export away, choose another folder with --out, or --overwrite it", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The session grew between two looks at it.
    #[error(
        "{table}: expected {expected} rows, found {found}: the session is being written\n  next: export it again when the run has ended"
    )]
    Changed {
        /// Which table.
        table: &'static str,
        /// Rows counted before.
        expected: u64,
        /// Rows there were.
        found: u64,
    },
    /// A folder is no bundle.
    #[error("{}: expected a bundle, found {found}\n  next: `skinrig export SESSION --to bundle` makes one", path.display())]
    NotABundle {
        /// The folder or its manifest.
        path: PathBuf,
        /// What there is.
        found: String,
    },
}

impl ExportError {
    /// What somebody said of `path`.
    pub(crate) fn file<E: ToString>(path: &Path) -> impl Fn(E) -> Self + '_ {
        move |e| Self::File {
            path: path.to_owned(),
            found: e.to_string(),
        }
    }
}
