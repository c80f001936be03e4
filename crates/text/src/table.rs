//! Tables: cells padded to the columns of their heads.

use crate::{clip, width};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Align {
    Left,
    Right,
    Centre,
}

/// A column: its width and alignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column {
    align: Align,
    width: usize,
    is_clipped: bool,
    /// Spaces before the cell.
    before: usize,
}

impl Column {
    const fn new(align: Align, width: usize) -> Self {
        Self {
            align,
            width,
            is_clipped: false,
            before: 0,
        }
    }

    /// Text on the left, at least `width` columns.
    #[must_use]
    pub const fn left(width: usize) -> Self {
        Self::new(Align::Left, width)
    }

    /// Text on the right, at least `width` columns.
    #[must_use]
    pub const fn right(width: usize) -> Self {
        Self::new(Align::Right, width)
    }

    /// Text in the middle, at least `width` columns.
    #[must_use]
    pub const fn centre(width: usize) -> Self {
        Self::new(Align::Centre, width)
    }

    /// Cuts longer texts.
    #[must_use]
    pub const fn clipped(self) -> Self {
        Self {
            is_clipped: true,
            ..self
        }
    }

    /// Puts this many spaces before the column.
    #[must_use]
    pub const fn after(self, before: usize) -> Self {
        Self { before, ..self }
    }

    /// `text` padded to the width of the column.
    #[must_use]
    pub fn cell(self, text: &str) -> String {
        let text = if self.is_clipped {
            clip(text, self.width)
        } else {
            text.to_owned()
        };
        let room = self.width.saturating_sub(width(&text));
        let before = match self.align {
            Align::Left => 0,
            Align::Right => room,
            Align::Centre => room / 2,
        };
        let after = room - before;
        let before = self.before + before;
        format!("{:before$}{text}{:after$}", "", "")
    }
}

/// Formats rows, one at a time. Cells to the right of the last column are not padded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    columns: Vec<Column>,
    indent: usize,
    gap: usize,
}

impl Table {
    /// A table with two spaces between columns.
    #[must_use]
    pub fn new(columns: impl Into<Vec<Column>>) -> Self {
        Self {
            columns: columns.into(),
            indent: 0,
            gap: 2,
        }
    }

    /// Sets the number of spaces before each row.
    #[must_use]
    pub fn indent(self, indent: usize) -> Self {
        Self { indent, ..self }
    }

    /// Sets the number of spaces between columns.
    #[must_use]
    pub fn gap(self, gap: usize) -> Self {
        Self { gap, ..self }
    }

    /// One line without line break and trailing spaces.
    #[must_use]
    pub fn row<C: AsRef<str>>(&self, cells: impl IntoIterator<Item = C>) -> String {
        let mut out = " ".repeat(self.indent);
        for (i, cell) in cells.into_iter().enumerate() {
            if i > 0 {
                out += &" ".repeat(self.gap);
            }
            let text = cell.as_ref();
            match self.columns.get(i) {
                Some(column) => out += &column.cell(text),
                None => out += text,
            }
        }
        out.truncate(out.trim_end_matches(' ').len());
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_aligned() {
        let columns = [Column::left(4), Column::right(4), Column::centre(5)];
        let table = Table::new(columns).indent(1).gap(1);
        assert_eq!(table.row(["ab", "12", "x", "end"]), " ab     12   x   end");
        assert_eq!(table.row(["abcde", "1", "xy", ""]), " abcde    1  xy");
        let clipped = Table::new([Column::left(4).clipped(), Column::left(0)]);
        assert_eq!(clipped.row(["abcde", "f"]), "abc…  f");
        let apart = Table::new([Column::right(3).after(2), Column::left(0).after(1)]).gap(0);
        assert_eq!(apart.row(["ab", "c"]), "   ab c");
    }

    #[test]
    fn names_of_wide_and_combining_characters_keep_columns_aligned() {
        let table = Table::new([Column::left(10).clipped(), Column::right(6)]);
        let names = [
            "skin-A",
            "皮膚一号",
            "シリコーン皮膚",
            "e\u{301}lastome\u{300}re",
            "e\u{301}lastome\u{300}re-mince",
        ];
        for name in names {
            let row = table.row([name, "1.25", "file"]);
            let before = row.strip_suffix("  file").unwrap();
            assert_eq!(width(before), 18, "{row}");
            assert!(before.ends_with("  1.25"), "{row}");
        }
    }
}
