//! Gathers the rows of a damaged session from every page that still holds any.

use std::collections::BTreeMap;
use std::io;

use super::cells::{self, Cell, Value};
use super::pages::{Image, Pages};
use super::shapes::{Part, Shape};

/// A row that was found.
#[derive(Debug, Clone)]
pub enum Found {
    /// As it is.
    Row(Vec<Value>),
    /// Where it lies: it is long, and read again when it is written.
    Place(Image, Cell),
}

/// The rows of one table, by what names them.
#[derive(Debug, Default)]
pub struct Rows {
    pub rows: BTreeMap<Vec<Part>, Found>,
    /// Rows that are there in part: their page goes on where nothing is any more.
    pub torn: u64,
}

/// Every row of every shape, in the order of `shapes`. An image of a page that was written later supersedes those before it, row by row: rows are added and
/// completed, and but for the end and the seal of a session that goes on never taken away.
pub fn gather(pages: &mut Pages, shapes: &[Shape]) -> io::Result<Vec<Rows>> {
    let mut out: Vec<Rows> = shapes.iter().map(|_| Rows::default()).collect();
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
            let fitting = |shape: &&(usize, &Shape)| shape.1.takes(&types, keyed);
            let fitting: Vec<(usize, &Shape)> =
                shapes.iter().enumerate().filter(|s| fitting(&s)).collect();
            let Some(&(first, shape)) = fitting.first() else {
                continue;
            };
            if shape.kind.hashed.is_some() {
                let row = cells::leading(&head, types.len()).map(|v| shape.row(v, cell.rowid));
                if let Some(key) = row.and_then(|row| shape.key(&row)) {
                    out[first].rows.insert(key, Found::Place(image, cell));
                }
                continue;
            }
            let whole = cell.payload(&page, pages, usize::MAX)?;
            let Some(values) = whole.as_deref().and_then(cells::values) else {
                out[first].torn += 1;
                continue;
            };
            let Some(&(i, shape)) = fitting.iter().find(|(_, s)| s.says(&values)) else {
                continue;
            };
            // A further leg takes these away: older copies of their page say nothing.
            let taken_away = matches!(shape.kind.name, "run_end" | "table_digest");
            if taken_away && pages.latest(image.page) != Some(image) {
                continue;
            }
            let row = shape.row(values, cell.rowid);
            let Some(key) = shape.key(&row) else {
                continue;
            };
            let rows = &mut out[i].rows;
            // An attempt whose end is known is never undone by an older copy of its page.
            let undone = shape.kind.name == "attempt"
                && matches!(rows.get(&key), Some(Found::Row(old)) if old[VERDICT] != Value::Null)
                && row[VERDICT] == Value::Null;
            if !undone {
                let found = if cell.is_long() {
                    Found::Place(image, cell)
                } else {
                    Found::Row(row)
                };
                rows.insert(key, found);
            }
        }
    }
    Ok(out)
}

/// The column `verdict` of `attempt`.
const VERDICT: usize = 4;

/// The columns of a row that was found; `None` when it does not hang together any more.
pub fn read(pages: &mut Pages, shape: &Shape, found: &Found) -> io::Result<Option<Vec<Value>>> {
    let (image, cell) = match found {
        Found::Row(row) => return Ok(Some(row.clone())),
        Found::Place(image, cell) => (image, cell),
    };
    let mut page = Vec::new();
    pages.read(*image, &mut page)?;
    let payload = cell.payload(&page, pages, usize::MAX)?;
    let values = payload.as_deref().and_then(cells::values);
    Ok(values.map(|values| shape.row(values, cell.rowid)))
}

/// The columns of a long row as far as its own page holds them; the others null.
pub fn beginning(pages: &mut Pages, shape: &Shape, found: &Found) -> io::Result<Vec<Value>> {
    let Found::Place(image, cell) = found else {
        return Ok(Vec::new());
    };
    let mut page = Vec::new();
    pages.read(*image, &mut page)?;
    let head = cell.payload(&page, pages, 0)?.unwrap_or_default();
    let values = cells::leading(&head, usize::MAX).unwrap_or_default();
    Ok(shape.row(values, cell.rowid))
}
