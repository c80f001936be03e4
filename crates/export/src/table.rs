//! Owns tables: named columns of plain values, passed on in batches.

use crate::error::ExportError;

/// Type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// 64-bit integers, none missing.
    Int,
    /// 16-bit integers, none missing: pixels.
    Pixel,
    /// Booleans, none missing.
    Flag,
    /// Optional integers.
    Count,
    /// Numbers; NaN is missing.
    Real,
    /// Optional text with at most this many characters.
    Text(usize),
}

/// Name of a column, including its unit, and its type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// For example `depth_mm`.
    pub name: String,
    /// Type of the column.
    pub kind: Kind,
}

/// Columns of a table, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Name of the table, and suffix of its file name.
    pub name: &'static str,
    /// Its columns.
    pub columns: Vec<Column>,
}

/// Values of one column in one batch.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// See [`Kind::Int`].
    Int(Vec<i64>),
    /// See [`Kind::Pixel`].
    Pixel(Vec<u16>),
    /// See [`Kind::Flag`].
    Flag(Vec<bool>),
    /// See [`Kind::Count`].
    Count(Vec<Option<i64>>),
    /// See [`Kind::Real`].
    Real(Vec<f64>),
    /// See [`Kind::Text`].
    Text(Vec<Option<String>>),
}

impl Values {
    /// Number of rows.
    #[must_use]
    pub const fn rows(&self) -> usize {
        match self {
            Self::Int(v) => v.len(),
            Self::Pixel(v) => v.len(),
            Self::Flag(v) => v.len(),
            Self::Count(v) => v.len(),
            Self::Real(v) => v.len(),
            Self::Text(v) => v.len(),
        }
    }

    fn kind(&self) -> Kind {
        match self {
            Self::Int(_) => Kind::Int,
            Self::Pixel(_) => Kind::Pixel,
            Self::Flag(_) => Kind::Flag,
            Self::Count(_) => Kind::Count,
            Self::Real(_) => Kind::Real,
            Self::Text(texts) => {
                let long = texts.iter().flatten().map(|t| t.chars().count()).max();
                Kind::Text(long.unwrap_or(0))
            }
        }
    }
}

/// Receives tables, one after another, each as a sequence of batches.
pub trait TableWriter {
    /// Begins the next table, which will have `rows` rows.
    ///
    /// # Errors
    /// When its file cannot be created.
    fn begin(&mut self, layout: &Layout, rows: u64) -> Result<(), ExportError>;

    /// Appends rows. `batch` has the values of every column in order, with equal lengths.
    ///
    /// # Errors
    /// When they cannot be written.
    fn append(&mut self, batch: &[Values]) -> Result<(), ExportError>;

    /// Ends the table.
    ///
    /// # Errors
    /// When it cannot be completed.
    fn end(&mut self) -> Result<(), ExportError>;
}

/// A table that fits in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Name of the table.
    pub name: &'static str,
    /// Columns with all their values.
    pub columns: Vec<(String, Values)>,
}

impl Table {
    /// Writes the table.
    ///
    /// # Errors
    /// Errors of the writer.
    pub fn write(self, to: &mut dyn TableWriter) -> Result<(), ExportError> {
        let rows = self.columns.first().map_or(0, |(_, values)| values.rows());
        let (columns, values): (Vec<Column>, Vec<Values>) = self
            .columns
            .into_iter()
            .map(|(name, values)| {
                let kind = values.kind();
                (Column { name, kind }, values)
            })
            .unzip();
        let layout = Layout {
            name: self.name,
            columns,
        };
        to.begin(&layout, rows as u64)?;
        to.append(&values)?;
        to.end()
    }
}
