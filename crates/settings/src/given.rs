//! Values that a file gives, without defaults, as overrides of another file: `key.path=value`.

use crate::diagnostic::{Collector, Diagnostics};
use crate::shape::{Shape, Table};
use crate::source::Sources;
use crate::yaml::{self, Kind, Node, join};

/// The values below the key `below` of a file that [`open`](crate::open) reads without findings, in the order of the text, as `--set`
/// takes them.
///
/// # Errors
/// [`Diagnostics`] if the text is not YAML.
pub fn given(
    name: &str,
    bytes: &[u8],
    table: &'static Table,
    below: &str,
) -> Result<Vec<String>, Diagnostics> {
    let mut sources = Sources::default();
    let source = sources.add(name, yaml::decode(bytes).unwrap_or_default());
    let mut out = Collector::new(sources);
    let Some(root) = yaml::parse(&mut out, source) else {
        return Err(out.finish());
    };
    let mut all = Vec::new();
    let key = table.keys.iter().find(|key| key.name == below);
    if let (Kind::Map(entries), Some(key)) = (&root.kind, key) {
        let entries = entries.iter().filter(|entry| entry.key == below);
        entries.for_each(|entry| add(&entry.value, &key.shape, below, &mut all));
    }
    Ok(all)
}

fn add(node: &Node, shape: &Shape, path: &str, all: &mut Vec<String>) {
    let (Kind::Map(entries), Shape::Map(table) | Shape::WordOr(_, table)) = (&node.kind, shape)
    else {
        let value = match (&node.kind, shape) {
            // `--set` takes a text as it is.
            (Kind::Scalar { text, .. }, Shape::Text) => text.clone(),
            _ => flow(node),
        };
        all.push(format!("{path}={value}"));
        return;
    };
    for entry in entries {
        if let Some(key) = table.keys.iter().find(|key| key.name == entry.key) {
            add(&entry.value, &key.shape, &join(path, &entry.key), all);
        }
    }
}

/// A value on one line.
fn flow(node: &Node) -> String {
    match &node.kind {
        Kind::Null | Kind::Refused => "null".to_owned(),
        Kind::Scalar { text, plain: true } => text.clone(),
        Kind::Scalar { text, plain: false } => format!("'{}'", text.replace('\'', "''")),
        Kind::List(items) => {
            let items: Vec<String> = items.iter().map(flow).collect();
            format!("[{}]", items.join(", "))
        }
        Kind::Map(entries) => {
            let entry = |entry: &yaml::Entry| format!("{}: {}", entry.key, flow(&entry.value));
            let entries: Vec<String> = entries.iter().map(entry).collect();
            format!("{{{}}}", entries.join(", "))
        }
    }
}
