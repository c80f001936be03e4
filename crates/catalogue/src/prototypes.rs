//! `prototypes.yaml` in a folder of sessions: where prototypes come from.

use std::collections::BTreeMap;
use std::path::Path;

use chrono::NaiveDate;
use skinrig_settings::{Choice, Collector, Field, Settings, did_you_mean, open};

use crate::error::CatalogueError;

/// Name of the file in a folder of sessions.
pub(crate) const PROTOTYPES_FILE: &str = "prototypes.yaml";

/// Prototypes of a lab and where they come from.
#[derive(Debug, Clone, PartialEq, Eq, Settings)]
#[settings(
    name = "prototypes",
    version = "skinrig_prototypes",
    finish = Self::names_agree
)]
pub(crate) struct Prototypes {
    /// The prototypes.
    #[setting(items = 1..=10_000, example = "[{name: mold 1}, {name: mold 2, relation: molded_from, parent: mold 1}]")]
    pub prototypes: Vec<PrototypeOrigin>,
}

/// A prototype and its predecessor.
#[derive(Debug, Clone, PartialEq, Eq, Settings)]
#[settings(name = "prototype_origin", finish = Self::parent_has_a_relation)]
pub(crate) struct PrototypeOrigin {
    /// Name, as in `prototype.id` of the protocols.
    #[setting(example = "mold 2")]
    pub name: String,
    /// How it came from `parent`.
    pub relation: Option<Relation>,
    /// Name of its predecessor.
    pub parent: Option<String>,
    /// Day on which it was made: year-month-day.
    #[setting(read = day)]
    pub made_on: Option<String>,
    /// Free text.
    pub note: Option<String>,
}

/// How a prototype came from its predecessor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Choice)]
pub(crate) enum Relation {
    /// Cast in the same mold, or in one made from it.
    MoldedFrom,
    /// The same skin after a repair.
    Repaired,
    /// The same skin with another outline.
    Recut,
}

impl Prototypes {
    /// Reads the file of prototypes in `folder`; empty without one.
    ///
    /// # Errors
    /// [`CatalogueError::Prototypes`] with every finding, [`CatalogueError::Io`].
    pub(crate) fn of_folder(folder: &Path) -> Result<Vec<PrototypeOrigin>, CatalogueError> {
        let path = folder.join(PROTOTYPES_FILE);
        match std::fs::read(&path) {
            Ok(bytes) => Self::parse(&path.display().to_string(), &bytes),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
            Err(source) => Err(CatalogueError::Io {
                path,
                doing: "reading it",
                source,
            }),
        }
    }

    /// Reads the bytes of a file named `name`.
    fn parse(name: &str, bytes: &[u8]) -> Result<Vec<PrototypeOrigin>, CatalogueError> {
        let (mut out, root) =
            open(name, bytes, &[], Self::TABLE).map_err(CatalogueError::Prototypes)?;
        match root.and_then(|root| Self::from_mapping(&root, &mut out)) {
            Some(found) if out.is_clean() => Ok(found.prototypes),
            _ => Err(CatalogueError::Prototypes(out.finish())),
        }
    }

    /// Rejects names that are given twice, unknown parents, and prototypes that precede themselves.
    fn names_agree(self, field: &Field, out: &mut Collector) -> Option<Self> {
        let items = field.at("prototypes");
        let mut parents: BTreeMap<&str, Option<&str>> = BTreeMap::new();
        let mut is_good = true;
        for (prototype, item) in self.prototypes.iter().zip(items.items()) {
            let before = parents.insert(&prototype.name, prototype.parent.as_deref());
            if before.is_some() {
                let message = "the prototype is declared twice";
                out.error(item.span, item.path.as_str(), message)
                    .expected("each name once")
                    .found(format!("`{}`", prototype.name));
                is_good = false;
            }
        }
        for (prototype, item) in self.prototypes.iter().zip(items.items()) {
            let Some(parent) = &prototype.parent else {
                continue;
            };
            if !parents.contains_key(parent.as_str()) {
                let message = "the parent is not declared";
                let known = parents.keys().copied();
                let help = did_you_mean(parent, known);
                out.error(item.span, item.path.as_str(), message)
                    .expected("the name of a prototype in this file")
                    .found(format!("`{parent}`"))
                    .help(help.unwrap_or_else(|| format!("add `- {{name: {parent}}}`")));
                is_good = false;
            }
            let mut at = Some(parent.as_str());
            for _ in 0..parents.len() {
                at = at.and_then(|name| parents.get(name).copied().flatten());
            }
            if at.is_some() {
                let message = "the prototype precedes itself";
                out.error(item.span, item.path.as_str(), message)
                    .expected("parents that end at a first prototype")
                    .found(format!("`{parent}`"));
                is_good = false;
            }
        }
        is_good.then_some(self)
    }
}

impl PrototypeOrigin {
    fn parent_has_a_relation(self, field: &Field, out: &mut Collector) -> Option<Self> {
        let (expected, found) = match (&self.relation, &self.parent) {
            (Some(_), None) => ("`parent` beside `relation`", "`relation` alone"),
            (None, Some(_)) => ("`relation` beside `parent`", "`parent` alone"),
            _ => return Some(self),
        };
        out.error(
            field.span,
            field.path.as_str(),
            "the predecessor is incomplete",
        )
        .expected(expected)
        .found(found);
        None
    }
}

fn day(field: &Field, out: &mut Collector) -> Option<String> {
    let text = field.as_text()?;
    if text.len() == 10 && NaiveDate::parse_from_str(text, "%Y-%m-%d").is_ok() {
        return Some(text.to_owned());
    }
    out.error(field.span, field.path.as_str(), "not a day")
        .expected("year-month-day, for example 2026-11-20")
        .found(format!("`{text}`"));
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn origins_are_read() {
        let text = "skinrig_prototypes: 1\nprototypes:\n  - {name: mold 2, relation: molded_from, parent: mold 1, \
                    made_on: 2026-11-20}\n  - {name: mold 1}\n  - {name: mold 2b, relation: repaired, parent: mold 2}\n";
        let found = Prototypes::parse("p.yaml", text.as_bytes()).unwrap();
        assert_eq!(found.len(), 3);
        assert_eq!(found[0].relation, Some(Relation::MoldedFrom));
        assert_eq!(found[0].made_on.as_deref(), Some("2026-11-20"));
        assert_eq!(found[2].parent.as_deref(), Some("mold 2"));
    }

    #[test]
    fn contradictions_are_rejected() {
        for (items, part) in [
            ("{name: a}, {name: a}", "declared twice"),
            (
                "{name: a, parent: b}, {name: b}",
                "`relation` beside `parent`",
            ),
            ("{name: a, relation: recut}", "`parent` beside `relation`"),
            ("{name: a, relation: recut, parent: b}", "not declared"),
            ("{name: a, relation: recut, parent: a}", "precedes itself"),
            (
                "{name: a, relation: recut, parent: b}, {name: b, relation: repaired, parent: a}",
                "precedes itself",
            ),
            ("{name: a, made_on: 2026-02-30}", "not a day"),
        ] {
            let text = format!("skinrig_prototypes: 1\nprototypes: [{items}]\n");
            let error = Prototypes::parse("p.yaml", text.as_bytes()).unwrap_err();
            assert!(error.to_string().contains(part), "{items}: {error}");
        }
    }
}
