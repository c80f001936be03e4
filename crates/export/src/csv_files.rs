//! Writes tables as CSV (RFC 4180): a header line, empty cells for missing values, and numbers with full precision.

use std::fs::File;
use std::path::PathBuf;

use csv::{Writer, WriterBuilder};

use crate::error::ExportError;
use crate::folder::Folder;
use crate::table::{Layout, TableWriter, Values};

/// Writes one file per table.
#[derive(Debug)]
pub struct CsvFiles {
    folder: Folder,
    open: Option<(Writer<File>, String)>,
    written: Vec<PathBuf>,
}

/// Suffix of a table's file name.
pub(crate) const SUFFIX: &str = "csv";

impl CsvFiles {
    /// Writes into `folder`.
    #[must_use]
    pub const fn new(folder: Folder) -> Self {
        Self {
            folder,
            open: None,
            written: Vec::new(),
        }
    }

    /// Paths of the files, in order.
    #[must_use]
    pub fn into_paths(mut self) -> Vec<PathBuf> {
        std::mem::take(&mut self.written)
    }
}

impl TableWriter for CsvFiles {
    fn begin(&mut self, layout: &Layout, _rows: u64) -> Result<(), ExportError> {
        let suffix = format!(".{}.{SUFFIX}", layout.name);
        let path = self.folder.begin(&suffix)?;
        let file = File::create_new(&path).map_err(ExportError::file(&path))?;
        let mut writer = WriterBuilder::new()
            .buffer_capacity(1 << 16)
            .from_writer(file);
        let names = layout.columns.iter().map(|column| &column.name);
        let headed = writer.write_record(names);
        self.open = Some((writer, suffix));
        headed.map_err(ExportError::file(&path))
    }

    fn append(&mut self, batch: &[Values]) -> Result<(), ExportError> {
        let Some((writer, suffix)) = &mut self.open else {
            return Ok(());
        };
        let path = self.folder.file(suffix);
        let rows = batch.first().map_or(0, Values::rows);
        let mut cell = String::new();
        for row in 0..rows {
            for values in batch {
                cell.clear();
                write_cell(values, row, &mut cell);
                writer
                    .write_field(&cell)
                    .map_err(ExportError::file(&path))?;
            }
            // End of the line.
            writer
                .write_record(None::<&[u8]>)
                .map_err(ExportError::file(&path))?;
        }
        Ok(())
    }

    fn end(&mut self) -> Result<(), ExportError> {
        if let Some((mut writer, suffix)) = self.open.take() {
            let path = self.folder.file(&suffix);
            writer.flush().map_err(ExportError::file(&path))?;
            drop(writer);
            self.written.push(self.folder.complete(&suffix)?);
        }
        Ok(())
    }
}

impl Drop for CsvFiles {
    fn drop(&mut self) {
        if let Some((_, suffix)) = self.open.take() {
            self.folder.abandon(&suffix);
        }
    }
}

/// True for text that a spreadsheet would interpret as a formula (OWASP, CSV injection). Such text
/// is written with a leading `'`.
fn starts_formula(text: &str) -> bool {
    text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n', '＝', '＋', '－', '＠'])
}

fn write_cell(values: &Values, row: usize, cell: &mut String) {
    use std::fmt::Write as _;
    // Writing to a string cannot fail.
    let _ = match values {
        Values::Int(v) => write!(cell, "{}", v[row]),
        Values::Pixel(v) => write!(cell, "{}", v[row]),
        Values::Flag(v) => write!(cell, "{}", u8::from(v[row])),
        Values::Count(v) => v[row].map_or(Ok(()), |n| write!(cell, "{n}")),
        Values::Real(v) if v[row].is_nan() => Ok(()),
        Values::Real(v) => write!(cell, "{}", v[row]),
        Values::Text(v) => v[row].as_ref().map_or(Ok(()), |t| {
            let guard = if starts_formula(t) { "'" } else { "" };
            write!(cell, "{guard}{t}")
        }),
    };
}
