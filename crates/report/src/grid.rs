//! Owns the tables of all pages, written by the template's macros `grid` (a card) and `table`.

use serde::Serialize;

/// A table.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct Grid {
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
    code: bool,
}

#[derive(Debug, Clone, Serialize)]
struct Row {
    cells: Vec<String>,
    /// CSS class: `marked` for a highlighted row (chosen, or the session's own).
    class: &'static str,
}

impl Grid {
    /// An empty table. Names with a leading `#` are columns of numbers, those with a backtick of
    /// literal text.
    pub(crate) fn new(id: &'static str, title: &'static str, columns: &[&str]) -> Self {
        let column = |name: &&str| Column {
            name: name.trim_start_matches(['#', '`']).to_owned(),
            number: name.starts_with('#'),
            code: name.starts_with('`'),
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
    pub(crate) fn row(&mut self, cells: impl IntoIterator<Item = String>) -> &mut Self {
        self.row_of(cells, "")
    }

    /// Adds a row, highlighted if `marked`.
    pub(crate) fn marked_row(
        &mut self,
        cells: impl IntoIterator<Item = String>,
        marked: bool,
    ) -> &mut Self {
        self.row_of(cells, if marked { "marked" } else { "" })
    }

    /// Adds a row with a CSS class.
    pub(crate) fn row_of(
        &mut self,
        cells: impl IntoIterator<Item = String>,
        class: &'static str,
    ) -> &mut Self {
        let cells = cells.into_iter().collect();
        self.rows.push(Row { cells, class });
        self
    }

    /// The table with these rows.
    pub(crate) fn with<R: IntoIterator<Item = String>>(
        mut self,
        rows: impl IntoIterator<Item = R>,
    ) -> Self {
        for row in rows {
            self.row(row);
        }
        self
    }

    /// Shows only the title until it is opened.
    pub(crate) const fn fold(&mut self) -> &mut Self {
        self.folded = true;
        self
    }

    /// Adds a note below the table.
    pub(crate) fn note(&mut self, text: impl Into<String>) -> &mut Self {
        self.notes.push(text.into());
        self
    }

    /// Offers this table of the script data for download.
    pub(crate) const fn download(&mut self, table: &'static str) -> &mut Self {
        self.table = Some(table);
        self
    }
}
