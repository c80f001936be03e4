//! Source texts and locations in them: the protocol file, each `--set` argument, a CSV of points.

/// A range of bytes of one source text.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Span {
    /// Index into [`Sources`].
    pub source: usize,
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

impl Span {
    /// The range `start..end` of source number `source`.
    pub const fn new(source: usize, start: usize, end: usize) -> Self {
        Self { source, start, end }
    }
}

/// One text that diagnostics can point into.
#[derive(Debug, Clone)]
struct Source {
    name: String,
    text: String,
    /// Byte offset of the first byte of every line.
    line_starts: Vec<usize>,
}

/// All texts that diagnostics can point into.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    list: Vec<Source>,
}

/// A location for display. Lines and columns count from 1; columns count characters.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Location {
    /// Name of the file, or `--set` for a value given on the command line.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Length in characters, at least 1; never past the end of the line.
    pub length: usize,
    /// The line without its line break; tabs shown as one space each. Of a very long line only the part around the
    /// column.
    pub text: String,
    /// Column of the first character of `text`; 1 except for very long lines.
    pub text_column: usize,
}

impl Sources {
    /// Adds a text and returns its number.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> usize {
        let text = text.into();
        let line_starts = std::iter::once(0)
            .chain(text.match_indices('\n').map(|(i, _)| i + 1))
            .collect();
        self.list.push(Source {
            name: name.into(),
            text,
            line_starts,
        });
        self.list.len() - 1
    }

    /// The text of source number `source`.
    pub fn text(&self, source: usize) -> &str {
        self.list.get(source).map_or("", |s| s.text.as_str())
    }

    /// The location of `span`, for display.
    pub fn locate(&self, span: Span) -> Location {
        let Some(source) = self.list.get(span.source) else {
            return Location {
                file: String::new(),
                line: 1,
                column: 1,
                length: 1,
                text: String::new(),
                text_column: 1,
            };
        };
        let start = floor_boundary(&source.text, span.start);
        let end = floor_boundary(&source.text, span.end.max(start));
        let line = source.line_starts.partition_point(|&s| s <= start).max(1);
        let line_start = source.line_starts.get(line - 1).copied().unwrap_or(0);
        let line_end = source
            .line_starts
            .get(line)
            .map_or(source.text.len(), |next| next - 1);
        let text = source.text.get(line_start..line_end).unwrap_or("");
        let text = text.strip_suffix('\r').unwrap_or(text);
        let shown_end = end.min(line_start + text.len());
        let count = |a: usize, b: usize| source.text.get(a..b).map_or(0, |s| s.chars().count());
        // A byte order mark at the very start of a file has no width.
        let mark = usize::from(text.starts_with('\u{feff}') && start > line_start);
        let column = count(line_start, start) + 1 - mark;
        let shown = text.trim_start_matches('\u{feff}');
        let skipped = column.saturating_sub(WIDEST / 2 + 1);
        let skipped = if text.len() <= WIDEST { 0 } else { skipped };
        Location {
            file: source.name.clone(),
            line,
            column,
            length: count(start, shown_end.max(start)).max(1),
            text: shown
                .chars()
                .skip(skipped)
                .take(WIDEST)
                .map(|c| if c.is_control() { ' ' } else { c })
                .collect(),
            text_column: skipped + 1,
        }
    }
}

/// Longest part of a line for display, characters.
const WIDEST: usize = 120;

/// The nearest character boundary at or below `at`.
fn floor_boundary(text: &str, at: usize) -> usize {
    let mut at = at.min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    at
}
