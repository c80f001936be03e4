//! Opens a file of one of the languages: encoding, size, language, overrides, keys.

use crate::diagnostic::{Collector, Diagnostics};
use crate::field::Field;
use crate::read::read_table;
use crate::shape::Table;
use crate::source::{Sources, Span};
use crate::yaml;

/// Decodes a file, applies the overrides (`key.path=value`) and reads it by its table. The field contains the readable values, the
/// collector the findings.
///
/// # Errors
/// [`Diagnostics`] if nothing can be read: not UTF-8, not YAML, a file of another language, an empty file.
pub fn open(
    name: &str,
    bytes: &[u8],
    overrides: &[String],
    table: &'static Table,
) -> Result<(Collector, Option<Field>), Diagnostics> {
    let mut sources = Sources::default();
    let text = match yaml::decode(bytes) {
        Ok(text) => text,
        Err((at, found)) => {
            let start = at.saturating_sub(200);
            let valid = bytes.get(..at).unwrap_or(&[]);
            let text = String::from_utf8_lossy(valid);
            let source = sources.add(name, text.clone());
            let mut out = Collector::new(sources);
            let span = Span::new(source, text.len().max(start), text.len());
            let limit = yaml::LARGEST_TEXT;
            if bytes.len() > limit {
                out.error(span, "", "the file is too large")
                    .expected(format!("at most {limit} bytes"))
                    .found(found);
            } else {
                let utf16 = bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]);
                let help = if utf16 {
                    "the file seems to be UTF-16; save it as UTF-8"
                } else {
                    "save the file as UTF-8"
                };
                out.error(span, "", "not UTF-8 text")
                    .expected("UTF-8 text")
                    .found(found)
                    .help(help);
            }
            return Err(out.finish());
        }
    };
    let source = sources.add(name, text);
    let mut out = Collector::new(sources);
    let Some(mut root) = yaml::parse(&mut out, source) else {
        return Err(out.finish());
    };
    if let Some((place, other)) = other_language(&root, table) {
        out.error(place, "", format!("this is not a {}", table.name))
            .expected(format!("a {}", table.name))
            .found(other);
        return Err(out.finish());
    }
    if matches!(root.kind, yaml::Kind::Null) && out.is_clean() {
        out.error(root.span, "", "the file is empty")
            .expected(format!("a {}", table.name))
            .found("nothing")
            .help(format!(
                "begin with `{}: 1`, or copy one of the shipped files",
                version_key(table)
            ));
        return Err(out.finish());
    }
    crate::overrides::apply(&mut root, table, overrides, &mut out);
    let field = read_table(&root, table, "", &mut out);
    Ok((out, field))
}

/// Our languages: name of the table, key of the version, and description of such a file in messages.
const LANGUAGES: [(&str, &str, &str); 8] = [
    ("protocol", "skinrig", "a protocol"),
    (
        "schedule",
        "skinrig_schedule",
        "a schedule, which only `skinrig import` reads",
    ),
    ("rig", "skinrig_rig", "a rig file, which belongs to `--rig`"),
    (
        "limits",
        "skinrig_limits",
        "a file of limits, which only `skinrig compare` reads",
    ),
    (
        "selection",
        "skinrig_selection",
        "a selection, which stands for a session",
    ),
    (
        "publication",
        "skinrig_publication",
        "a publication, which only `skinrig publish --about` reads",
    ),
    (
        "settings",
        "skinrig_settings",
        "a file of settings, which only `skinrig reanalyze --settings` reads",
    ),
    (
        "suite",
        "skinrig_suite",
        "a suite, which only `skinrig hil run` reads",
    ),
];

/// The version key of the language of `table`.
fn version_key(table: &Table) -> &'static str {
    LANGUAGES
        .iter()
        .find(|(name, ..)| *name == table.name)
        .map_or("skinrig", |(_, key, _)| key)
}

/// The version key of another language, if the file has that and not its own, and the description of such a file.
fn other_language(root: &yaml::Node, table: &Table) -> Option<(Span, &'static str)> {
    let yaml::Kind::Map(entries) = &root.kind else {
        return None;
    };
    let entry_of = |key: &str| entries.iter().find(|e| e.key == key);
    if entry_of(version_key(table)).is_some() {
        return None;
    }
    LANGUAGES
        .iter()
        .find_map(|(_, key, what)| entry_of(key).map(|e| (e.key_span, *what)))
}
