//! Parses YAML text to a tree of nodes with their locations.
//!
//! Protocols use plain YAML: one document, mappings with text keys, lists and scalars. Aliases, tags and merge
//! keys are rejected, so a file contains no hidden content and its size limits the work.

use serde_yaml::granit_parser::{self, Event, Parser, ScalarStyle, options};

use crate::diagnostic::Collector;
use crate::source::Span;

/// Largest accepted text, bytes.
pub const LARGEST_TEXT: usize = 4 << 20;
/// Deepest accepted nesting. Protocols need six levels.
const DEEPEST: usize = 32;
/// Most keys of one mapping; the largest of a protocol has about twenty.
const MOST_KEYS: usize = 200;

/// A value and its location.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    pub span: Span,
    pub kind: Kind,
}

/// Kind of a node.
#[derive(Debug, Clone)]
pub(crate) enum Kind {
    /// Nothing after the colon, or `null` or `~`.
    Null,
    /// A rejected construct, already reported.
    Refused,
    /// Text as written; `plain` when it was not quoted.
    Scalar { text: String, plain: bool },
    /// A list.
    List(Vec<Node>),
    /// A mapping in the order of the text; keys are unique.
    Map(Vec<Entry>),
}

/// One `key: value`.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    pub key: String,
    pub key_span: Span,
    pub value: Node,
}

impl Node {
    /// A short description of the node, for "found".
    pub(crate) fn describe(&self) -> String {
        match &self.kind {
            Kind::Null => "nothing".to_owned(),
            Kind::Refused => "an alias".to_owned(),
            Kind::Scalar { text, .. } => quote(text),
            Kind::List(items) => format!("a list of {}", items.len()),
            Kind::Map(entries) => match entries.first() {
                Some(first) => format!("a mapping with the key `{}`", first.key),
                None => "an empty mapping".to_owned(),
            },
        }
    }
}

/// The text in backticks, shortened.
pub fn quote(text: &str) -> String {
    let line: String = text
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .take(60)
        .collect();
    if text.chars().count() > 60 {
        format!("`{line}...`")
    } else {
        format!("`{line}`")
    }
}

/// The text of a file.
///
/// # Errors
/// Position and description of the first error: more than [`LARGEST_TEXT`] bytes, or not UTF-8.
pub fn decode(bytes: &[u8]) -> Result<&str, (usize, String)> {
    if bytes.len() > LARGEST_TEXT {
        return Err((0, format!("a file of {} bytes", bytes.len())));
    }
    std::str::from_utf8(bytes).map_err(|e| {
        let at = e.valid_up_to();
        let byte = bytes.get(at).copied().unwrap_or(0);
        (at, format!("the byte 0x{byte:02x}"))
    })
}

/// Parses source number `source`. `None` if the text is not YAML; the reason is in `collector`.
pub(crate) fn parse(collector: &mut Collector, source: usize) -> Option<Node> {
    let text = collector.sources.text(source).to_owned();
    let body = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let shift = text.len() - body.len();
    let options = options! {
        emit_comments: false,
        emit_unresolved_aliases: true,
        flow_nesting_limit: DEEPEST,
        block_nesting_limit: DEEPEST,
    };
    let mut reader = Reader {
        parser: Parser::new_from_str_with_options(body, options),
        text: body,
        shift,
        source,
        collector,
        path: Vec::new(),
    };
    // Also returns a tree with findings: the other errors are reported together with them.
    reader.document()
}

struct Reader<'a, 'c> {
    parser: Parser<'a, granit_parser::StrInput<'a>>,
    text: &'a str,
    shift: usize,
    source: usize,
    collector: &'c mut Collector,
    /// Keys and list positions from the root to the current node.
    path: Vec<String>,
}

impl<'a> Reader<'a, '_> {
    /// The next event, or `None` after reporting a syntax error.
    fn next(&mut self) -> Option<(Event<'a>, Span)> {
        match self.parser.next_event() {
            Some(Ok((event, at))) => {
                let start = at.start.byte_offset().unwrap_or(0).min(self.text.len());
                let end = at.end.byte_offset().unwrap_or(start);
                let end = end.clamp(start, self.text.len());
                let end = match self.text.get(start..end) {
                    Some(part) => start + part.trim_end().len(),
                    None => start,
                };
                Some((event, self.span(start, end)))
            }
            Some(Err(error)) => {
                let at = error.marker().byte_offset().unwrap_or(self.text.len());
                let at = at.min(self.text.len());
                // The scanner often stops before the offending tab.
                let at = indenting_tab(self.text, at).unwrap_or(at);
                let help = syntax_help(self.text, at);
                self.collector
                    .error(self.span(at, at), "", "not valid YAML")
                    .expected("YAML")
                    .found(error.info())
                    .maybe_help(help);
                None
            }
            None => Some((
                Event::StreamEnd,
                self.span(self.text.len(), self.text.len()),
            )),
        }
    }

    fn span(&self, start: usize, end: usize) -> Span {
        Span::new(self.source, start + self.shift, end + self.shift)
    }

    /// The key path of the current node.
    fn position(&self) -> String {
        self.path
            .iter()
            .fold(String::new(), |path, part| join(&path, part))
    }

    fn document(&mut self) -> Option<Node> {
        let mut root = None;
        loop {
            let (event, span) = self.next()?;
            match event {
                Event::StreamEnd => break,
                Event::StreamStart | Event::DocumentEnd => {}
                Event::DocumentStart(..) if root.is_some() => {
                    self.collector
                        .error(span, "", "more than one YAML document")
                        .expected("one document in the file")
                        .found("the start of another one")
                        .help("remove the line `---`, or split the file");
                    return None;
                }
                Event::DocumentStart(..) => {}
                other => root = Some(self.node(other, span)?),
            }
        }
        Some(root.unwrap_or(Node {
            span: self.span(0, 0),
            kind: Kind::Null,
        }))
    }

    /// The node that starts with `event`.
    fn node(&mut self, event: Event<'a>, span: Span) -> Option<Node> {
        if let Some(tag) = event.tag() {
            let written = tag.original();
            self.collector
                .error(span, self.position(), "tags are not used here")
                .expected("a plain value")
                .found(quote(&written))
                .help("remove the tag");
        }
        if event.anchor_id().is_some_and(|id| id != 0) {
            self.collector
                .error(span, self.position(), "anchors are not used here")
                .expected("a plain value")
                .found("an anchor")
                .help("remove the word that begins with `&`");
        }
        let node = match event {
            Event::Scalar(text, style, ..) => {
                let plain = style == ScalarStyle::Plain;
                let kind = if plain && matches!(&*text, "" | "~" | "null" | "Null" | "NULL") {
                    Kind::Null
                } else {
                    Kind::Scalar {
                        text: text.into_owned(),
                        plain,
                    }
                };
                Node { span, kind }
            }
            Event::SequenceStart(..) => {
                let mut items = Vec::new();
                let end = loop {
                    let (event, at) = self.next()?;
                    if event == Event::SequenceEnd {
                        break at;
                    }
                    self.path.push(format!("[{}]", items.len()));
                    items.push(self.node(event, at)?);
                    self.path.pop();
                };
                let last = items.last().map_or(end.end, |n: &Node| n.span.end);
                Node {
                    span: Span::new(span.source, span.start, last.max(span.end)),
                    kind: Kind::List(items),
                }
            }
            Event::MappingStart(..) => self.mapping(span)?,
            Event::Alias(_) | Event::UnresolvedAlias(_) => {
                self.collector
                    .error(span, self.position(), "aliases are not used here")
                    .expected("a value")
                    .found("an alias")
                    .help("write the value out in place of the alias");
                Node {
                    span,
                    kind: Kind::Refused,
                }
            }
            _ => Node {
                span,
                kind: Kind::Null,
            },
        };
        Some(node)
    }

    fn mapping(&mut self, span: Span) -> Option<Node> {
        let mut entries: Vec<Entry> = Vec::new();
        loop {
            let (event, at) = self.next()?;
            if event == Event::MappingEnd {
                break;
            }
            let key = self.node(event, at)?;
            let (event, at) = self.next()?;
            let text = match &key.kind {
                Kind::Scalar { text, .. } => text.clone(),
                _ => {
                    self.collector
                        .error(key.span, self.position(), "a key must be a word")
                        .expected("a word before the colon")
                        .found(key.describe());
                    self.node(event, at)?;
                    continue;
                }
            };
            self.path.push(text.clone());
            let value = self.node(event, at)?;
            let path = self.position();
            self.path.pop();
            if entries.len() >= MOST_KEYS {
                self.collector
                    .error(key.span, path, "too many keys")
                    .expected(format!("at most {MOST_KEYS} keys in one mapping"))
                    .found("more");
                return None;
            }
            if let Some(first) = entries.iter().find(|e| e.key == text) {
                let line = self.collector.sources.locate(first.key_span).line;
                self.collector
                    .error(key.span, path, "the key is given twice")
                    .expected("each key once")
                    .found(format!("{} here and in line {line}", quote(&text)))
                    .help("remove one of the two");
                continue;
            }
            entries.push(Entry {
                key: text,
                key_span: key.span,
                value,
            });
        }
        let end = entries.last().map_or(span.end, |e| e.value.span.end);
        Some(Node {
            span: Span::new(span.source, span.start, end.max(span.end)),
            kind: Kind::Map(entries),
        })
    }
}

/// The first tab that indents the line of `at` or the next one.
fn indenting_tab(text: &str, at: usize) -> Option<usize> {
    let mut start = text.get(..at)?.rfind('\n').map_or(0, |i| i + 1);
    for line in text.get(start..)?.split_inclusive('\n').take(2) {
        let indent = line.len() - line.trim_start_matches([' ', '\t']).len();
        if let Some(tab) = line[..indent].find('\t') {
            return Some(start + tab);
        }
        start += line.len();
    }
    None
}

/// Help for a syntax error near byte `at`, if its cause is recognised.
fn syntax_help(text: &str, at: usize) -> Option<String> {
    let start = text.get(..at)?.rfind('\n').map_or(0, |i| i + 1);
    let line = text.get(start..)?.lines().next().unwrap_or("");
    if line.trim_start_matches(' ').starts_with('\t') {
        return Some("indent with spaces: YAML does not allow tabs there".to_owned());
    }
    let word = line.trim().split(':').next().unwrap_or("");
    let open = line.matches('[').count() > line.matches(']').count()
        || line.matches('{').count() > line.matches('}').count();
    if open {
        return Some("close the bracket that is opened in this line".to_owned());
    }
    (!word.is_empty()).then(|| {
        "align the keys of a mapping in the same column; texts that contain `: ` or ` #` need quotes"
            .to_owned()
    })
}

/// The key path `path` with one more part: a key, or a list place such as `[2]`.
pub(crate) fn join(path: &str, part: &str) -> String {
    if path.is_empty() || part.starts_with('[') {
        format!("{path}{part}")
    } else {
        format!("{path}.{part}")
    }
}
