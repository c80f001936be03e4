//! Formats text for terminals.

use skinrig_model::text::visible;
use skinrig_text::{LongWords, hang};

/// User text on one line, with control characters spelled out.
pub(crate) fn plain(text: &str) -> String {
    visible(&text.replace(['\n', '\t'], " ")).into_owned()
}

/// `text` with a hanging indent behind `first`; every line fits a terminal.
pub(crate) fn wrap(first: &str, text: &str) -> String {
    hang(first, text, LongWords::Cut)
}
