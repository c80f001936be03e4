//! Where the system has no locks of open files: the lock file beside a session is all that keeps a second writer out, and a session that
//! is moved or removed while it is written is not noticed.

use std::path::{Path, PathBuf};

use crate::error::RecorderError;

/// Nothing is held.
#[derive(Debug)]
pub struct Held;

impl Held {
    /// Holds nothing.
    pub fn take(_: &Path) -> std::io::Result<Option<Self>> {
        Ok(Some(Self))
    }

    /// Holds nothing.
    pub(crate) fn take_log(&mut self) -> std::io::Result<bool> {
        Ok(true)
    }

    /// Nothing to let go.
    pub(crate) fn without_log(&mut self) {}

    /// Never finds anything.
    ///
    /// # Errors
    /// None.
    pub fn check(&self) -> Result<(), RecorderError> {
        Ok(())
    }

    /// No place is known.
    pub(crate) fn refuge(&self) -> Refuge {
        Refuge {
            place: None,
            copies: Vec::new(),
        }
    }

    /// Nothing is copied.
    pub fn copy(&self, _: &[PathBuf]) -> Result<PathBuf, String> {
        Err("expected an open session file, found none".to_owned())
    }

    /// Nothing is left.
    pub fn tidy(&self) {}
}

/// Where a session that was moved or removed while it was written can be kept.
#[derive(Debug, Clone)]
pub(crate) struct Refuge {
    /// Where the file lies now; nowhere when it was removed.
    pub place: Option<PathBuf>,
    /// Where a copy may be put, the best place first.
    pub copies: Vec<PathBuf>,
}

/// Not known.
pub fn is_held(_: &Path) -> bool {
    false
}

/// Not known.
pub fn is_ours(_: &Path) -> bool {
    false
}
