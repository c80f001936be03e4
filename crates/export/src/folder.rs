//! The one folder that an export writes into.

use std::fs::File;
use std::path::{Path, PathBuf};

use crate::error::ExportError;

/// Where the files of an export go, and what their names begin with.
#[derive(Debug, Clone)]
pub struct Folder {
    path: PathBuf,
    stem: String,
    overwrite: bool,
}

impl Folder {
    /// The folder at `path`, made when missing. File names begin with `stem`.
    ///
    /// # Errors
    /// [`ExportError::File`] when it cannot be made.
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

    /// A file of it, `STEM` and then `ending`.
    #[must_use]
    pub fn file(&self, ending: &str) -> PathBuf {
        self.path.join(format!("{}{ending}", self.stem))
    }

    /// Refuses when one of these files is there and may not be replaced: before anything is written.
    ///
    /// # Errors
    /// [`ExportError::Exists`].
    pub fn check_free(&self, endings: &[String]) -> Result<(), ExportError> {
        let taken = endings
            .iter()
            .map(|ending| self.file(ending))
            .find(|path| !self.overwrite && path.symlink_metadata().is_ok());
        taken.map_or(Ok(()), |path| Err(ExportError::Exists { path }))
    }

    /// Has `write` make a file under another name, which gets its own when it is whole.
    ///
    /// # Errors
    /// [`ExportError::Exists`], or what `write` said; nothing is left then.
    pub fn whole(
        &self,
        ending: &str,
        write: impl FnOnce(&Path) -> Result<(), ExportError>,
    ) -> Result<PathBuf, ExportError> {
        let partial = self.begin(ending)?;
        if let Err(e) = write(&partial) {
            let _ = std::fs::remove_file(&partial);
            return Err(e);
        }
        self.complete(ending)
    }

    /// The name under which the file is to be made; there is nothing of that name.
    pub(crate) fn begin(&self, ending: &str) -> Result<PathBuf, ExportError> {
        self.check_free(&[ending.to_owned()])?;
        let partial = self.file(&format!("{ending}.partial"));
        // What an ended export left there, or a link that a stranger put there, is no place to write into.
        match std::fs::remove_file(&partial) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                Err(ExportError::file(&partial)(e))
            }
            _ => Ok(partial),
        }
    }

    /// The file has all of it and gets its name.
    pub(crate) fn complete(&self, ending: &str) -> Result<PathBuf, ExportError> {
        let (partial, path) = (self.file(&format!("{ending}.partial")), self.file(ending));
        File::open(&partial)
            .and_then(|file| file.sync_all())
            .and_then(|()| std::fs::rename(&partial, &path))
            .map_err(ExportError::file(&path))?;
        Ok(path)
    }

    /// Takes away what is left of a file that was not completed.
    pub(crate) fn abandon(&self, ending: &str) {
        let _ = std::fs::remove_file(self.file(&format!("{ending}.partial")));
    }
}
