//! Text for terminals: styles, wrapping, tables, sparklines. Widths are terminal columns: 2 for a wide character, 0 for a combining one.

mod spark;
mod style;
mod table;
mod wrap;

pub use spark::{Blocks, sparkline};
pub use style::{Paint, Style, starts_with_style};
pub use table::{Column, Table};
pub use wrap::{LongWords, WIDTH, hang, wrap};

/// Display width of `text` in columns; colour escapes count 0.
#[must_use]
pub fn width(text: &str) -> usize {
    textwrap::core::display_width(text)
}

/// Largest display width among `texts`; 0 if there are none.
#[must_use]
pub fn widest<'a>(texts: impl IntoIterator<Item = &'a str>) -> usize {
    texts.into_iter().map(width).max().unwrap_or(0)
}

/// Shortens `text` to at most `most` columns; a shortened text ends with `…`.
#[must_use]
pub fn clip(text: &str, most: usize) -> String {
    if width(text) <= most {
        text.to_owned()
    } else {
        elide(text, most)
    }
}

/// Beginning of `text` followed by `…`, at most `most` columns.
#[must_use]
pub fn elide(text: &str, most: usize) -> String {
    format!("{}…", cut(text, most.saturating_sub(1)).trim_end())
}

/// Beginning of `text`, at most `most` columns.
#[must_use]
pub fn cut(text: &str, most: usize) -> &str {
    let ends = text.char_indices().map(|(at, c)| at + c.len_utf8());
    let end = ends.take_while(|end| width(&text[..*end]) <= most).last();
    &text[..end.unwrap_or(0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipped_texts_fit_their_columns() {
        for (text, most, expected) in [
            ("skin-A", 6, "skin-A"),
            ("skin-A", 5, "skin…"),
            ("skin A", 6, "skin A"),
            ("skin AB", 6, "skin…"),
            ("皮膚一号", 8, "皮膚一号"),
            ("皮膚一号", 7, "皮膚一…"),
            ("皮膚一号", 6, "皮膚…"),
            ("peau e\u{301}lastique", 8, "peau e\u{301}l…"),
            ("e\u{301}", 1, "e\u{301}"),
        ] {
            let clipped = clip(text, most);
            assert_eq!(clipped, expected);
            assert!(width(&clipped) <= most, "{clipped}");
        }
        assert_eq!(elide("skin A ", 80), "skin A…");
        assert_eq!(cut("皮膚一号", 5), "皮膚");
        assert_eq!(widest(["ab", "皮膚", "e\u{301}"]), 4);
    }
}
