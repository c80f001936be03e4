//! Owns [`Table`]: columns and rows of a page, a terminal or both.

use skinrig_text::{Column as Cells, Style};

use super::{Group, Text};

/// A table.
#[derive(Debug, Clone)]
pub(crate) struct Table {
    /// Test ID, and stem of the downloaded file.
    pub(super) id: String,
    /// Caption, and heading of its card.
    pub(super) title: String,
    pub(super) class: &'static str,
    pub(super) columns: Vec<Column>,
    pub(super) rows: Vec<Row>,
    /// Spaces between the columns of a terminal.
    pub(super) gap: usize,
    notes: Vec<String>,
    /// Table in the script data to download.
    download: Option<&'static str>,
    is_folded: bool,
}

/// A column, with its head on a page and in a terminal; without one, it is absent there.
#[derive(Debug, Clone)]
pub(crate) struct Column {
    /// Head and CSS class.
    pub(super) page: Option<(String, &'static str)>,
    /// Head of one or two lines, and width.
    pub(super) terminal: Option<(String, Cells)>,
}

/// A row. The first cell of a page is the row header.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    pub(super) cells: Vec<Text>,
    pub(super) attributes: Vec<(&'static str, String)>,
    pub(super) style: Option<Style>,
    pub(super) remark: Option<&'static str>,
}

impl Column {
    /// A column of pages. A name with a leading `#` is one of numbers.
    pub(crate) fn new(name: impl AsRef<str>) -> Self {
        let name = name.as_ref();
        let (name, class) = match name.strip_prefix('#') {
            Some(name) => (name, "num"),
            None => (name, ""),
        };
        Self {
            page: Some((name.to_owned(), class)),
            terminal: None,
        }
    }

    /// A column of terminals alone.
    pub(crate) fn of_terminals(head: impl Into<String>, cells: Cells) -> Self {
        Self {
            page: None,
            terminal: Some((head.into(), cells)),
        }
    }

    /// Sets the CSS class.
    pub(crate) fn class(self, class: &'static str) -> Self {
        let page = self.page.map(|(name, _)| (name, class));
        Self { page, ..self }
    }

    /// Shows the column in terminals, too.
    pub(crate) fn terminal(self, head: impl Into<String>, cells: Cells) -> Self {
        Self {
            terminal: Some((head.into(), cells)),
            ..self
        }
    }
}

impl Row {
    pub(crate) fn new<T: Into<Text>>(cells: impl IntoIterator<Item = T>) -> Self {
        Self {
            cells: cells.into_iter().map(Into::into).collect(),
            attributes: vec![],
            style: None,
            remark: None,
        }
    }

    pub(crate) fn class(self, class: &str) -> Self {
        self.attribute("class", class)
    }

    /// Adds an attribute, unless it is empty.
    pub(crate) fn attribute(mut self, name: &'static str, value: &str) -> Self {
        if !value.is_empty() {
            self.attributes.push((name, value.to_owned()));
        }
        self
    }

    /// Style in a terminal.
    pub(crate) fn style(self, style: Option<Style>) -> Self {
        Self { style, ..self }
    }

    /// Explains the row: in its header on a page, below it in a terminal.
    pub(crate) fn remark(self, remark: Option<&'static str>) -> Self {
        Self { remark, ..self }
    }
}

impl Table {
    /// An empty table of pages. Names with a leading `#` are columns of numbers.
    pub(crate) fn new(id: impl Into<String>, title: impl Into<String>, columns: &[&str]) -> Self {
        Self::of(id, title, columns.iter().map(Column::new))
    }

    /// An empty table.
    pub(crate) fn of(
        id: impl Into<String>,
        title: impl Into<String>,
        columns: impl IntoIterator<Item = Column>,
    ) -> Self {
        Self {
            id: id.into(),
            title: title.into(),
            class: "",
            columns: columns.into_iter().collect(),
            rows: vec![],
            gap: 1,
            notes: vec![],
            download: None,
            is_folded: false,
        }
    }

    pub(crate) fn title(&self) -> &str {
        &self.title
    }

    /// Sets the CSS class.
    pub(crate) fn class(self, class: &'static str) -> Self {
        Self { class, ..self }
    }

    /// Sets the spaces between the columns of a terminal.
    pub(crate) fn gap(self, gap: usize) -> Self {
        Self { gap, ..self }
    }

    pub(crate) fn add(&mut self, row: Row) -> &mut Self {
        self.rows.push(row);
        self
    }

    /// Adds a row; its first cell is the row header.
    pub(crate) fn row<T: Into<Text>>(&mut self, cells: impl IntoIterator<Item = T>) -> &mut Self {
        self.add(Row::new(cells))
    }

    /// Adds a row, highlighted if `marked`.
    pub(crate) fn marked_row<T: Into<Text>>(
        &mut self,
        cells: impl IntoIterator<Item = T>,
        marked: bool,
    ) -> &mut Self {
        self.add(Row::new(cells).class(if marked { "marked" } else { "" }))
    }

    /// The table with these rows.
    pub(crate) fn with(mut self, rows: impl IntoIterator<Item = Row>) -> Self {
        self.rows.extend(rows);
        self
    }

    /// Shows only the title until it is opened.
    pub(crate) const fn fold(&mut self) -> &mut Self {
        self.is_folded = true;
        self
    }

    /// Adds a note below the table.
    pub(crate) fn note(&mut self, text: impl Into<String>) -> &mut Self {
        self.notes.push(text.into());
        self
    }

    /// Offers this table of the script data for download.
    pub(crate) const fn download(&mut self, table: &'static str) -> &mut Self {
        self.download = Some(table);
        self
    }

    /// A card with title, download, table and notes.
    pub(crate) fn card(mut self) -> Group {
        let heading = Text::new().heading(&self.title);
        let card = if self.is_folded {
            Group::folded(heading).class("card grid")
        } else {
            Group::titled(&self.title).class("grid")
        };
        let card = match self.download {
            Some(table) => card.download(&self.id, table, &self.title),
            None => card.attribute("data-figure", &self.id),
        };
        let notes = std::mem::take(&mut self.notes);
        // The test ID stands at the card.
        card.test_id(std::mem::take(&mut self.id))
            .with(self)
            .with_all(notes.into_iter().map(Text::from).map(super::soft))
    }
}
