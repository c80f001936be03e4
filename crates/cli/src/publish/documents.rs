//! Documents of a crate besides bundles and results, and its description: `publish` writes them, `reproduce` derives them again.

use std::collections::BTreeMap;
use std::path::Path;

use skinrig_export::{CrateDescription, CrateNumber, CrateOrganisation, CratePerson};
use skinrig_protocol::publication::{Organisation, Person};
use skinrig_protocol::{Publication, Selection};

use super::card::{Published, card};
use super::headline::{self, Headline, Number};
use crate::exit::Failure;
use crate::paths::file_name;

/// Folder of the results with the selection.
pub(super) const SELECTED: &str = "selected";
/// The file of `--about` in a crate.
pub(super) const ABOUT: &str = "publication.yaml";
/// File of the data card.
const CARD: &str = "README.md";

/// Derives the numbers again.
const SCRIPT: &str = "#!/bin/sh\n# Compares every file with its checksum and derives every number again.\nexec skinrig reproduce \"$(dirname \"$0\")\" \"$@\"\n";

/// The file of a session's protocol.
pub(super) fn protocol_file(bundle: &str) -> String {
    let stem = bundle.strip_suffix(".bundle").unwrap_or(bundle);
    format!("{stem}.protocol.yaml")
}

/// The files by name. `about` and `selection` come with the bytes of their files.
///
/// # Errors
/// [`Failure::internal`] if a number cannot be written.
pub(super) fn documents(
    about: (&Publication, &[u8]),
    selection: Option<(&Selection, &[u8])>,
    sessions: &[Published],
    headline: &Headline,
) -> Result<BTreeMap<String, Vec<u8>>, Failure> {
    let numbers = serde_json::to_string_pretty(headline).map_err(Failure::internal)?;
    let card = card(about.0, sessions, headline, selection.map(|(s, _)| s));
    let mut files = BTreeMap::from([
        (headline::FILE.to_owned(), numbers.into_bytes()),
        (ABOUT.to_owned(), about.1.to_vec()),
        (CARD.to_owned(), card.into_bytes()),
        ("reproduce.sh".to_owned(), SCRIPT.as_bytes().to_vec()),
    ]);
    files.extend(sessions.iter().map(|session| {
        let text = session.protocol_text.clone();
        (protocol_file(&session.bundle), text.into_bytes())
    }));
    files.extend(selection.map(|(s, bytes)| (file_name(Path::new(&s.file_name)), bytes.to_vec())));
    Ok(files)
}

/// Description of the crate.
pub(super) fn description(about: &Publication, headline: &Headline) -> CrateDescription {
    let folders = headline.sessions.iter().map(|session| {
        let what = format!(
            "Session {} of prototype {}, and everything that follows from it.",
            session.session_id, session.prototype
        );
        (session.bundle.clone(), what)
    });
    let mut folders: BTreeMap<String, String> = folders.collect();
    if let Some(selection) = &headline.selection {
        let what = format!("Results and tables with the selection {}.", selection.name);
        folders.insert(SELECTED.to_owned(), what);
    }
    let selected = headline.selection.as_ref();
    let selected = selected.map_or_else(String::new, |s| format!(", selection {}", s.name));
    let numbers = headline.sessions.iter().flat_map(|session| {
        let is_rmse = |n: &&Number| n.metric == "rmse" && n.unit == "mm";
        session.numbers.iter().filter(is_rmse).map(|n| CrateNumber {
            name: format!("{} of {}{selected}", n.name(), session.bundle),
            value: n.value,
            unit: "mm",
        })
    });
    CrateDescription {
        title: about.title.clone(),
        description: about.description.clone(),
        license: about.license.clone(),
        published_on: about.published_on.clone(),
        people: about.people.iter().map(person).collect(),
        publisher: about.publisher.as_ref().map(organisation),
        software: headline.software.clone(),
        numbers: numbers.collect(),
        folders,
    }
}

fn person(person: &Person) -> CratePerson {
    CratePerson {
        id: person.id(),
        name: person.name.clone(),
        affiliation: person.affiliation.as_ref().map(organisation),
    }
}

fn organisation(place: &Organisation) -> CrateOrganisation {
    CrateOrganisation {
        url: place.url.clone(),
        name: place.name.clone(),
    }
}
