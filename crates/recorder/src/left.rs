//! How a session is left when it is written.

use std::path::PathBuf;

use crate::error::RecorderError;
use crate::rows::SessionTotals;

/// A sealed session.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sealed {
    /// The file, now read-only.
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// Final counts.
    pub totals: SessionTotals,
    /// SHA-256 of the content.
    pub tree_sha256: [u8; 32],
    /// SHA-256 of the file, with the place of this hash taken as zero.
    pub file_sha256: [u8; 32],
}

/// How the writing thread left the session.
#[derive(Debug)]
pub(crate) enum Left {
    /// Sealed, or why not.
    Sealed(Result<Sealed, RecorderError>),
    /// Brought to this path, or why not.
    Saved(Result<PathBuf, String>),
}
