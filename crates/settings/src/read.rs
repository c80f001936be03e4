//! Reads a node tree by its table: reports every structural error, and returns the readable values.

use crate::diagnostic::{Collector, closest, did_you_mean, one_of};
use crate::field::{Field, Value};
use crate::scalar::{choice, measured, number, numbers, whole};
use crate::shape::{Key, Need, Shape, Table};
use crate::source::{Sources, Span};
use crate::wording::{entry_example, expectation, key_names};
use crate::yaml::{Entry, Kind, Node, join, quote};

/// Reads `node` as a mapping of `table`. Unreadable entries are absent from the result.
pub(crate) fn read_table(
    node: &Node,
    table: &'static Table,
    path: &str,
    out: &mut Collector,
) -> Option<Field> {
    let entries = match &node.kind {
        Kind::Map(entries) => entries,
        Kind::Refused => return None,
        // `key:` with nothing after it is a mapping without keys; its required keys are reported as missing.
        Kind::Null if !path.is_empty() => {
            out.error(node.span, path, "the value is missing")
                .expected(format!("a mapping with {}", key_names(table)))
                .found("nothing");
            return None;
        }
        _ => {
            out.error(node.span, path, "expected a mapping")
                .expected(format!("a mapping with {}", key_names(table)))
                .found(node.describe());
            return None;
        }
    };
    let mapping = Mapping {
        entries,
        table,
        path,
    };
    let mut values = mapping.given(out);
    let head = head_of(node, out);
    values.extend(mapping.defaults(node.span, head, out));
    mapping.check_groups(head, out);
    Some(Field {
        span: node.span,
        path: path.to_owned(),
        value: Value::Map(values),
    })
}

/// Entries of a mapping, and the table of its keys.
struct Mapping<'a> {
    entries: &'a [Entry],
    table: &'static Table,
    path: &'a str,
}

impl Mapping<'_> {
    /// Reads the given entries.
    fn given(&self, out: &mut Collector) -> Vec<(String, Field)> {
        let mut values = Vec::with_capacity(self.table.keys.len());
        for entry in self.entries {
            let key_path = join(self.path, &entry.key);
            let Some(key) = self.table.keys.iter().find(|k| k.name == entry.key) else {
                let names = self.table.keys.iter().map(|k| k.name);
                out.error(entry.key_span, key_path, "unknown key")
                    .expected(key_names(self.table))
                    .found(quote(&entry.key))
                    .maybe_help(did_you_mean(&entry.key, names));
                continue;
            };
            let place = if matches!(entry.value.kind, Kind::Null) {
                Node {
                    span: entry.key_span,
                    kind: Kind::Null,
                }
            } else {
                entry.value.clone()
            };
            if let Some(field) = read(&place, &key.shape, &key_path, out) {
                values.push((entry.key.clone(), field));
            }
        }
        values
    }

    /// Defaults of keys that are not given; reports missing required keys.
    fn defaults(&self, span: Span, head: Span, out: &mut Collector) -> Vec<(String, Field)> {
        let mut values = Vec::new();
        for key in self.table.keys.iter().filter(|k| !self.has(k.name)) {
            match key.need {
                Need::Required if !self.has_misspelt(&[key.name]) => {
                    let path = join(self.path, key.name);
                    out.error(head, path, "a required key is missing")
                        .expected(format!("`{}`: {}", key.name, expectation(&key.shape)))
                        .found("no such key")
                        .help(format!("add `{}`", entry_example(key)));
                }
                Need::Required | Need::Optional | Need::AtLeastOne => {}
                Need::Default(text) => {
                    if let Some(value) = default_value(key, text) {
                        let path = join(self.path, key.name);
                        let field = Field {
                            span,
                            path,
                            ..value
                        };
                        values.push((key.name.to_owned(), field));
                    }
                }
            }
        }
        values
    }

    /// Checks the groups of which exactly one or at least one key must be given.
    fn check_groups(&self, head: Span, out: &mut Collector) {
        for group in self.table.exactly_one {
            let given: Vec<_> = self
                .entries
                .iter()
                .filter(|e| group.contains(&e.key.as_str()))
                .collect();
            match given.as_slice() {
                [_] => {}
                [] if self.has_misspelt(group) => {}
                [] => none_given(self.table, group, "exactly one", head, self.path, out),
                [_, others @ ..] => {
                    let found = one_of(given.iter().map(|e| e.key.as_str()));
                    let found = found.replace(" or ", " and ");
                    let expected = format!("exactly one of {}", one_of(group.iter().copied()));
                    for other in others {
                        let path = join(self.path, &other.key);
                        out.error(other.key_span, path, "only one of these keys may be given")
                            .expected(expected.clone())
                            .found(found.clone())
                            .help("remove all but one");
                    }
                }
            }
        }
        let any: Vec<&'static str> = self.table.at_least_one().collect();
        if !any.is_empty() && !any.iter().any(|name| self.has(name)) && !self.has_misspelt(&any) {
            none_given(self.table, &any, "at least one", head, self.path, out);
        }
    }

    fn has(&self, name: &str) -> bool {
        self.entries.iter().any(|e| e.key == name)
    }

    /// True if an unknown key resembles one of `names`: it was reported as unknown already.
    fn has_misspelt(&self, names: &[&'static str]) -> bool {
        let mut unknown = self
            .entries
            .iter()
            .filter(|e| !self.table.keys.iter().any(|k| k.name == e.key));
        unknown.any(|e| closest(&e.key, names.iter().copied()).is_some())
    }
}

/// Reports that no key of a group is given.
fn none_given(
    table: &Table,
    group: &[&'static str],
    how_many: &str,
    head: Span,
    path: &str,
    out: &mut Collector,
) {
    let first = table.keys.iter().find(|k| group.contains(&k.name));
    let help = first.map(|key| format!("add `{}`", entry_example(key)));
    let names = one_of(group.iter().copied());
    let (expected, found) = match group {
        [_] => (names, "no such key"),
        _ => (format!("{how_many} of {names}"), "none of them"),
    };
    out.error(head, path, "a required key is missing")
        .expected(expected)
        .found(found)
        .maybe_help(help);
}

/// The first line of a mapping, as the location of a missing key.
fn head_of(node: &Node, out: &Collector) -> Span {
    match &node.kind {
        Kind::Map(entries) => entries.first().map_or(node.span, |e| e.key_span),
        _ => Span::new(
            node.span.source,
            node.span.start,
            node.span
                .start
                .min(out.sources.text(node.span.source).len()),
        ),
    }
}

/// Reads the documented default of a key with the key's own shape.
fn default_value(key: &'static Key, text: &str) -> Option<Field> {
    let mut sources = Sources::default();
    let source = sources.add("default", text);
    let mut collector = Collector::new(sources);
    let node = crate::yaml::parse(&mut collector, source)?;
    read(&node, &key.shape, key.name, &mut collector)
}

/// Reads `node` by `shape`.
pub(crate) fn read(
    node: &Node,
    shape: &'static Shape,
    path: &str,
    out: &mut Collector,
) -> Option<Field> {
    let value = match (shape, &node.kind) {
        (Shape::Map(table), _) => return read_table(node, table, path, out),
        (_, Kind::Refused) => return None,
        (_, Kind::Null) => {
            out.error(node.span, path, "the value is missing")
                .expected(expectation(shape))
                .found("nothing");
            return None;
        }
        (Shape::Text, Kind::Scalar { text, .. }) if !text.trim().is_empty() => {
            Value::Text(text.trim().to_owned())
        }
        (Shape::Flag, Kind::Scalar { text, plain: true }) if text == "true" => Value::Flag(true),
        (Shape::Flag, Kind::Scalar { text, plain: true }) if text == "false" => Value::Flag(false),
        (Shape::Text, Kind::Scalar { .. }) => {
            out.error(node.span, path, "the text is blank")
                .expected("a text")
                .found("blanks");
            return None;
        }
        (Shape::Flag, Kind::Scalar { text, .. }) => {
            let help = match text.to_lowercase().as_str() {
                "yes" | "on" | "true" | "y" => Some("write `true`".to_owned()),
                "no" | "off" | "false" | "n" => Some("write `false`".to_owned()),
                _ => None,
            };
            out.error(node.span, path, "not true or false")
                .expected(expectation(shape))
                .found(quote(text))
                .maybe_help(help);
            return None;
        }
        (Shape::Whole { min, max }, Kind::Scalar { text, plain }) => {
            whole(text, *plain, *min, *max, node, path, out)?
        }
        (Shape::Number(range), Kind::Scalar { text, plain: true }) => {
            number(text, range, node, path, out)?
        }
        (Shape::Quantity(dimensions, range), Kind::Scalar { text, .. }) => {
            measured(text, dimensions, range, node, path, out)?
        }
        (Shape::Choice(words), Kind::Scalar { text, .. }) => {
            choice(text, words, shape, node, path, out)?
        }
        (Shape::WordOr(words, _), Kind::Scalar { text, .. }) => {
            choice(text, words, shape, node, path, out)?
        }
        (Shape::WordOr(_, table), Kind::Map(_)) => return read_table(node, table, path, out),
        (Shape::Tuple(of, names), Kind::List(items)) if items.len() == names.len() => {
            list(items, of, path, out)?
        }
        (Shape::List { of, min, max }, Kind::List(items)) => {
            if items.len() < *min || items.len() > *max {
                let message = if items.len() < *min {
                    "the list is too short"
                } else {
                    "the list is too long"
                };
                out.error(node.span, path, message)
                    .expected(format!("{min} to {max} items"))
                    .found(format!("{}", items.len()));
                return None;
            }
            list(items, of, path, out)?
        }
        (Shape::Named(of), Kind::Map(entries)) => {
            let mut values = Vec::new();
            for entry in entries {
                if let Some(field) = read(&entry.value, of, &join(path, &entry.key), out) {
                    values.push((entry.key.clone(), field));
                }
            }
            Value::Map(values)
        }
        (Shape::Numbers, Kind::List(items)) => numbers(items, path, out)?,
        (Shape::Numbers, Kind::Scalar { .. }) => numbers(std::slice::from_ref(node), path, out)?,
        _ => {
            let help = match (shape, &node.kind) {
                (Shape::List { .. }, Kind::Scalar { text, .. }) => {
                    Some(format!("write a list: `[{text}]`"))
                }
                (Shape::Quantity(..), Kind::List(_)) => {
                    Some("give one value, not a list".to_owned())
                }
                _ => None,
            };
            out.error(node.span, path, "the value has the wrong form")
                .expected(expectation(shape))
                .found(node.describe())
                .maybe_help(help);
            return None;
        }
    };
    Some(Field {
        span: node.span,
        path: path.to_owned(),
        value,
    })
}

fn list(items: &[Node], of: &'static Shape, path: &str, out: &mut Collector) -> Option<Value> {
    let read: Vec<Option<Field>> = items
        .iter()
        .enumerate()
        .map(|(i, item)| read(item, of, &join(path, &format!("[{i}]")), out))
        .collect();
    read.into_iter()
        .collect::<Option<Vec<_>>>()
        .map(Value::List)
}
