//! Wrapping at spaces, with a hanging indent.

use textwrap::{Options, WordSeparator, WordSplitter};

use crate::width;

/// Columns per line of reports.
pub const WIDTH: usize = 80;
/// Columns that stay for the text beside a wide label.
const MIN_ROOM: usize = 20;

/// Treatment of words longer than a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LongWords {
    /// Every line fits.
    Cut,
    /// Paths and commands can be copied; their lines are too long.
    Keep,
}

/// Lines of `text`, at most `most` columns each. Runs of white space count as one space.
#[must_use]
pub fn wrap(text: &str, most: usize, long_words: LongWords) -> Vec<String> {
    let options = Options::new(most)
        .break_words(long_words == LongWords::Cut)
        .word_separator(WordSeparator::AsciiSpace)
        .word_splitter(WordSplitter::NoHyphenation);
    let words: Vec<&str> = text.split_whitespace().collect();
    let text = words.join(" ");
    let lines = textwrap::wrap(&text, options);
    lines.into_iter().map(|line| line.into_owned()).collect()
}

/// `text` wrapped at [`WIDTH`]: the first line begins with `first`, the others are indented as far. Each ends with a line
/// break.
#[must_use]
pub fn hang(first: &str, text: &str, long_words: LongWords) -> String {
    let margin = width(first);
    let most = WIDTH.saturating_sub(margin).max(MIN_ROOM);
    let mut out = first.to_owned();
    for (i, line) in wrap(text, most, long_words).iter().enumerate() {
        if i > 0 {
            out += &" ".repeat(margin);
        }
        out += line;
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_hang_below_the_first_word() {
        let text = format!("{} end", "word ".repeat(20));
        let wrapped = hang("label     ", &text, LongWords::Cut);
        let expected = format!(
            "label     {}\n          {} end\n",
            ["word"; 14].join(" "),
            ["word"; 6].join(" ")
        );
        assert_eq!(wrapped, expected);
        assert_eq!(hang("a  ", "", LongWords::Cut), "a  \n");
    }

    #[test]
    fn long_words_are_cut_or_kept() {
        assert_eq!(
            wrap("a bcdef g", 3, LongWords::Cut),
            ["a", "bcd", "ef", "g"]
        );
        assert_eq!(wrap("a bcdef g", 3, LongWords::Keep), ["a", "bcdef", "g"]);
        assert_eq!(wrap("a-b c--d", 4, LongWords::Keep), ["a-b", "c--d"]);
    }

    #[test]
    fn wide_and_combining_characters_take_their_columns() {
        let wide = "皮膚 ".repeat(30);
        for line in wrap(&wide, 10, LongWords::Cut) {
            assert_eq!(line, "皮膚 皮膚");
        }
        let accents = "e\u{301}te\u{301} ".repeat(30);
        for line in wrap(&accents, 7, LongWords::Cut) {
            assert_eq!(line, "e\u{301}te\u{301} e\u{301}te\u{301}");
        }
        for line in hang("皮 ", &"膚".repeat(99), LongWords::Cut).lines() {
            assert!(width(line) <= WIDTH, "{line}");
        }
    }
}
