//! Owns the small tables in the page's sections, written by the template's `grid` macro.

use serde::Serialize;

/// A table.
#[derive(Debug, Clone, Serialize)]
pub(super) struct Grid {
    /// Test ID, and stem of the downloaded file.
    id: &'static str,
    title: &'static str,
    columns: Vec<Column>,
    rows: Vec<Row>,
    notes: Vec<String>,
    /// Table in the script data to download.
    table: Option<&'static str>,
    /// True for a table that opens on request.
    folded: bool,
}

#[derive(Debug, Clone, Serialize)]
struct Column {
    name: String,
    number: bool,
}

#[derive(Debug, Clone, Serialize)]
struct Row {
    cells: Vec<String>,
    /// True for a highlighted row: chosen, or the session's own.
    marked: bool,
}

impl Grid {
    /// An empty table. Names with a leading `#` are columns of numbers.
    pub(super) fn new(id: &'static str, title: &'static str, columns: &[&str]) -> Self {
        let column = |name: &&str| Column {
            name: name.trim_start_matches('#').to_owned(),
            number: name.starts_with('#'),
        };
        Self {
            id,
            title,
            columns: columns.iter().map(column).collect(),
            rows: vec![],
            notes: vec![],
            table: None,
            folded: false,
        }
    }

    /// Adds a row; its first cell is the row header.
    pub(super) fn row(&mut self, cells: impl IntoIterator<Item = String>) -> &mut Self {
        self.marked_row(cells, false)
    }

    /// Adds a row, highlighted if `marked`.
    pub(super) fn marked_row(
        &mut self,
        cells: impl IntoIterator<Item = String>,
        marked: bool,
    ) -> &mut Self {
        self.rows.push(Row {
            cells: cells.into_iter().collect(),
            marked,
        });
        self
    }

    /// Shows only the title until it is opened.
    pub(super) const fn fold(&mut self) -> &mut Self {
        self.folded = true;
        self
    }

    /// Adds a note below the table.
    pub(super) fn note(&mut self, text: impl Into<String>) -> &mut Self {
        self.notes.push(text.into());
        self
    }

    /// Offers this table of the script data for download.
    pub(super) const fn download(&mut self, table: &'static str) -> &mut Self {
        self.table = Some(table);
        self
    }
}
