//! Tables: named columns of plain values, handed over batch by batch.

use crate::error::ExportError;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Whole numbers, 64 bits, none missing.
    Int,
    /// Whole numbers, 16 bits, none missing: pixels.
    Pixel,
    /// Yes or no, none missing.
    Flag,
    /// Whole numbers, or none.
    Count,
    /// Numbers; NaN is none.
    Real,
    /// Text of at most so many characters, or none.
    Text(usize),
}

/// A column's name, with its unit, and what it holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// For example `depth_mm`.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
}

/// The columns of a table, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Name of the table and, after the stem, of its file.
    pub name: &'static str,
    /// Its columns.
    pub columns: Vec<Column>,
}

/// The values of one column in one batch.
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
    /// Rows.
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

/// Takes tables, one after the other, each with all of its batches in order.
pub trait TableWriter {
    /// The next table; it will have so many rows.
    ///
    /// # Errors
    /// When its file cannot be made.
    fn begin(&mut self, layout: &Layout, rows: u64) -> Result<(), ExportError>;

    /// Rows of it: values of all columns in their order, equally many of each.
    ///
    /// # Errors
    /// When they cannot be written.
    fn append(&mut self, batch: &[Values]) -> Result<(), ExportError>;

    /// The table is complete.
    ///
    /// # Errors
    /// When that cannot be written.
    fn end(&mut self) -> Result<(), ExportError>;
}

/// A table that fits in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Its name.
    pub name: &'static str,
    /// Its columns with all of their values.
    pub columns: Vec<(String, Values)>,
}

impl Table {
    /// Hands it over.
    ///
    /// # Errors
    /// What the writer says.
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
