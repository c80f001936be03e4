//! `--set key.path=value`: changes one value of the node tree before it is read.

use crate::diagnostic::{Collector, did_you_mean, one_of};
use crate::shape::{Shape, Table};
use crate::source::Span;
use crate::yaml::{self, Entry, Kind, Node, join};

/// Applies the overrides in order. Findings point into the text of the override.
pub(crate) fn apply(
    root: &mut Node,
    table: &'static Table,
    overrides: &[String],
    out: &mut Collector,
) {
    for text in overrides {
        let source = out.sources.add("--set", text.as_str());
        apply_one(root, table, text, source, out);
    }
}

fn apply_one(
    root: &mut Node,
    table: &'static Table,
    text: &str,
    source: usize,
    out: &mut Collector,
) -> Option<()> {
    let Some((path, value)) = text.split_once('=') else {
        out.error(Span::new(source, 0, text.len()), "", "the value is missing")
            .expected("`key.path=value`, for example `path.meander.pitch=6mm`")
            .found(yaml::quote(text));
        return None;
    };
    let mut keys = Vec::new();
    let mut at = 0;
    for part in path.split('.') {
        keys.push((part, Span::new(source, at, at + part.len())));
        at += part.len() + 1;
    }
    let shape = find(table, &keys, out)?;
    let start = path.len() + 1;
    let whole = Span::new(source, start, text.len());
    let value = if matches!(shape, Shape::Text) {
        Node {
            span: whole,
            kind: Kind::Scalar {
                text: value.to_owned(),
                plain: true,
            },
        }
    } else {
        // The value is parsed as YAML, at its position in the argument.
        let padded = format!("{}{value}", " ".repeat(start));
        let part = out.sources.add("--set", padded);
        let node = yaml::parse(out, part);
        out.move_findings(part, source);
        let mut node = node?;
        change_source(&mut node, part, source);
        node
    };
    let mut node = root;
    for (key, span) in &keys {
        if !matches!(node.kind, Kind::Map(_)) {
            node.kind = Kind::Map(Vec::new());
            node.span = *span;
        }
        let Kind::Map(entries) = &mut node.kind else {
            return None;
        };
        let place = entries
            .iter()
            .position(|e| e.key == *key)
            .unwrap_or_else(|| {
                entries.push(Entry {
                    key: (*key).to_owned(),
                    key_span: *span,
                    value: Node {
                        span: *span,
                        kind: Kind::Null,
                    },
                });
                entries.len() - 1
            });
        node = &mut entries.get_mut(place)?.value;
    }
    *node = value;
    Some(())
}

/// Moves the spans of a tree from source `from` to the same bytes of source `to`.
fn change_source(node: &mut Node, from: usize, to: usize) {
    let fix = |span: &mut Span| {
        if span.source == from {
            span.source = to;
        }
    };
    fix(&mut node.span);
    match &mut node.kind {
        Kind::List(items) => items.iter_mut().for_each(|n| change_source(n, from, to)),
        Kind::Map(entries) => {
            for e in entries {
                fix(&mut e.key_span);
                change_source(&mut e.value, from, to);
            }
        }
        Kind::Null | Kind::Refused | Kind::Scalar { .. } => {}
    }
}

/// The shape of the key at the path `keys`.
fn find(
    table: &'static Table,
    keys: &[(&str, Span)],
    out: &mut Collector,
) -> Option<&'static Shape> {
    let (&(name, span), rest) = keys.split_first()?;
    let mut table = table;
    let mut path = String::new();
    let (mut name, mut span, mut rest) = (name, span, rest);
    loop {
        path = join(&path, name);
        let Some(key) = table.keys.iter().find(|k| k.name == name) else {
            let names = || table.keys.iter().map(|k| k.name);
            out.error(span, path, "unknown key")
                .expected(one_of(names()))
                .found(yaml::quote(name))
                .maybe_help(did_you_mean(name, names()));
            return None;
        };
        let Some((&(next, next_span), further)) = rest.split_first() else {
            return Some(&key.shape);
        };
        match &key.shape {
            Shape::Map(inner) | Shape::WordOr(_, inner) => table = inner,
            Shape::Named(of) if further.is_empty() => return Some(of),
            _ => {
                out.error(next_span, join(&path, next), "the key has no keys below it")
                    .expected(format!("`{path}` as the last part of the key path"))
                    .found(yaml::quote(next))
                    .help(format!(
                        "replace the value as a whole: `--set '{path}=...'`"
                    ));
                return None;
            }
        }
        (name, span, rest) = (next, next_span, further);
    }
}
