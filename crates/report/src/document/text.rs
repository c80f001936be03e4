//! Owns [`Text`]: the words of a paragraph or a cell, with emphasis, links and small drawings.

use std::fmt::Display;

use crate::markup::Markup;

/// Words of one paragraph or cell. A terminal shows the words alone.
#[derive(Debug, Clone, Default)]
pub(crate) struct Text(Vec<Piece>);

type Attributes = Vec<(&'static str, String)>;

#[derive(Debug, Clone)]
enum Piece {
    Words(String),
    Element(&'static str, Attributes, Text),
    /// Trusted markup.
    Drawing(String),
}

impl Text {
    pub(crate) fn new() -> Self {
        Self::default()
    }

    pub(crate) fn add(mut self, words: impl Into<String>) -> Self {
        self.0.push(Piece::Words(words.into()));
        self
    }

    fn element(mut self, tag: &'static str, attributes: Attributes, inner: Self) -> Self {
        self.0.push(Piece::Element(tag, attributes, inner));
        self
    }

    pub(crate) fn bold(self, inner: impl Into<Self>) -> Self {
        self.element("b", vec![], inner.into())
    }

    pub(crate) fn code(self, words: impl Into<Self>) -> Self {
        self.element("code", vec![], words.into())
    }

    /// Words in a CSS class.
    pub(crate) fn span(self, class: impl Into<String>, inner: impl Into<Self>) -> Self {
        self.element("span", vec![("class", class.into())], inner.into())
    }

    /// Words in a CSS class, with a test ID.
    pub(crate) fn named(self, id: &str, class: &str, inner: impl Into<Self>) -> Self {
        let attributes = vec![("class", class.to_owned()), ("data-testid", id.to_owned())];
        self.element("span", attributes, inner.into())
    }

    /// A heading of the third level, for a summary.
    pub(crate) fn heading(self, words: &str) -> Self {
        self.element("h3", vec![], words.into())
    }

    /// Words whose full form appears when pointed at.
    pub(crate) fn titled(self, title: &str, inner: impl Into<Self>) -> Self {
        self.element("span", vec![("title", title.to_owned())], inner.into())
    }

    /// A digest: its beginning on screen, all of it when pointed at and in print.
    pub(crate) fn digest(self, value: &str) -> Self {
        let hidden = vec![("aria-hidden", "true".to_owned())];
        let start = format!("{}…", value.get(..12).unwrap_or(value));
        let inner = Self::new().element("span", hidden, start.into());
        let attributes = vec![("class", "digest".to_owned()), ("title", value.to_owned())];
        self.element("code", attributes, inner.span("whole", value))
    }

    pub(crate) fn link(self, to: impl Into<String>, words: &str) -> Self {
        self.element("a", vec![("href", to.into())], words.into())
    }

    /// A link with a test ID.
    pub(crate) fn named_link(self, id: &str, to: impl Into<String>, words: &str) -> Self {
        let attributes = vec![("href", to.into()), ("data-testid", id.to_owned())];
        self.element("a", attributes, words.into())
    }

    /// A dot between two remarks.
    pub(crate) fn dot(self) -> Self {
        let hidden = vec![("aria-hidden", "true".to_owned())];
        self.add(" ").element("span", hidden, "·".into()).add(" ")
    }

    pub(crate) fn line_break(mut self) -> Self {
        self.0.push(Piece::Drawing("<br>".to_owned()));
        self
    }

    /// A coloured square, explained by the words that follow.
    pub(crate) fn key(self, class: &str) -> Self {
        let class = format!("key {class}");
        let attributes = vec![("class", class), ("aria-hidden", "true".to_owned())];
        self.element("i", attributes, Self::new())
    }

    /// Trusted markup; a terminal leaves it out.
    pub(crate) fn drawing(mut self, markup: impl Into<String>) -> Self {
        self.0.push(Piece::Drawing(markup.into()));
        self
    }

    pub(crate) fn then(mut self, other: Self) -> Self {
        self.0.extend(other.0);
        self
    }

    /// The words alone.
    pub(crate) fn words(&self) -> String {
        let word = |piece: &Piece| match piece {
            Piece::Words(words) => words.clone(),
            Piece::Element(_, _, inner) => inner.words(),
            Piece::Drawing(_) => String::new(),
        };
        self.0.iter().map(word).collect()
    }

    pub(super) fn write(&self, out: &mut Markup) {
        for piece in &self.0 {
            match piece {
                Piece::Words(words) => {
                    out.words(words);
                }
                Piece::Element(tag, attributes, inner) => {
                    open(out, tag, attributes);
                    inner.write(out);
                    out.close();
                }
                Piece::Drawing(markup) => {
                    out.raw(markup);
                }
            }
        }
    }
}

impl From<&str> for Text {
    fn from(words: &str) -> Self {
        Self::new().add(words)
    }
}

impl From<String> for Text {
    fn from(words: String) -> Self {
        Self::new().add(words)
    }
}

/// Opens an element without those attributes that are empty.
pub(super) fn open<V: AsRef<str> + Display>(
    out: &mut Markup,
    tag: &'static str,
    attributes: &[(&str, V)],
) {
    let present = attributes
        .iter()
        .filter(|(_, value)| !value.as_ref().is_empty());
    let present: Vec<_> = present
        .map(|(name, value)| (*name, value as &dyn Display))
        .collect();
    out.open(tag, &present);
}
