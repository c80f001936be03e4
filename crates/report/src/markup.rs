//! Writes markup, HTML and SVG: elements with escaped attributes and text.

use std::fmt::{self, Display, Write};

use skinrig_model::text::visible;

/// Writes text with the five XML specials escaped, control characters spelled out, and non-characters replaced.
struct Escaping<'a>(&'a mut String);

impl Write for Escaping<'_> {
    fn write_str(&mut self, s: &str) -> fmt::Result {
        for c in visible(s).chars() {
            match c {
                '&' => self.0.push_str("&amp;"),
                '<' => self.0.push_str("&lt;"),
                '>' => self.0.push_str("&gt;"),
                '"' => self.0.push_str("&quot;"),
                '\'' => self.0.push_str("&#39;"),
                '\n' | '\t' => self.0.push(c),
                '\u{fffe}' | '\u{ffff}' => {
                    self.0.push(char::REPLACEMENT_CHARACTER);
                }
                c => self.0.push(c),
            }
        }
        Ok(())
    }
}

/// Attributes: name and value. Values are escaped.
pub(crate) type Attributes<'a> = &'a [(&'a str, &'a dyn Display)];

/// A page, a drawing or a part of one under construction.
#[derive(Debug, Default)]
pub(crate) struct Markup {
    out: String,
    open: Vec<&'static str>,
}

impl Markup {
    /// An empty document.
    #[must_use]
    pub(crate) fn new() -> Self {
        Self::default()
    }

    fn start(&mut self, tag: &str, attributes: Attributes<'_>) {
        self.out.push('<');
        self.out.push_str(tag);
        for (name, value) in attributes {
            self.out.push(' ');
            self.out.push_str(name);
            self.out.push_str("=\"");
            // Writing to a String cannot fail.
            let _ = write!(Escaping(&mut self.out), "{value}");
            self.out.push('"');
        }
    }

    /// Opens an element.
    pub(crate) fn open(&mut self, tag: &'static str, attributes: Attributes<'_>) -> &mut Self {
        self.start(tag, attributes);
        self.out.push('>');
        self.open.push(tag);
        self
    }

    /// Closes the innermost open element, if any.
    pub(crate) fn close(&mut self) -> &mut Self {
        if let Some(tag) = self.open.pop() {
            let _ = write!(self.out, "</{tag}>");
        }
        self
    }

    /// An element without content.
    pub(crate) fn leaf(&mut self, tag: &str, attributes: Attributes<'_>) -> &mut Self {
        self.start(tag, attributes);
        self.out.push_str("/>");
        self
    }

    /// An element that contains only text.
    pub(crate) fn holding(
        &mut self,
        tag: &str,
        attributes: Attributes<'_>,
        text: &str,
    ) -> &mut Self {
        self.start(tag, attributes);
        self.out.push('>');
        let _ = Escaping(&mut self.out).write_str(text);
        let _ = write!(self.out, "</{tag}>");
        self
    }

    /// Trusted markup, style or script, as it is.
    pub(crate) fn raw(&mut self, markup: &str) -> &mut Self {
        self.out.push_str(markup);
        self
    }

    /// Text between elements.
    pub(crate) fn words(&mut self, text: &str) -> &mut Self {
        let _ = Escaping(&mut self.out).write_str(text);
        self
    }

    /// Closes all open elements and returns the text.
    #[must_use]
    pub(crate) fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.close();
        }
        self.out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn specials_are_escaped_in_attributes_and_text() {
        let mut svg = Markup::new();
        svg.open("g", &[("data-x", &"\"><script>&'")]);
        svg.text((1.0, f64::NAN), "a", "start", "</text><img onerror=x>\u{0}");
        assert_eq!(
            svg.finish(),
            "<g data-x=\"&quot;&gt;&lt;script&gt;&amp;&#39;\"><text x=\"1\" y=\"0\" class=\"a\" \
             text-anchor=\"start\">&lt;/text&gt;&lt;img onerror=x&gt;\\u{0}</text></g>"
        );
    }
}
