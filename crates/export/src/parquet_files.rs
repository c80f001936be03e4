//! Writes tables as Parquet (parquet.apache.org), one file each, compressed with Snappy; a batch is a row group.

use std::fs::File;
use std::path::PathBuf;
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;

use crate::error::ExportError;
use crate::folder::Folder;
use crate::table::{Kind, Layout, TableWriter, Values};
use crate::table_files::TableFiles;

/// Writes one file per table.
pub struct ParquetFiles(TableFiles<SerializedFileWriter<File>>);

/// Suffix of a table's file name.
pub(crate) const SUFFIX: &str = "parquet";

impl ParquetFiles {
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

/// Schema in Parquet's own notation. Columns with missing values are `optional`.
fn schema(layout: &Layout) -> String {
    let columns = layout.columns.iter().map(|column| {
        let (before, after) = match column.kind {
            Kind::Int => ("required int64", ""),
            Kind::Pixel => ("required int32", " (INTEGER(16, false))"),
            Kind::Flag => ("required boolean", ""),
            Kind::Count => ("optional int64", ""),
            Kind::Real => ("optional double", ""),
            Kind::Text(_) => ("optional binary", " (UTF8)"),
        };
        format!("{before} {}{after};", column.name)
    });
    format!(
        "message {} {{ {} }}",
        layout.name,
        columns.collect::<String>()
    )
}

impl TableWriter for ParquetFiles {
    fn begin(&mut self, layout: &Layout, _rows: u64) -> Result<(), ExportError> {
        let suffix = format!(".{}.{SUFFIX}", layout.name);
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .build();
        self.0.begin(suffix, |file| {
            let schema = parse_message_type(&schema(layout))?;
            SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties))
        })
    }

    fn append(&mut self, batch: &[Values]) -> Result<(), ExportError> {
        let Some((writer, path)) = self.0.current() else {
            return Ok(());
        };
        row_group(writer, batch).map_err(ExportError::file(&path))
    }

    fn end(&mut self) -> Result<(), ExportError> {
        self.0.end(|writer| writer.close().map(drop))
    }
}

fn row_group(
    writer: &mut SerializedFileWriter<File>,
    batch: &[Values],
) -> Result<(), ParquetError> {
    if batch.first().map_or(0, Values::rows) == 0 {
        return Ok(());
    }
    let mut group = writer.next_row_group()?;
    for values in batch {
        let Some(mut column) = group.next_column()? else {
            return Err(ParquetError::General("fewer columns than values".into()));
        };
        column_of(column.untyped(), values)?;
        column.close()?;
    }
    group.close().map(drop)
}

/// Present values, and Parquet's definition level of each row.
fn present<T: Clone>(values: impl Iterator<Item = Option<T>>) -> (Vec<T>, Vec<i16>) {
    let (mut some, mut levels) = (Vec::new(), Vec::new());
    for value in values {
        levels.push(i16::from(value.is_some()));
        some.extend(value);
    }
    (some, levels)
}

fn column_of(column: &mut ColumnWriter<'_>, values: &Values) -> Result<(), ParquetError> {
    let written = match (column, values) {
        (ColumnWriter::Int64ColumnWriter(w), Values::Int(v)) => w.write_batch(v, None, None),
        (ColumnWriter::Int32ColumnWriter(w), Values::Pixel(v)) => {
            let wide: Vec<i32> = v.iter().map(|n| i32::from(*n)).collect();
            w.write_batch(&wide, None, None)
        }
        (ColumnWriter::BoolColumnWriter(w), Values::Flag(v)) => w.write_batch(v, None, None),
        (ColumnWriter::Int64ColumnWriter(w), Values::Count(v)) => {
            let (some, levels) = present(v.iter().copied());
            w.write_batch(&some, Some(&levels), None)
        }
        (ColumnWriter::DoubleColumnWriter(w), Values::Real(v)) => {
            let (some, levels) = present(v.iter().map(|x| Some(*x).filter(|x| !x.is_nan())));
            w.write_batch(&some, Some(&levels), None)
        }
        (ColumnWriter::ByteArrayColumnWriter(w), Values::Text(v)) => {
            let (some, levels) = present(v.iter().map(|t| t.as_deref().map(ByteArray::from)));
            w.write_batch(&some, Some(&levels), None)
        }
        _ => Err(ParquetError::General(
            "values do not match the type of their column".into(),
        )),
    };
    written.map(drop)
}
