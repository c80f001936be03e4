//! Press-position tables: CSV with a header that has at least `x` and `y`.
//!
//! The published table is in metres and ends with a row of empty cells (`,,`). Rows without any value are
//! allowed only after the last press; they are reported with their lines and do not count as presses. A row with some
//! values must have x and y, and z if the table has that column.

use std::io::Read;
use std::path::{Path, PathBuf};

use csv::{ReaderBuilder, StringRecord, Trim};

use crate::error::FormatsError;
use crate::regular;

/// Coordinates beyond this are not positions on a bench, mm.
const MAX_MM: f64 = 10_000.0;

/// Unit of a table's numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LengthUnit {
    /// Metres, as published.
    Metre,
    /// Millimetres.
    Millimetre,
}

impl LengthUnit {
    const fn mm(self) -> f64 {
        match self {
            Self::Metre => 1000.0,
            Self::Millimetre => 1.0,
        }
    }
}

/// One press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressPosition {
    /// mm, in the table's own frame.
    pub x_mm: f64,
    /// mm.
    pub y_mm: f64,
    /// mm; `None` if the table has no z column.
    pub z_mm: Option<f64>,
    /// Line of the file, 1 for the header.
    pub line: u64,
}

/// A table of presses in order.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionTable {
    /// The presses.
    pub presses: Vec<PressPosition>,
    /// Lines of the rows without any value, after the last press.
    pub blank_lines: Vec<u64>,
    /// Ignored columns: neither x, y nor z.
    pub other_columns: Vec<String>,
}

impl PositionTable {
    /// Reads the table at `path`.
    ///
    /// # Errors
    /// [`FormatsError::Io`], or [`FormatsError::Table`] as [`Self::parse`].
    pub fn read(path: &Path, unit: LengthUnit) -> Result<Self, FormatsError> {
        let text = regular::read_text(path).map_err(FormatsError::io(path))?;
        Self::parse(&text[..], path, unit)
    }

    /// Reads a table from `source`; `path` is its name in messages.
    ///
    /// # Errors
    /// [`FormatsError::Table`] with the line: a missing or doubled column, a cell that is empty, not a number, not
    /// finite or farther than 10 m away, a row with another number of cells, a press after a blank row, or no
    /// press.
    pub fn parse(
        mut source: impl Read,
        path: &Path,
        unit: LengthUnit,
    ) -> Result<Self, FormatsError> {
        let table = Table { path: path.into() };
        let mut text = Vec::new();
        source
            .read_to_end(&mut text)
            .map_err(FormatsError::io(path))?;
        let mut reader = ReaderBuilder::new()
            .trim(Trim::All)
            .flexible(true)
            .from_reader(&text[..]);
        let header = reader.headers().map_err(|e| table.csv(&e))?.clone();
        let columns = [
            table.column(&header, "x")?,
            table.column(&header, "y")?,
            table.column(&header, "z")?,
        ];
        for (name, column) in ["x", "y"].iter().zip(columns) {
            if column.is_none() {
                let found: Vec<_> = header.iter().collect();
                let found = format!("columns {}", found.join(", "));
                return Err(table.error(1, &format!("a column `{name}`"), found));
            }
        }
        let mut presses: Vec<PressPosition> = Vec::new();
        let mut blank_lines: Vec<u64> = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|e| table.csv(&e))?;
            // The reader's position is before the empty lines that it skipped.
            let line = record.position().map_or(0, |at| {
                let rest = text.get(at.byte() as usize..).unwrap_or_default();
                let ends = rest.iter().take_while(|b| matches!(b, b'\r' | b'\n'));
                at.line() + ends.filter(|b| **b == b'\n').count() as u64
            });
            if record.iter().all(str::is_empty) {
                blank_lines.push(line);
                continue;
            }
            if record.len() != header.len() {
                let expected = format!("{} cells", header.len());
                return Err(table.error(line, &expected, record.len().to_string()));
            }
            let cell = |column: Option<usize>, name| {
                let Some(text) = column.and_then(|c| record.get(c)) else {
                    return Ok(None);
                };
                let mm = text.parse::<f64>().map(|v| v * unit.mm());
                match mm {
                    Ok(mm) if mm.abs() <= MAX_MM => Ok(Some(mm)),
                    _ => {
                        let limit = MAX_MM / unit.mm();
                        let expected = format!("a number in -{limit}..={limit} as {name}");
                        Err(table.error(line, &expected, format!("`{text}`")))
                    }
                }
            };
            let [x, y, z] = columns;
            if let (Some(x_mm), Some(y_mm)) = (cell(x, "x")?, cell(y, "y")?) {
                let z_mm = cell(z, "z")?;
                presses.push(PressPosition {
                    x_mm,
                    y_mm,
                    z_mm,
                    line,
                });
            }
        }
        // The CSV reader skips empty lines.
        let lines = text
            .strip_suffix(b"\n")
            .unwrap_or(&text)
            .split(|b| *b == b'\n');
        let empty = |line: &[u8]| line.trim_ascii().is_empty();
        blank_lines.extend((1..).zip(lines).filter(|(_, l)| empty(l)).map(|(n, _)| n));
        blank_lines.sort_unstable();
        blank_lines.dedup();
        let Some(last) = presses.last() else {
            return Err(table.error(2, "at least one press", "none".into()));
        };
        if let Some(line) = blank_lines.iter().find(|line| **line < last.line) {
            let found = format!("a blank row, and a press at line {}", last.line);
            return Err(table.error(*line, "blank rows only after the last press", found));
        }
        let known = |name: &&str| !["x", "y", "z"].contains(name);
        Ok(Self {
            presses,
            blank_lines,
            other_columns: header.iter().filter(known).map(Into::into).collect(),
        })
    }
}

/// Builds errors with the name of the table.
struct Table {
    path: PathBuf,
}

impl Table {
    fn error(&self, line: u64, expected: &str, found: String) -> FormatsError {
        FormatsError::Table {
            path: self.path.clone(),
            line,
            expected: expected.into(),
            found,
        }
    }

    fn csv(&self, error: &csv::Error) -> FormatsError {
        let line = error.position().map_or(1, csv::Position::line);
        self.error(line, "a table in UTF-8", error.to_string())
    }

    /// Index of the column `name`.
    fn column(&self, header: &StringRecord, name: &str) -> Result<Option<usize>, FormatsError> {
        let mut places = (0..header.len()).filter(|c| header.get(*c) == Some(name));
        match (places.next(), places.next()) {
            (place, None) => Ok(place),
            _ => Err(self.error(1, &format!("one column `{name}`"), "two".into())),
        }
    }
}
