//! Fallback for systems without open file description locks: only the lock file beside a session keeps a second writer out, and a
//! session that is moved or removed while it is written goes undetected.

use std::path::{Path, PathBuf};

use crate::error::{RecorderError, RescueError};

/// Locks nothing.
#[derive(Debug)]
pub(crate) struct LockedFiles;

impl LockedFiles {
    /// Always succeeds.
    pub fn take(_: &Path) -> std::io::Result<Option<Self>> {
        Ok(Some(Self))
    }

    /// Always succeeds.
    pub(crate) fn take_log(&mut self) -> std::io::Result<bool> {
        Ok(true)
    }

    /// Does nothing.
    pub(crate) fn forget_log(&mut self) {}

    /// Detects nothing.
    ///
    /// # Errors
    /// None.
    pub fn check(&self) -> Result<(), RecorderError> {
        Ok(())
    }

    /// Always empty.
    pub(crate) fn rescue_targets(&self) -> RescueTargets {
        RescueTargets {
            current_path: None,
            copies: Vec::new(),
        }
    }

    /// Always fails.
    pub fn copy(&self, _: &[PathBuf]) -> Result<PathBuf, RescueError> {
        Err(RescueError::NotOpen)
    }

    /// Does nothing.
    pub(crate) fn remove_log_files(&self) {}
}

/// Where to save a session that was moved or removed while it was written.
#[derive(Debug, Clone)]
pub(crate) struct RescueTargets {
    /// Current path of the file; `None` if it was removed.
    pub current_path: Option<PathBuf>,
    /// Candidate paths for a copy, best first.
    pub copies: Vec<PathBuf>,
}

/// Always false: unknown.
pub(crate) fn is_locked_by_writer(_: &Path) -> bool {
    false
}

/// Always false: unknown.
pub fn is_own(_: &Path) -> bool {
    false
}
