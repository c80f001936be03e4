//! Writes tables as one numpy archive with a structured array each.
//!
//! An `.npz` is a zip of `.npy` files (numpy.org, "numpy.lib.format", version 1.0); stored, not deflated, like
//! `numpy.savez`.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::error::ExportError;
use crate::folder::Folder;
use crate::table::{Kind, Layout, TableWriter, Values};

/// Suffix of the archive's file name.
pub(crate) const SUFFIX: &str = ".npz";

/// The header of a `.npy` is padded to a multiple of this.
const ALIGN: usize = 64;
/// Length of magic, version and header length.
const PREAMBLE: usize = 10;

/// Writes all tables into one file.
pub struct NpzFile {
    folder: Folder,
    path: PathBuf,
    archive: Option<ZipWriter<BufWriter<File>>>,
    table: Option<OpenTable>,
    bytes: Vec<u8>,
}

struct OpenTable {
    name: &'static str,
    kinds: Vec<Kind>,
    expected: u64,
    found: u64,
}

impl NpzFile {
    /// Creates the archive in `folder`.
    ///
    /// # Errors
    /// When the file cannot be created.
    pub fn create(folder: Folder) -> Result<Self, ExportError> {
        let path = folder.begin(SUFFIX)?;
        let file = File::create_new(&path).map_err(ExportError::file(&path))?;
        Ok(Self {
            archive: Some(ZipWriter::new(BufWriter::with_capacity(1 << 20, file))),
            path,
            folder,
            table: None,
            bytes: Vec::new(),
        })
    }

    /// Completes the archive and returns its path.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn finish(mut self) -> Result<PathBuf, ExportError> {
        if let Some(archive) = self.archive.take() {
            let finished = archive
                .finish()
                .map_err(std::io::Error::other)
                .and_then(|mut file| file.flush());
            if let Err(e) = finished {
                self.folder.abandon(SUFFIX);
                return Err(ExportError::file(&self.path)(e));
            }
        }
        self.folder.complete(SUFFIX)
    }
}

impl Drop for NpzFile {
    fn drop(&mut self) {
        if self.archive.take().is_some() {
            self.folder.abandon(SUFFIX);
        }
    }
}

/// numpy's type name of a field. Optional numbers become floats with NaN, and a missing text is
/// empty.
fn dtype(kind: Kind) -> String {
    match kind {
        Kind::Int => "<i8".into(),
        Kind::Pixel => "<u2".into(),
        Kind::Flag => "|b1".into(),
        Kind::Count | Kind::Real => "<f8".into(),
        Kind::Text(width) => format!("<U{}", width.max(1)),
    }
}

fn header(layout: &Layout, rows: u64) -> Vec<u8> {
    let fields = layout
        .columns
        .iter()
        .map(|c| format!("('{}', '{}'), ", c.name, dtype(c.kind)));
    let mut text = format!(
        "{{'descr': [{}], 'fortran_order': False, 'shape': ({rows},), }}",
        fields.collect::<String>()
    );
    while !(PREAMBLE + text.len() + 1).is_multiple_of(ALIGN) {
        text.push(' ');
    }
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    // A version 1 header holds 65,535 bytes, enough for a thousand columns.
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

impl TableWriter for NpzFile {
    fn begin(&mut self, layout: &Layout, rows: u64) -> Result<(), ExportError> {
        let error_of = zip_error(&self.path);
        if let Some(archive) = &mut self.archive {
            let options = SimpleFileOptions::default()
                .compression_method(CompressionMethod::Stored)
                .large_file(true);
            archive
                .start_file(format!("{}.npy", layout.name), options)
                .map_err(&error_of)?;
            archive
                .write_all(&header(layout, rows))
                .map_err(ExportError::file(&self.path))?;
        }
        self.table = Some(OpenTable {
            name: layout.name,
            kinds: layout.columns.iter().map(|c| c.kind).collect(),
            expected: rows,
            found: 0,
        });
        Ok(())
    }

    fn append(&mut self, batch: &[Values]) -> Result<(), ExportError> {
        let (Some(archive), Some(table)) = (&mut self.archive, &mut self.table) else {
            return Ok(());
        };
        let rows = batch.first().map_or(0, Values::rows);
        self.bytes.clear();
        for row in 0..rows {
            for (values, kind) in batch.iter().zip(&table.kinds) {
                cell(values, *kind, row, &mut self.bytes);
            }
        }
        table.found += rows as u64;
        archive
            .write_all(&self.bytes)
            .map_err(ExportError::file(&self.path))
    }

    fn end(&mut self) -> Result<(), ExportError> {
        match self.table.take() {
            Some(table) => ExportError::check_rows(table.name, table.expected, table.found),
            None => Ok(()),
        }
    }
}

fn zip_error(path: &Path) -> impl Fn(zip::result::ZipError) -> ExportError + '_ {
    ExportError::file(path)
}

fn cell(values: &Values, kind: Kind, row: usize, to: &mut Vec<u8>) {
    match values {
        Values::Int(v) => to.extend(v[row].to_le_bytes()),
        Values::Pixel(v) => to.extend(v[row].to_le_bytes()),
        Values::Flag(v) => to.push(u8::from(v[row])),
        Values::Count(v) => to.extend(v[row].map_or(f64::NAN, |n| n as f64).to_le_bytes()),
        Values::Real(v) => to.extend(v[row].to_le_bytes()),
        Values::Text(v) => {
            let width = match kind {
                Kind::Text(width) => width.max(1),
                _ => 1,
            };
            // numpy stores 32-bit code points, padded with zeros.
            let text = v[row].as_deref().unwrap_or_default().chars();
            let padded = text.map(u32::from).chain(std::iter::repeat(0));
            to.extend(padded.take(width).flat_map(u32::to_le_bytes));
        }
    }
}
