//! Files of tables in a folder, one per table, written one after the other.

use std::fs::File;
use std::path::PathBuf;

use crate::error::ExportError;
use crate::folder::Folder;

/// Files that a `W` writes. An incomplete one is removed.
#[derive(Debug)]
pub(crate) struct TableFiles<W> {
    folder: Folder,
    /// Writer and suffix of the file that is being written.
    open: Option<(W, String)>,
    written: Vec<PathBuf>,
}

impl<W> TableFiles<W> {
    pub(crate) const fn new(folder: Folder) -> Self {
        Self {
            folder,
            open: None,
            written: Vec::new(),
        }
    }

    /// Creates the file with this suffix; `writer` writes its start.
    pub(crate) fn begin<E: ToString>(
        &mut self,
        suffix: String,
        writer: impl FnOnce(File) -> Result<W, E>,
    ) -> Result<(), ExportError> {
        let path = self.folder.begin(&suffix)?;
        let file = File::create_new(&path).map_err(ExportError::file(&path))?;
        match writer(file) {
            Ok(writer) => self.open = Some((writer, suffix)),
            Err(e) => {
                self.folder.abandon(&suffix);
                return Err(ExportError::file(&path)(e));
            }
        }
        Ok(())
    }

    /// Writer and path of the file that is being written.
    pub(crate) fn current(&mut self) -> Option<(&mut W, PathBuf)> {
        let (writer, suffix) = self.open.as_mut()?;
        Some((writer, self.folder.file(suffix)))
    }

    /// Completes the file; `close` writes its end.
    pub(crate) fn end<E: ToString>(
        &mut self,
        close: impl FnOnce(W) -> Result<(), E>,
    ) -> Result<(), ExportError> {
        let Some((writer, suffix)) = self.open.take() else {
            return Ok(());
        };
        if let Err(e) = close(writer) {
            self.folder.abandon(&suffix);
            return Err(ExportError::file(&self.folder.file(&suffix))(e));
        }
        self.written.push(self.folder.complete(&suffix)?);
        Ok(())
    }

    /// Paths of the completed files, in order.
    pub(crate) fn into_paths(mut self) -> Vec<PathBuf> {
        std::mem::take(&mut self.written)
    }
}

impl<W> Drop for TableFiles<W> {
    fn drop(&mut self) {
        if let Some((_, suffix)) = self.open.take() {
            self.folder.abandon(&suffix);
        }
    }
}
