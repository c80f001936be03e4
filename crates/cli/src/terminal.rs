//! Writes lines to standard output and standard error, whose readers may disconnect.
//!
//! `println!` panics on a closed pipe. Here a closed pipe (`skinrig show ... | head`) is not an error, and no failure of the
//! terminal stops a run. Any other error of standard output, for example a full disk, is recorded, so that the program can
//! exit with an error.

use std::borrow::Cow;
use std::fmt::Arguments;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};

use skinrig_model::text::{is_hidden, visible};
use skinrig_text::starts_with_style;

/// How a command presents its result.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Output {
    /// As JSON, for programs.
    pub json: bool,
    /// With all figures.
    pub verbose: bool,
}

static OUTPUT_FAILED: AtomicBool = AtomicBool::new(false);

/// Escapes everything in `text` that a terminal would interpret, except the colours of this program.
fn harmless(text: &str) -> Cow<'_, str> {
    if !text.contains(is_hidden) {
        return Cow::Borrowed(text);
    }
    let mut parts = text.split('\u{1b}');
    let mut out = visible(parts.next().unwrap_or_default()).into_owned();
    for part in parts {
        // Our own styles cannot hide, move or erase anything.
        out.push_str(if starts_with_style(part) {
            "\u{1b}"
        } else {
            "\\u{1b}"
        });
        out.push_str(&visible(part));
    }
    Cow::Owned(out)
}

/// True if `stream` is a terminal or colour is forced (`CLICOLOR_FORCE`, <https://bixense.com/clicolors>), and colour is not
/// disabled (`NO_COLOR`, <https://no-color.org>).
pub(crate) fn is_coloured(stream: &impl IsTerminal) -> bool {
    let value = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty());
    let is_forced = value("CLICOLOR_FORCE").is_some_and(|v| v != "0");
    (stream.is_terminal() || is_forced) && value("NO_COLOR").is_none()
}

/// Writes to standard output.
pub(crate) fn out(text: Arguments<'_>) {
    let mut out = std::io::stdout().lock();
    let text = text.to_string();
    if let Err(e) = out
        .write_all(harmless(&text).as_bytes())
        .and_then(|()| out.flush())
        && e.kind() != ErrorKind::BrokenPipe
    {
        OUTPUT_FAILED.store(true, Ordering::Relaxed);
    }
}

/// Moves the cursor to the upper left corner of the terminal and clears the screen.
pub(crate) fn clear_screen() {
    let mut out = std::io::stdout().lock();
    // What follows reports the errors of the terminal.
    let _ = out.write_all(b"\x1b[H\x1b[J");
}

/// Writes to standard error; its errors cannot be reported anywhere.
pub(crate) fn err(text: Arguments<'_>) {
    let text = text.to_string();
    let _ = std::io::stderr()
        .lock()
        .write_all(harmless(&text).as_bytes());
}

/// True if writing to standard output failed for another reason than a closed pipe.
pub(crate) fn output_failed() -> bool {
    OUTPUT_FAILED.load(Ordering::Relaxed)
}

/// A line on standard output.
macro_rules! outln {
    ($($text:tt)*) => {
        $crate::terminal::out(format_args!("{}\n", format_args!($($text)*)))
    };
}

/// A line on standard error.
macro_rules! errln {
    ($($text:tt)*) => {
        $crate::terminal::err(format_args!("{}\n", format_args!($($text)*)))
    };
}

/// Prints a JSON value and a line break.
pub(crate) fn print_json(value: &serde_json::Value) {
    // Pretty printing of a `Value` cannot fail.
    let text = serde_json::to_string_pretty(value).unwrap_or_default();
    out(format_args!("{text}\n"));
}

#[cfg(test)]
mod tests {
    use super::harmless;

    #[test]
    fn a_terminal_interprets_only_our_colours() {
        assert_eq!(
            harmless("\u{1b}[33mwarning\u{1b}[0m: x"),
            "\u{1b}[33mwarning\u{1b}[0m: x"
        );
        for (hostile, shown) in [
            ("a\u{1b}[2Jb", "a\\u{1b}[2Jb"),
            ("\u{1b}[8mhidden\u{1b}[0m", "\\u{1b}[8mhidden\u{1b}[0m"),
            ("\u{1b}]0;title\u{7}", "\\u{1b}]0;title\\u{7}"),
            ("\u{202e}gpj", "\\u{202e}gpj"),
            ("over\rwrite", "over\\u{d}write"),
            ("\u{9b}2J", "\\u{9b}2J"),
        ] {
            assert_eq!(harmless(hostile), shown);
        }
    }
}
