//! Formats text for terminals.

use std::fmt::Write as _;

use skinrig_model::text::visible;

/// Columns per line.
pub(crate) const WIDTH: usize = 80;

/// User text on one line, with control characters spelled out.
pub(crate) fn plain(text: &str) -> String {
    visible(&text.replace(['\n', '\t'], " ")).into_owned()
}

pub(crate) struct Paint(pub(crate) bool);

impl Paint {
    pub(crate) fn bold(&self, s: &str) -> String {
        if self.0 {
            format!("\x1b[1m{s}\x1b[0m")
        } else {
            s.to_owned()
        }
    }
    pub(crate) fn warn(&self, s: &str) -> String {
        if self.0 && !s.is_empty() {
            format!("\x1b[33m{s}\x1b[0m")
        } else {
            s.to_owned()
        }
    }
}

/// Wraps `text` at `WIDTH` columns; the first line begins with `first`, the others are indented as far. Cuts words longer
/// than a line.
pub(crate) fn wrap(first: &str, text: &str) -> String {
    let indent = " ".repeat(first.chars().count());
    let room = WIDTH - indent.len();
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let mut rest: Vec<char> = word.chars().collect();
        while !rest.is_empty() {
            let used = lines.last().map_or(0, |l| l.chars().count());
            let needed = rest.len() + usize::from(used > 0);
            if used > 0 && used + needed > room {
                lines.push(String::new());
                continue;
            }
            let piece: String = rest.drain(..rest.len().min(room)).collect();
            if let Some(line) = lines.last_mut() {
                if used > 0 {
                    line.push(' ');
                }
                line.push_str(&piece);
            }
        }
    }
    let mut out = String::new();
    for (i, line) in lines.iter().enumerate() {
        let _ = writeln!(out, "{}{line}", if i == 0 { first } else { &indent });
    }
    out
}
