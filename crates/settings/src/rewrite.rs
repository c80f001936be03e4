//! Writes a file again with its overrides applied: the same values, without comments.

use std::fmt::Write as _;

use crate::diagnostic::{Collector, Diagnostics};
use crate::shape::Table;
use crate::source::Sources;
use crate::yaml::{self, Kind, Node};

/// Text of the file with the overrides (`key.path=value`) applied.
///
/// # Errors
/// [`Diagnostics`] for text that is not YAML, and for overrides of unknown keys. Values are not tested.
pub fn rewrite(
    name: &str,
    text: &str,
    overrides: &[String],
    table: &'static Table,
) -> Result<String, Diagnostics> {
    let mut sources = Sources::default();
    let source = sources.add(name, text);
    let mut out = Collector::new(sources);
    let Some(mut root) = yaml::parse(&mut out, source) else {
        return Err(out.finish());
    };
    crate::overrides::apply(&mut root, table, overrides, &mut out);
    if !out.is_clean() {
        return Err(out.finish());
    }
    let mut text = String::new();
    block(&root, 0, &mut text);
    Ok(text)
}

/// A mapping with one line per key; anything else on one line.
fn block(node: &Node, depth: usize, out: &mut String) {
    let Kind::Map(entries) = &node.kind else {
        flow(node, out);
        out.push('\n');
        return;
    };
    for entry in entries {
        let _ = write!(out, "{:1$}", "", 2 * depth);
        scalar(&entry.key, true, out);
        out.push(':');
        match &entry.value.kind {
            Kind::Map(inner) if !inner.is_empty() => {
                out.push('\n');
                block(&entry.value, depth + 1, out);
            }
            _ => {
                out.push(' ');
                flow(&entry.value, out);
                out.push('\n');
            }
        }
    }
}

fn flow(node: &Node, out: &mut String) {
    match &node.kind {
        Kind::Null | Kind::Refused => out.push_str("null"),
        Kind::Scalar { text, plain } => scalar(text, *plain, out),
        Kind::List(items) => {
            out.push('[');
            for (i, item) in items.iter().enumerate() {
                out.push_str(if i > 0 { ", " } else { "" });
                flow(item, out);
            }
            out.push(']');
        }
        Kind::Map(entries) => {
            out.push('{');
            for (i, entry) in entries.iter().enumerate() {
                out.push_str(if i > 0 { ", " } else { "" });
                scalar(&entry.key, true, out);
                out.push_str(": ");
                flow(&entry.value, out);
            }
            out.push('}');
        }
    }
}

/// Quoted unless it was not and means the same without quotes everywhere.
fn scalar(text: &str, plain: bool, out: &mut String) {
    let is_usual = |c: char| c.is_alphanumeric() || " ._/%+-".contains(c);
    let starts = |c: char| c.is_alphanumeric() || "._+".contains(c);
    let is_number = |c: char| c.is_ascii_digit() || c == '.';
    let mut chars = text.chars();
    let first = chars.next();
    let begins =
        first.is_some_and(starts) || first == Some('-') && chars.next().is_some_and(is_number);
    if plain && begins && text.chars().all(is_usual) && !text.ends_with(' ') {
        out.push_str(text);
        return;
    }
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if (c as u32) < 0x20
                || matches!(
                    c,
                    '\u{7f}'..='\u{9f}' | '\u{2028}' | '\u{2029}' | '\u{feff}'
                ) =>
            {
                let _ = write!(out, "\\u{:04x}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
}
