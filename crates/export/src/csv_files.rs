//! Writes tables as CSV (RFC 4180): a header line, empty cells for missing values, and numbers with full precision.

use std::fs::File;
use std::path::PathBuf;

use csv::{Writer, WriterBuilder};

use crate::error::ExportError;
use crate::folder::Folder;
use crate::table::{Layout, TableWriter, Values};
use crate::table_files::TableFiles;

/// Writes one file per table.
#[derive(Debug)]
pub struct CsvFiles(TableFiles<Writer<File>>);

/// Suffix of a table's file name.
pub(crate) const SUFFIX: &str = "csv";

impl CsvFiles {
    /// Writes into `folder`.
    #[must_use]
    pub const fn new(folder: Folder) -> Self {
        Self(TableFiles::new(folder))
    }

    /// Paths of the files, in order.
    #[must_use]
    pub fn into_paths(self) -> Vec<PathBuf> {
        self.0.into_paths()
    }
}

impl TableWriter for CsvFiles {
    fn begin(&mut self, layout: &Layout, _rows: u64) -> Result<(), ExportError> {
        let suffix = format!(".{}.{SUFFIX}", layout.name);
        self.0.begin(suffix, |file| {
            let mut writer = WriterBuilder::new()
                .buffer_capacity(1 << 16)
                .from_writer(file);
            writer.write_record(layout.columns.iter().map(|column| &column.name))?;
            Ok::<_, csv::Error>(writer)
        })
    }

    fn append(&mut self, batch: &[Values]) -> Result<(), ExportError> {
        let Some((writer, path)) = self.0.current() else {
            return Ok(());
        };
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
        self.0.end(|mut writer| writer.flush())
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
