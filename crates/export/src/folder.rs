//! Owns the folder that an export writes into.

use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::error::ExportError;

/// Destination folder of an export, and the stem of its file names.
#[derive(Debug, Clone)]
pub struct Folder {
    path: PathBuf,
    stem: String,
    overwrite: bool,
}

impl Folder {
    /// Opens the folder at `path`, creating it if missing. File names begin with `stem`.
    ///
    /// # Errors
    /// [`ExportError::File`] when it cannot be created.
    pub fn new(path: &Path, stem: &str, overwrite: bool) -> Result<Self, ExportError> {
        std::fs::create_dir_all(path).map_err(ExportError::file(path))?;
        Ok(Self {
            path: path.to_owned(),
            stem: stem.to_owned(),
            overwrite,
        })
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Path of the file `STEM` + `suffix`.
    #[must_use]
    pub fn file(&self, suffix: &str) -> PathBuf {
        self.path.join(format!("{}{suffix}", self.stem))
    }

    /// Fails if anything other than a file occupies one of these names, before anything is written. `complete`
    /// checks whether an existing file is identical to the one to be written.
    ///
    /// # Errors
    /// [`ExportError::Exists`].
    pub fn check_free(&self, suffixes: &[String]) -> Result<(), ExportError> {
        let taken = suffixes
            .iter()
            .map(|suffix| self.file(suffix))
            .find(|path| !self.overwrite && path.symlink_metadata().is_ok_and(|m| !m.is_file()));
        taken.map_or(Ok(()), |path| Err(ExportError::Exists { path }))
    }

    /// Calls `write` with a temporary name, and renames the file once it is complete.
    ///
    /// # Errors
    /// [`ExportError::Exists`], or the error of `write`; the temporary file is removed then.
    pub fn write_atomic(
        &self,
        suffix: &str,
        write: impl FnOnce(&Path) -> Result<(), ExportError>,
    ) -> Result<PathBuf, ExportError> {
        let partial = self.begin(suffix)?;
        if let Err(e) = write(&partial) {
            let _ = std::fs::remove_file(&partial);
            return Err(e);
        }
        self.complete(suffix)
    }

    /// Temporary name for the file; nothing exists under this name.
    pub(crate) fn begin(&self, suffix: &str) -> Result<PathBuf, ExportError> {
        self.check_free(&[suffix.to_owned()])?;
        let partial = self.file(&format!("{suffix}.partial"));
        // Remove leftovers of an aborted export, or a planted link.
        match std::fs::remove_file(&partial) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                Err(ExportError::file(&partial)(e))
            }
            _ => Ok(partial),
        }
    }

    /// Renames the completed file. An existing file is kept if it has the same bytes, as after a repeated export.
    pub(crate) fn complete(&self, suffix: &str) -> Result<PathBuf, ExportError> {
        let (partial, path) = (self.file(&format!("{suffix}.partial")), self.file(suffix));
        if !self.overwrite && path.symlink_metadata().is_ok() {
            let same = same_bytes(&partial, &path).map_err(ExportError::file(&path));
            let _ = std::fs::remove_file(&partial);
            return if same? {
                Ok(path)
            } else {
                Err(ExportError::Exists { path })
            };
        }
        File::open(&partial)
            .and_then(|file| file.sync_all())
            .and_then(|()| std::fs::rename(&partial, &path))
            .map_err(ExportError::file(&path))?;
        Ok(path)
    }

    /// Removes the temporary file of an incomplete export.
    pub(crate) fn abandon(&self, suffix: &str) {
        let _ = std::fs::remove_file(self.file(&format!("{suffix}.partial")));
    }
}

/// True if both files have the same bytes.
///
/// # Errors
/// When one of them cannot be read.
pub fn same_bytes(a: &Path, b: &Path) -> std::io::Result<bool> {
    let (mut a, mut b) = (File::open(a)?, File::open(b)?);
    if a.metadata()?.len() != b.metadata()?.len() {
        return Ok(false);
    }
    let (mut one, mut other) = (vec![0; 1 << 16], vec![0; 1 << 16]);
    loop {
        let n = a.read(&mut one)?;
        if n == 0 {
            return Ok(true);
        }
        let other = &mut other[..n];
        b.read_exact(other)?;
        if one[..n] != *other {
            return Ok(false);
        }
    }
}
