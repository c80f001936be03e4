//! Styles: names for the colours that skinrig writes, and their ANSI escape sequences.

use anstyle::{AnsiColor, Effects};

/// Meaning of a piece of text, shown by its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Headings and chosen rows.
    Bold,
    /// Less important than its surroundings.
    Dim,
    /// Passed.
    Good,
    /// A fix.
    Help,
    /// To be read before the numbers.
    Warning,
    /// Failed.
    Error,
    /// Neither passed nor failed.
    Undecided,
    /// Numbers that must not be used.
    Invalid,
    /// Lines and margins around a quoted text.
    Frame,
}

impl Style {
    const ALL: [Self; 9] = [
        Self::Bold,
        Self::Dim,
        Self::Good,
        Self::Help,
        Self::Warning,
        Self::Error,
        Self::Undecided,
        Self::Invalid,
        Self::Frame,
    ];

    fn ansi(self) -> anstyle::Style {
        let bold = Effects::BOLD;
        match self {
            Self::Bold => bold.into(),
            Self::Dim => Effects::DIMMED.into(),
            Self::Good => AnsiColor::Green.on_default(),
            Self::Help => AnsiColor::Green.on_default() | bold,
            Self::Warning => AnsiColor::Yellow.on_default(),
            Self::Error => AnsiColor::Red.on_default() | bold,
            Self::Undecided => AnsiColor::Cyan.on_default(),
            Self::Invalid => AnsiColor::Magenta.on_default() | bold,
            Self::Frame => AnsiColor::Blue.on_default(),
        }
    }
}

/// Writes styles, or leaves text as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Paint {
    is_coloured: bool,
}

impl Paint {
    /// With or without escape sequences.
    #[must_use]
    pub const fn new(is_coloured: bool) -> Self {
        Self { is_coloured }
    }

    /// `text` in a style. An empty text stays empty.
    #[must_use]
    pub fn apply(self, style: Style, text: &str) -> String {
        if self.is_coloured && !text.is_empty() {
            let style = style.ansi();
            format!("{style}{text}{style:#}")
        } else {
            text.to_owned()
        }
    }

    /// `text` in [`Style::Bold`].
    #[must_use]
    pub fn bold(self, text: &str) -> String {
        self.apply(Style::Bold, text)
    }

    /// `text` as a [`Style::Warning`].
    #[must_use]
    pub fn warn(self, text: &str) -> String {
        self.apply(Style::Warning, text)
    }
}

/// True if an escape character followed by `text` starts with a sequence that [`Paint`] writes.
#[must_use]
pub fn starts_with_style(text: &str) -> bool {
    Style::ALL.into_iter().any(|style| {
        let painted = Paint::new(true).apply(style, "\n");
        let mut sequences = painted.split('\u{1b}').skip(1);
        sequences.any(|s| text.starts_with(s.trim_end_matches('\n')))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn styles_are_escape_sequences_and_end() {
        let paint = Paint::new(true);
        assert_eq!(paint.bold("x"), "\u{1b}[1mx\u{1b}[0m");
        assert_eq!(paint.warn("x"), "\u{1b}[33mx\u{1b}[0m");
        assert_eq!(
            paint.apply(Style::Error, "x"),
            "\u{1b}[1m\u{1b}[31mx\u{1b}[0m"
        );
        assert_eq!(paint.warn(""), "");
        assert_eq!(Paint::new(false).apply(Style::Error, "x"), "x");
    }

    #[test]
    fn only_our_sequences_are_styles() {
        for ours in ["[0m", "[1mx", "[2m", "[31m", "[32m", "[34m", "[35m", "[36m"] {
            assert!(starts_with_style(ours), "{ours}");
        }
        for other in ["", "[", "[8m", "[2J", "[1;31m", "]0;title", "x[0m"] {
            assert!(!starts_with_style(other), "{other}");
        }
    }
}
