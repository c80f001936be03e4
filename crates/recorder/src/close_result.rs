//! Result of closing a session that was being written.

use std::path::PathBuf;

use crate::error::{RecorderError, RescueError};
use crate::rows::SessionTotals;

/// A sealed session.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SealedSession {
    /// The file, now read-only.
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// Final counts.
    pub totals: SessionTotals,
    /// SHA-256 of the content.
    pub tree_sha256: [u8; 32],
    /// SHA-256 of the file, with the 32 bytes of this hash as zero.
    pub file_sha256: [u8; 32],
}

/// Result of closing a session on the writer thread.
#[derive(Debug)]
pub(crate) enum CloseResult {
    /// The sealed session, or the reason why it is not sealed.
    Sealed(Result<SealedSession, RecorderError>),
    /// Path of the rescued session, or the reason why it is lost.
    Rescued(Result<PathBuf, RescueError>),
}
