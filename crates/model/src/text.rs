//! Sanitises untrusted text for display: terminals, pages, figures, JUnit.

use std::borrow::Cow;

/// A text that is not the name of any variant of an enum.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownName {
    /// Description of the valid names.
    pub expected: &'static str,
    /// The text.
    pub found: String,
}

impl std::fmt::Display for UnknownName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "expected {}, found `{}`", self.expected, self.found)
    }
}

impl std::error::Error for UnknownName {}

/// True for characters with an effect instead of a glyph: controls (C0, DEL, C1), the bidirectional formatting characters
/// and the line separators of Unicode. A line feed and a tab are not among them.
#[must_use]
pub const fn is_hidden(c: char) -> bool {
    match c {
        '\n' | '\t' => false,
        '\0'..='\u{1f}' | '\u{7f}'..='\u{9f}' => true,
        // Unicode Standard Annex 9: marks, embeddings, overrides and isolates.
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => {
            true
        }
        '\u{2028}' | '\u{2029}' => true,
        _ => false,
    }
}

/// `text` with every [hidden](is_hidden) character written out, for example `\u{1b}`.
#[must_use]
pub fn visible(text: &str) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_hidden(c) {
            out.extend(c.escape_unicode());
        } else {
            out.push(c);
        }
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_written_out() {
        assert_eq!(visible("plain: é 日本 µm\n\tx"), "plain: é 日本 µm\n\tx");
        assert_eq!(visible("a\u{1b}[2Jb"), "a\\u{1b}[2Jb");
        assert_eq!(visible("\u{202e}gpj.exe"), "\\u{202e}gpj.exe");
        assert_eq!(
            visible("a\u{2028}b\u{9b}1m\r"),
            "a\\u{2028}b\\u{9b}1m\\u{d}"
        );
        let all = (0..=0x0010_ffff).filter_map(char::from_u32);
        let acts = |c: &char| {
            c.is_control() && !"\n\t".contains(*c)
                || ('\u{202a}'..='\u{202e}').contains(c)
                || ('\u{2066}'..='\u{2069}').contains(c)
        };
        assert!(all.filter(acts).all(is_hidden));
    }
}
