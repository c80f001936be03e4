//! The one folder that an export writes into.

use std::fs::File;
use std::io::Read as _;
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

    /// Refuses when something else than a file is in the place of one of these: before anything is written. Whether a file that is
    /// there is the very one that would be written, `Folder::complete` finds out.
    ///
    /// # Errors
    /// [`ExportError::Exists`].
    pub fn check_free(&self, endings: &[String]) -> Result<(), ExportError> {
        let taken = endings
            .iter()
            .map(|ending| self.file(ending))
            .find(|path| !self.overwrite && path.symlink_metadata().is_ok_and(|m| !m.is_file()));
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

    /// The file has all of it and gets its name. One that is there already stays when it has the same bytes, as after the same export.
    pub(crate) fn complete(&self, ending: &str) -> Result<PathBuf, ExportError> {
        let (partial, path) = (self.file(&format!("{ending}.partial")), self.file(ending));
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

    /// Takes away what is left of a file that was not completed.
    pub(crate) fn abandon(&self, ending: &str) {
        let _ = std::fs::remove_file(self.file(&format!("{ending}.partial")));
    }
}

/// True when both files hold the same bytes.
///
/// # Errors
/// When one cannot be read.
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
