//! Tables as one numpy archive: a structured array each.
//!
//! An `.npz` is a zip of `.npy` files (numpy.org, "numpy.lib.format", version 1.0); stored, not deflated, as `numpy.savez` does.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::error::ExportError;
use crate::folder::Folder;
use crate::table::{Kind, Layout, TableWriter, Values};

/// The archive's name after the stem.
pub(crate) const ENDING: &str = ".npz";

/// The header of a `.npy` is padded to a multiple of this.
const ALIGN: usize = 64;
/// Magic, version and the length of the rest.
const PREAMBLE: usize = 10;

/// One file for all tables.
pub struct NpzFile {
    folder: Folder,
    path: PathBuf,
    archive: Option<ZipWriter<BufWriter<File>>>,
    table: Option<Open>,
    bytes: Vec<u8>,
}

struct Open {
    name: &'static str,
    kinds: Vec<Kind>,
    expected: u64,
    found: u64,
}

impl NpzFile {
    /// Into `folder`.
    ///
    /// # Errors
    /// When the file cannot be made.
    pub fn create(folder: Folder) -> Result<Self, ExportError> {
        let path = folder.begin(ENDING)?;
        let file = File::create_new(&path).map_err(ExportError::file(&path))?;
        Ok(Self {
            archive: Some(ZipWriter::new(BufWriter::with_capacity(1 << 20, file))),
            path,
            folder,
            table: None,
            bytes: Vec::new(),
        })
    }

    /// Completes the archive; its path.
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
                self.folder.abandon(ENDING);
                return Err(ExportError::file(&self.path)(e));
            }
        }
        self.folder.complete(ENDING)
    }
}

impl Drop for NpzFile {
    fn drop(&mut self) {
        if self.archive.take().is_some() {
            self.folder.abandon(ENDING);
        }
    }
}

/// numpy's name of a field's type: a number that may be none is a float with NaN, a text that may be none is empty then.
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
    // A header of version 1 holds 65 535 bytes: a thousand columns.
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

impl TableWriter for NpzFile {
    fn begin(&mut self, layout: &Layout, rows: u64) -> Result<(), ExportError> {
        let said = said(&self.path);
        if let Some(archive) = &mut self.archive {
            let options = SimpleFileOptions::default()
                .compression_method(CompressionMethod::Stored)
                .large_file(true);
            archive
                .start_file(format!("{}.npy", layout.name), options)
                .map_err(&said)?;
            archive
                .write_all(&header(layout, rows))
                .map_err(ExportError::file(&self.path))?;
        }
        self.table = Some(Open {
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
            Some(table) if table.found != table.expected => Err(ExportError::Changed {
                table: table.name,
                expected: table.expected,
                found: table.found,
            }),
            _ => Ok(()),
        }
    }
}

fn said(path: &Path) -> impl Fn(zip::result::ZipError) -> ExportError + '_ {
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
            // numpy keeps code points of 32 bits and fills up with zeros.
            let text = v[row].as_deref().unwrap_or_default().chars();
            let padded = text.map(u32::from).chain(std::iter::repeat(0));
            to.extend(padded.take(width).flat_map(u32::to_le_bytes));
        }
    }
}
