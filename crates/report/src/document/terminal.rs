//! Renders sections for a terminal: lines of 80 columns, labels on the left, an empty line between sections.

use skinrig_text::{LongWords, Paint, WIDTH, elide, hang};

use super::{Block, Note, Section, Table, Tone};
use crate::format::plain;

/// Columns of a label.
const LABEL: usize = 10;

/// All sections with something to show.
pub(crate) fn terminal(sections: &[Section], paint: Paint) -> String {
    let shown = sections.iter().map(|s| lines(&s.blocks, paint));
    let shown: Vec<String> = shown.filter(|text| !text.is_empty()).collect();
    shown.join("\n")
}

/// Blocks one below the other; figures and markup are left out.
pub(crate) fn lines(blocks: &[Block], paint: Paint) -> String {
    let mut out = String::new();
    for block in blocks {
        match block {
            Block::Text(_, text) | Block::Heading(_, text) => {
                out += &hang("", &plain(&text.words()), LongWords::Cut)
            }
            Block::Note(note) => out += &note.lines(paint),
            Block::Commands(commands) => {
                for command in commands {
                    out += &format!("  {command}\n");
                }
            }
            Block::Table(table) => out += &table.lines(paint),
            Block::Group(group) => out += &lines(&group.blocks, paint),
            Block::Facts(facts) => {
                for fact in facts {
                    out += &Note::new(&*fact.key, fact.value.clone()).lines(paint);
                }
            }
            Block::Figure(..) | Block::Markup(_) => {}
        }
    }
    out
}

impl Note {
    /// The label, and the words beside it.
    pub(crate) fn lines(&self, paint: Paint) -> String {
        let label = format!("{:<LABEL$}", self.label);
        let text = hang(&label, &plain(&self.text.words()), LongWords::Cut);
        let text = match self.most_lines {
            Some(most) => cut(text, most),
            None => text,
        };
        match self.tone {
            Tone::Plain | Tone::Good => text,
            Tone::Warning | Tone::Bad => paint.warn(&text),
            Tone::Answer => paint.bold(&text),
        }
    }
}

/// The first lines of a wrapped text; `…` ends a cut one.
fn cut(text: String, most_lines: usize) -> String {
    let mut lines: Vec<&str> = text.lines().collect();
    if lines.len() <= most_lines {
        return text;
    }
    lines.truncate(most_lines);
    let last = elide(lines.pop().unwrap_or_default(), WIDTH);
    lines.push(&last);
    lines.join("\n") + "\n"
}

impl Table {
    fn lines(&self, paint: Paint) -> String {
        let columns = || self.columns.iter().filter_map(|c| c.terminal.as_ref());
        let cells: Vec<_> = columns().map(|(_, cells)| *cells).collect();
        let layout = skinrig_text::Table::new(cells).gap(self.gap);
        let mut out = String::new();
        let heights = columns().map(|(head, _)| head.lines().count());
        for line in 0..heights.max().unwrap_or(0) {
            let heads = columns().map(|(head, _)| head.lines().nth(line).unwrap_or(""));
            out += &paint.bold(&layout.row(heads));
            out.push('\n');
        }
        for row in &self.rows {
            let cells = self.columns.iter().zip(&row.cells);
            let cells = cells.filter(|(column, _)| column.terminal.is_some());
            let line = layout.row(cells.map(|(_, cell)| plain(&cell.words())));
            out += &row
                .style
                .map_or(line.clone(), |style| paint.apply(style, &line));
            out.push('\n');
            if let Some(remark) = row.remark {
                out += &format!("    ^ {remark}\n");
            }
        }
        out
    }
}
