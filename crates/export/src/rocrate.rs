//! Owns RO-Crates (1.1): one folder with data and a description of every file, which can be verified after a move.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::Read as _;
use std::path::{Component, Path, PathBuf};

use serde_json::{Value, json};
use skinrig_recorder::Problem;

use crate::bundle::{Entry, SIGNATURE_ENDING, entry, write_document};
use crate::error::ExportError;

/// The file that describes the others.
pub const METADATA: &str = "ro-crate-metadata.json";
/// The specification.
const SPECIFICATION: &str = "https://w3id.org/ro/crate/1.1";
/// Largest description, bytes.
const MAX_METADATA_BYTES: u64 = 64 << 20;
/// Most folders within each other.
const MAX_DEPTH: usize = 8;

/// Description of a crate.
#[derive(Debug, Clone, Default)]
pub struct CrateDescription {
    /// Title.
    pub title: String,
    /// Description of its contents.
    pub description: String,
    /// Licence, by its SPDX identifier.
    pub license: String,
    /// Day of publication: year-month-day.
    pub published_on: String,
    /// Authors, in order.
    pub people: Vec<CratePerson>,
    /// Publisher.
    pub publisher: Option<CrateOrganisation>,
    /// Name and version of the program that made it.
    pub software: String,
    /// Folders with what they hold.
    pub folders: BTreeMap<String, String>,
    /// Numbers with their subject, such as the RMSE of a session.
    pub numbers: Vec<CrateNumber>,
}

/// A person.
#[derive(Debug, Clone)]
pub struct CratePerson {
    /// ORCID, as an address.
    pub id: String,
    /// Name.
    pub name: String,
    /// Where they work.
    pub affiliation: Option<CrateOrganisation>,
}

/// An organisation.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct CrateOrganisation {
    /// Address on the web.
    pub url: String,
    /// Name.
    pub name: String,
}

/// A number that a crate states.
#[derive(Debug, Clone)]
pub struct CrateNumber {
    /// What it is, and of what.
    pub name: String,
    /// The value, if there is one.
    pub value: Option<f64>,
    /// Its unit.
    pub unit: &'static str,
}

/// Files of a crate, and its problems.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct CrateReport {
    /// Title.
    pub name: String,
    /// Paths of the files from the crate's folder, with `/` between names.
    pub files: Vec<String>,
    /// Files that differ from their description, are missing, or are not described.
    pub problems: Vec<Problem>,
}

/// Describes every file of `folder`, as the last step: a folder without [`METADATA`] is not a crate.
///
/// # Errors
/// When a file cannot be read, or the description cannot be written.
pub fn seal_crate(folder: &Path, about: &CrateDescription) -> Result<(), ExportError> {
    write_document(&folder.join(METADATA), &description(folder, about)?)
}

/// The description of the files in `folder`, and of what `about` states.
fn description(folder: &Path, about: &CrateDescription) -> Result<Value, ExportError> {
    let files: Result<Vec<Entry>, _> = files_in(folder)?
        .iter()
        .filter(|name| !is_signature(name))
        .map(|name| entry(folder, name))
        .collect();
    Ok(json!({
        // The context of 1.1 is older than the property.
        "@context": [format!("{SPECIFICATION}/context"), { "sha256": "https://schema.org/sha256" }],
        "@graph": graph(about, &files?),
    }))
}

/// Compares the description of `folder` with one that states `about`, entity by entity.
///
/// # Errors
/// As [`verify_crate`], and when a file cannot be read.
pub fn compare_description(
    folder: &Path,
    about: &CrateDescription,
) -> Result<Vec<Problem>, ExportError> {
    let (expected, found) = (description(folder, about)?, read_description(folder)?);
    let place = |what: &str| format!("{METADATA}: {what}");
    let entities = |document: &Value| -> Vec<Value> {
        let graph = document["@graph"].as_array();
        graph.cloned().unwrap_or_default()
    };
    let (mut missing, mut more) = (entities(&expected), entities(&found));
    missing.retain(|entity| {
        let same = more.iter().position(|other| other == entity);
        same.map(|at| more.swap_remove(at)).is_none()
    });
    let mut problems = Vec::new();
    for entity in &missing {
        let id = entity["@id"].as_str().unwrap_or_default();
        let at = more.iter().position(|other| other["@id"] == entity["@id"]);
        let found = at.map(|at| more.swap_remove(at));
        let found = found.map_or_else(|| "none".to_owned(), |other| other.to_string());
        problems.push(Problem::new(place(id), entity, found));
    }
    for entity in &more {
        let id = entity["@id"].as_str().unwrap_or_default();
        problems.push(Problem::new(place(id), "no such entity", entity));
    }
    let others = |document: &Value| -> Value {
        let mut document = document.clone();
        document["@graph"].take();
        document
    };
    let (expected, found) = (others(&expected), others(&found));
    if expected != found {
        problems.push(Problem::new(place("beside its entities"), expected, found));
    }
    Ok(problems)
}

/// Everything that the description states, as JSON-LD entities.
fn graph(about: &CrateDescription, files: &[Entry]) -> Vec<Value> {
    let id = |id: &str| json!({ "@id": id });
    let license = format!("https://spdx.org/licenses/{}", about.license);
    let in_folder = |f: &&Entry| about.folders.keys().any(|folder| is_in(folder, f));
    let mut parts: Vec<Value> = about
        .folders
        .keys()
        .map(|f| id(&format!("{}/", encoded(f))))
        .collect();
    let loose = files.iter().filter(|f| !in_folder(f));
    parts.extend(loose.map(|f| id(&encoded(&f.name))));
    let mut root = json!({
        "@id": "./", "@type": "Dataset", "name": about.title, "description": about.description,
        "datePublished": about.published_on, "license": id(&license),
        "author": plain_if_one(about.people.iter().map(|person| id(&person.id)).collect()),
        "hasPart": plain_if_one(parts), "mentions": id("#publish"),
        "variableMeasured": plain_if_one((1..=about.numbers.len()).map(|n| id(&format!("#number-{n}"))).collect()),
    });
    if let Some(publisher) = &about.publisher {
        root["publisher"] = id(&publisher.url);
    }
    let mut graph = vec![
        json!({
            "@id": METADATA, "@type": "CreativeWork", "about": id("./"), "conformsTo": id(SPECIFICATION),
        }),
        root,
        json!({
            "@id": license, "@type": "CreativeWork", "name": about.license,
            "description": "Licence of the data, by its SPDX identifier.",
        }),
        json!({
            "@id": "#skinrig", "@type": "SoftwareApplication", "name": "skinrig", "version": about.software,
        }),
        json!({
            "@id": "#publish", "@type": "CreateAction", "name": "derivation of all files from the sessions",
            "instrument": id("#skinrig"), "result": id("./"),
        }),
    ];
    graph.extend(about.people.iter().map(|person| {
        let mut entity = json!({ "@id": person.id, "@type": "Person", "name": person.name });
        if let Some(place) = &person.affiliation {
            entity["affiliation"] = id(&place.url);
        }
        entity
    }));
    let places = about
        .people
        .iter()
        .filter_map(|person| person.affiliation.as_ref());
    let places: BTreeSet<&CrateOrganisation> = places.chain(&about.publisher).collect();
    graph.extend(places.into_iter().map(|place| {
        json!({ "@id": place.url, "@type": "Organization", "name": place.name, "url": place.url })
    }));
    graph.extend(about.folders.iter().map(|(folder, what)| {
        let parts = files.iter().filter(|f| is_in(folder, f)).map(|f| id(&encoded(&f.name)));
        json!({
            "@id": format!("{}/", encoded(folder)), "@type": "Dataset", "name": folder, "description": what,
            "hasPart": plain_if_one(parts.collect()),
        })
    }));
    graph.extend((1..).zip(&about.numbers).map(|(n, number)| {
        json!({
            "@id": format!("#number-{n}"), "@type": "PropertyValue", "name": number.name, "value": number.value,
            "unitText": number.unit,
        })
    }));
    graph.extend(files.iter().map(|file| {
        json!({
            "@id": encoded(&file.name), "@type": "File", "name": file.name, "contentSize": file.bytes.to_string(),
            "encodingFormat": media_type(&file.name), "sha256": file.sha256,
        })
    }));
    graph
}

/// A list of one as its item, as JSON-LD prefers it.
fn plain_if_one(mut list: Vec<Value>) -> Value {
    match (list.pop(), list.is_empty()) {
        (Some(only), true) => only,
        (last, _) => {
            list.extend(last);
            Value::Array(list)
        }
    }
}

/// True for a file below the folder.
fn is_in(folder: &str, file: &Entry) -> bool {
    let rest = file.name.strip_prefix(folder);
    rest.is_some_and(|rest| rest.starts_with('/'))
}

/// Media type by the ending of a file's name.
fn media_type(name: &str) -> &'static str {
    match name.rsplit('.').next().unwrap_or_default() {
        "csv" => "text/csv",
        "html" => "text/html",
        "json" => "application/json",
        "jsonl" => "application/jsonl",
        "md" => "text/markdown",
        "parquet" => "application/vnd.apache.parquet",
        "sh" => "application/x-sh",
        "sqlite" => "application/vnd.sqlite3",
        "yaml" | "yml" => "application/yaml",
        _ => "application/octet-stream",
    }
}

/// Reads the description of a folder.
fn read_description(folder: &Path) -> Result<Value, ExportError> {
    let path = folder.join(METADATA);
    let not = |found: String| ExportError::NotACrate {
        path: path.clone(),
        found,
    };
    if !path.symlink_metadata().is_ok_and(|m| m.is_file()) {
        return Err(not("no such file".to_owned()));
    }
    let mut text = String::new();
    let file = File::open(&path).map_err(ExportError::file(&path))?;
    file.take(MAX_METADATA_BYTES)
        .read_to_string(&mut text)
        .map_err(ExportError::file(&path))?;
    serde_json::from_str(&text).map_err(|e| not(e.to_string()))
}

/// True for the signature of the description.
#[must_use]
pub fn is_signature(name: &str) -> bool {
    name.strip_suffix(SIGNATURE_ENDING) == Some(METADATA)
}

/// Compares every file in `folder` with its description.
///
/// # Errors
/// [`ExportError::NotACrate`] for a folder without a description of this kind; [`ExportError::File`] when it cannot be read.
pub fn verify_crate(folder: &Path) -> Result<CrateReport, ExportError> {
    let document = read_description(folder)?;
    let path = folder.join(METADATA);
    let not = |found: String| ExportError::NotACrate {
        path: path.clone(),
        found,
    };
    let graph = document["@graph"].as_array().map_or(&[][..], Vec::as_slice);
    let entity = |id: &str| graph.iter().find(|e| e["@id"] == id);
    let root = entity("./").ok_or_else(|| not("no description of the folder".to_owned()))?;
    if entity(METADATA).is_none_or(|e| e["conformsTo"]["@id"] != SPECIFICATION) {
        return Err(not(format!(
            "no statement that it conforms to {SPECIFICATION}"
        )));
    }
    let mut described = BTreeMap::new();
    for file in graph.iter().filter(|e| e["@type"] == "File") {
        let name = file["@id"].as_str().and_then(decoded).unwrap_or_default();
        if !is_inside(&name) {
            return Err(not(format!("a file outside the folder: {name:?}")));
        }
        let text = |key: &str| file[key].as_str().unwrap_or_default().to_owned();
        described.insert(name, (text("contentSize"), text("sha256")));
    }
    let present: BTreeSet<String> = files_in(folder)?.into_iter().collect();
    let mut problems = Vec::new();
    for (name, (bytes, sha256)) in &described {
        if !present.contains(name) {
            problems.push(Problem::new(name, "a file", "none"));
            continue;
        }
        if is_linked(folder, name)? {
            let expected = "a file of the crate itself";
            problems.push(Problem::new(name, expected, "a symbolic link"));
            continue;
        }
        let found = entry(folder, name)?;
        if found.bytes.to_string() != *bytes {
            problems.push(Problem::new(
                name,
                format_args!("{bytes} bytes"),
                found.bytes,
            ));
        } else if found.sha256 != *sha256 {
            problems.push(Problem::new(
                name,
                format_args!("SHA-256 {sha256}"),
                found.sha256,
            ));
        }
    }
    let others = present.iter().filter(|name| !described.contains_key(*name));
    let others = others.filter(|name| !is_signature(name));
    problems.extend(
        others
            .map(|name| Problem::new(name, "only files that the crate describes", "another file")),
    );
    Ok(CrateReport {
        name: root["name"].as_str().unwrap_or_default().to_owned(),
        files: described.into_keys().collect(),
        problems,
    })
}

/// Paths of the files in `folder` and its folders but the description, with `/` between names, in order.
fn files_in(folder: &Path) -> Result<Vec<String>, ExportError> {
    let mut found = Vec::new();
    let mut open = vec![(PathBuf::from(folder), String::new(), 0)];
    while let Some((path, prefix, depth)) = open.pop() {
        for item in std::fs::read_dir(&path).map_err(ExportError::file(&path))? {
            let item = item.map_err(ExportError::file(&path))?;
            let name = format!("{prefix}{}", item.file_name().to_string_lossy());
            // A link counts as a file that is not described: it is never followed.
            let kind = item.file_type().map_err(ExportError::file(&path))?;
            if kind.is_dir() && depth < MAX_DEPTH {
                open.push((item.path(), format!("{name}/"), depth + 1));
            } else if name != METADATA {
                found.push(name);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Whether a described file is a link: a copy of the crate may not have what it leads to.
fn is_linked(folder: &Path, name: &str) -> Result<bool, ExportError> {
    let path = folder.join(name);
    let found = std::fs::symlink_metadata(&path).map_err(ExportError::file(&path))?;
    Ok(found.is_symlink())
}

/// True for a path that stays in the folder.
fn is_inside(name: &str) -> bool {
    let mut parts = Path::new(name).components().peekable();
    parts.peek().is_some() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// A path as a relative address: every byte but letters, digits and `-._~/` as `%XX`.
fn encoded(path: &str) -> String {
    let mut out = String::new();
    for byte in path.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => {
                out.push(char::from(byte))
            }
            _ => out.push_str(&format!("%{byte:02X}")),
        }
    }
    out
}

/// The path of a relative address; `None` for one that is not.
fn decoded(address: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = address.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let digits = [rest.next()?, rest.next()?];
                u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()?
            }
            other => other,
        });
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_file_name_survives_as_an_address() {
        for name in ["a/b.csv", "skin 7 (ü).csv", "100%#?.csv", "a%2Fb"] {
            let address = encoded(name);
            assert!(
                address.is_ascii() && !address.contains([' ', '#', '?']),
                "{address}"
            );
            assert_eq!(decoded(&address).as_deref(), Some(name));
        }
        assert_eq!(decoded("%f"), None);
        assert_eq!(decoded("%ff"), None);
    }

    #[test]
    fn no_file_outside_the_folder_is_read() {
        for name in ["../x", "/etc/passwd", "a/../../x", "", "./x"] {
            assert!(!is_inside(name), "{name}");
        }
        assert!(is_inside("a/b"));
    }
}
