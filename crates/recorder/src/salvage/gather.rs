//! Gathers the rows of a damaged session from every readable page.

use std::collections::BTreeMap;
use std::io;

use super::cells::{self, Cell, Value};
use super::pages::{Image, Pages};
use super::shapes::{KeyPart, TableShape};

/// A recovered row.
#[derive(Debug, Clone)]
pub(crate) enum RecoveredRow {
    /// The values.
    Values(Vec<Value>),
    /// The location of a long row, which is read again when it is written.
    Location(Image, Cell),
}

/// Recovered rows of one table, by key.
#[derive(Debug, Default)]
pub(crate) struct TableRows {
    pub rows: BTreeMap<Vec<KeyPart>, RecoveredRow>,
    /// Number of rows whose overflow pages are missing.
    pub torn: u64,
}

/// Gathers all rows of every table, in the order of `shapes`. A later image of a page supersedes earlier ones row by row: rows are
/// added and completed but never deleted, except for the end and the seal of a resumed session.
pub(super) fn gather(pages: &mut Pages, shapes: &[TableShape]) -> io::Result<Vec<TableRows>> {
    let mut out: Vec<TableRows> = shapes.iter().map(|_| TableRows::default()).collect();
    let mut page = Vec::new();
    for image in pages.images() {
        pages.read(image, &mut page)?;
        for cell in cells::cells(image, &page) {
            let Some(head) = cell.payload(&page, pages, 0)? else {
                continue;
            };
            let Some((types, _)) = cells::serial_types(&head) else {
                continue;
            };
            let keyed = cell.rowid.is_none();
            let fitting = |shape: &&(usize, &TableShape)| shape.1.matches_types(&types, keyed);
            let fitting: Vec<(usize, &TableShape)> =
                shapes.iter().enumerate().filter(|s| fitting(&s)).collect();
            let Some(&(first, shape)) = fitting.first() else {
                continue;
            };
            if shape.kind.hashed.is_some() {
                let row = cells::leading(&head, types.len()).map(|v| shape.row(v, cell.rowid));
                if let Some(key) = row.and_then(|row| shape.key(&row)) {
                    out[first]
                        .rows
                        .insert(key, RecoveredRow::Location(image, cell));
                }
                continue;
            }
            let whole = cell.payload(&page, pages, usize::MAX)?;
            let Some(values) = whole.as_deref().and_then(cells::values) else {
                out[first].torn += 1;
                continue;
            };
            let Some(&(i, shape)) = fitting.iter().find(|(_, s)| s.matches_values(&values)) else {
                continue;
            };
            // A further leg deletes these rows, so older copies of the page are obsolete.
            let is_deleted = matches!(shape.kind.name, "run_end" | "table_digest");
            if is_deleted && pages.latest(image.page) != Some(image) {
                continue;
            }
            let row = shape.row(values, cell.rowid);
            let Some(key) = shape.key(&row) else {
                continue;
            };
            let rows = &mut out[i].rows;
            // A completed attempt never becomes open again, so an older copy does not replace it.
            let undone = shape.kind.name == "attempt"
                && matches!(rows.get(&key), Some(RecoveredRow::Values(old)) if old[VERDICT] != Value::Null)
                && row[VERDICT] == Value::Null;
            if !undone {
                let found = if cell.is_long() {
                    RecoveredRow::Location(image, cell)
                } else {
                    RecoveredRow::Values(row)
                };
                rows.insert(key, found);
            }
        }
    }
    Ok(out)
}

/// The column `verdict` of `attempt`.
const VERDICT: usize = 4;

/// Columns of a recovered row; `None` if its overflow chain is broken.
pub(super) fn read(
    pages: &mut Pages,
    shape: &TableShape,
    found: &RecoveredRow,
) -> io::Result<Option<Vec<Value>>> {
    let (image, cell) = match found {
        RecoveredRow::Values(row) => return Ok(Some(row.clone())),
        RecoveredRow::Location(image, cell) => (image, cell),
    };
    let mut page = Vec::new();
    pages.read(*image, &mut page)?;
    let payload = cell.payload(&page, pages, usize::MAX)?;
    let values = payload.as_deref().and_then(cells::values);
    Ok(values.map(|values| shape.row(values, cell.rowid)))
}

/// Columns of a long row that its own page contains; the others are null.
pub(crate) fn read_leading(
    pages: &mut Pages,
    shape: &TableShape,
    found: &RecoveredRow,
) -> io::Result<Vec<Value>> {
    let RecoveredRow::Location(image, cell) = found else {
        return Ok(Vec::new());
    };
    let mut page = Vec::new();
    pages.read(*image, &mut page)?;
    let head = cell.payload(&page, pages, 0)?.unwrap_or_default();
    let values = cells::leading(&head, usize::MAX).unwrap_or_default();
    Ok(shape.row(values, cell.rowid))
}
