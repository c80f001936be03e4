//! Finds dvs dictionaries in an HDF5 tree.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use rust_hdf5::{DatatypeMessage, H5Dataset, H5File};

use crate::error::FormatsError;

/// The fields of a dvs dictionary.
pub(super) const FIELDS: [&str; 4] = ["ts", "x", "y", "pol"];

/// Largest compression ratio of deflate (zlib's technical details: 1032).
const MOST_INFLATED: u64 = 1032;
/// Chunks of up to this size are read from a file of any size: 16 MiB, sixteen times the largest that h5py chooses.
const ALWAYS_HELD: u64 = 16 << 20;

/// An open HDF5 file with at least one dvs dictionary.
pub struct Container {
    pub(super) path: PathBuf,
    pub(super) file: H5File,
    entries: Vec<DvsEntry>,
    writer: String,
}

/// One dvs dictionary: the events of one sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct DvsEntry {
    /// Its key path, such as `data/left/dvs`; empty if the file contains only one dictionary.
    pub name: String,
    /// Rows of `ts`.
    pub events: u64,
    /// Seconds added to the camera's time; `None` if the file does not contain them.
    pub ts_offset_s: Option<f64>,
    /// Paths of ts, x, y and pol in the file, in this order.
    pub(super) fields: [String; 4],
}

impl Container {
    /// Opens `path` and finds its dvs dictionaries, without reading events.
    ///
    /// # Errors
    /// If the file is not readable HDF5, or contains no dvs dictionary: the message then describes its content
    /// or names the missing dataset.
    pub fn open(path: &Path) -> Result<Self, FormatsError> {
        crate::regular::open(path).map_err(FormatsError::io(path))?;
        let file = H5File::open(path).map_err(FormatsError::hdf5(path))?;
        let names = file.dataset_names();
        let mut parents: BTreeMap<String, BTreeMap<String, String>> = BTreeMap::new();
        for name in &names {
            let (parent, field) = split(name);
            parents
                .entry(parent)
                .or_default()
                .insert(field, name.clone());
        }
        let mut entries = Vec::new();
        for (parent, members) in &parents {
            let [Some(ts), Some(x), Some(y), Some(pol)] = FIELDS.map(|f| members.get(f)) else {
                continue;
            };
            let rows = |dataset: &String| {
                let opened = open_followed(&file, path, dataset)?;
                let shape = opened.shape();
                match shape[..] {
                    [rows] => Ok(rows as u64),
                    _ => Err(FormatsError::Dataset {
                        path: path.into(),
                        dataset: dataset.clone(),
                        expected: "one dimension".into(),
                        found: format!("shape {shape:?}"),
                    }),
                }
            };
            let events = rows(ts)?;
            for dataset in [x, y, pol] {
                let found = rows(dataset)?;
                if found != events {
                    return Err(FormatsError::Dataset {
                        path: path.into(),
                        dataset: dataset.clone(),
                        expected: format!("{events} rows as in {ts}"),
                        found: format!("{found}"),
                    });
                }
            }
            let ts_offset_s = match members.get("tsOffset") {
                Some(dataset) => Some(scalar(&file, path, dataset)?),
                None => None,
            };
            entries.push(DvsEntry {
                name: display_name(parent),
                events,
                ts_offset_s,
                fields: [ts, x, y, pol].map(String::clone),
            });
        }
        if entries.is_empty() {
            return Err(explain(path, &names, &parents));
        }
        let writer = ["HICKLE_VERSION", "VERSION"]
            .iter()
            .find_map(|a| file.attr_string(a).ok())
            .map_or_else(|| "HDF5".into(), |v| format!("hickle {v}"));
        Ok(Self {
            path: path.into(),
            file,
            entries,
            writer,
        })
    }

    /// The dvs dictionaries, by name.
    #[must_use]
    pub fn entries(&self) -> &[DvsEntry] {
        &self.entries
    }

    /// Program that wrote the file, for display: `hickle 5.0.3`.
    #[must_use]
    pub fn written_by(&self) -> &str {
        &self.writer
    }

    /// The dictionary `choice`, or the only one if `choice` is `None`.
    ///
    /// # Errors
    /// If the name does not exist, or a choice is needed: the message lists the names.
    pub fn choose(&self, choice: Option<&str>) -> Result<&DvsEntry, FormatsError> {
        let list = || {
            let names: Vec<_> = self
                .entries
                .iter()
                .map(|e| format!("`{}`", e.name))
                .collect();
            names.join(", ")
        };
        match (choice, &self.entries[..]) {
            (None, [only]) => Ok(only),
            (None, _) => Err(FormatsError::Container {
                path: self.path.clone(),
                expected: "one dictionary of events, or the name of one".into(),
                found: format!("{}: choose one of them", list()),
            }),
            (Some(name), entries) => {
                let found = entries.iter().find(|e| e.name == name);
                found.ok_or_else(|| FormatsError::Container {
                    path: self.path.clone(),
                    expected: format!("a dictionary of events named `{name}`"),
                    found: list(),
                })
            }
        }
    }
}

/// Opens a dataset, or the shared object that it refers to.
pub(super) fn open_followed(
    file: &H5File,
    path: &Path,
    dataset: &str,
) -> Result<H5Dataset, FormatsError> {
    let in_dataset = |error: rust_hdf5::Hdf5Error| FormatsError::Dataset {
        path: path.into(),
        dataset: dataset.into(),
        expected: "a readable dataset".into(),
        found: error.to_string(),
    };
    let opened = holdable(file.dataset(dataset).map_err(in_dataset)?, path, dataset)?;
    if !matches!(
        opened.datatype().map_err(in_dataset)?,
        DatatypeMessage::Reference { .. }
    ) {
        return Ok(opened);
    }
    let references = opened.read_references().map_err(in_dataset)?;
    match references.first().and_then(|r| r.path()) {
        Some(target) if references.len() == 1 => {
            let target = file.dataset(target.trim_start_matches('/'));
            holdable(target.map_err(in_dataset)?, path, dataset)
        }
        _ => Err(FormatsError::Dataset {
            path: path.into(),
            dataset: dataset.into(),
            expected: "numbers, or a reference to a dataset of this file".into(),
            found: format!("{references:?}"),
        }),
    }
}

/// The dataset, if its chunks are no larger than this file can fill: a reader allocates a whole chunk before reading it.
fn holdable(opened: H5Dataset, path: &Path, dataset: &str) -> Result<H5Dataset, FormatsError> {
    let file_bytes = std::fs::metadata(path)
        .map_err(FormatsError::io(path))?
        .len();
    let most = MOST_INFLATED.saturating_mul(file_bytes).max(ALWAYS_HELD);
    let rows = opened.chunk_dims().unwrap_or_default();
    let bytes = rows
        .iter()
        .fold(opened.element_size() as u64, |bytes, rows| {
            bytes.saturating_mul(*rows as u64)
        });
    if bytes <= most {
        return Ok(opened);
    }
    Err(FormatsError::Dataset {
        path: path.into(),
        dataset: dataset.into(),
        expected: format!(
            "chunks of at most {most} bytes, which a file of {file_bytes} bytes can hold"
        ),
        found: format!("chunks of {bytes} bytes"),
    })
}

fn scalar(file: &H5File, path: &Path, dataset: &str) -> Result<f64, FormatsError> {
    let opened = open_followed(file, path, dataset)?;
    let values = opened
        .read_numeric_as::<f64>()
        .or_else(|_| {
            let whole = opened.read_numeric_as::<i64>()?;
            Ok::<_, rust_hdf5::Hdf5Error>(whole.iter().map(|v| *v as f64).collect())
        })
        .map_err(|error| FormatsError::Dataset {
            path: path.into(),
            dataset: dataset.into(),
            expected: "a number".into(),
            found: error.to_string(),
        })?;
    match values[..] {
        [value] if value.is_finite() => Ok(value),
        _ => Err(FormatsError::Dataset {
            path: path.into(),
            dataset: dataset.into(),
            expected: "one finite number".into(),
            found: format!("{values:?}"),
        }),
    }
}

fn unquoted(link: &str) -> Option<&str> {
    ['"', '\'']
        .iter()
        .find_map(|q| link.strip_prefix(*q)?.strip_suffix(*q))
}

/// Parent path and field name of a dataset in any hickle version.
fn split(name: &str) -> (String, String) {
    let mut links: Vec<&str> = name.split('/').filter(|l| !l.is_empty()).collect();
    if links.len() > 1 && matches!(links.last(), Some(&"data" | &"data_0")) {
        links.pop();
    }
    let field = links.pop().unwrap_or_default();
    (links.join("/"), unquoted(field).unwrap_or(field).to_owned())
}

/// The dictionary keys and list indices in a path.
fn display_name(parent: &str) -> String {
    let links = parent.split('/').filter_map(|link| {
        let index = link
            .strip_prefix("data")
            .filter(|i| !i.is_empty() && *i != "_0");
        unquoted(link).or(index)
    });
    links.collect::<Vec<_>>().join("/")
}

/// Error that describes a file without a dvs dictionary.
fn explain(
    path: &Path,
    names: &[String],
    parents: &BTreeMap<String, BTreeMap<String, String>>,
) -> FormatsError {
    const CONVERT: &str = "not read: convert it to Prophesee RAW or to a bimvee container first";
    let has =
        |parent: &str, field: &str| parents.get(parent).is_some_and(|m| m.contains_key(field));
    let partial = parents
        .values()
        .filter(|members| members.contains_key("ts") || members.contains_key("pol"))
        .max_by_key(|members| FIELDS.iter().filter(|f| members.contains_key(**f)).count());
    let found = if ["t", "x", "y", "p"].iter().all(|f| has("events", f)) {
        format!(
            "events/t, x, y, p (the layout of DSEC and of Metavision's tools), which is {CONVERT}"
        )
    } else if has("CD", "events") {
        format!("CD/events (the layout of Metavision's HDF5 files), which is {CONVERT}")
    } else if let Some(members) = partial {
        let missing: Vec<_> = FIELDS
            .iter()
            .filter(|f| !members.contains_key(**f))
            .collect();
        let there: Vec<_> = members.values().cloned().collect();
        format!("{} without {missing:?} beside them", there.join(", "))
    } else if names.is_empty() {
        "no datasets at all".into()
    } else {
        let mut list: Vec<_> = names.iter().take(8).cloned().collect();
        if names.len() > list.len() {
            list.push(format!("and {} more", names.len() - list.len()));
        }
        format!("datasets {}", list.join(", "))
    };
    FormatsError::Container {
        path: path.into(),
        expected: "a bimvee container: a dictionary with ts, x, y and pol".into(),
        found,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_of_all_layouts_give_field_and_name() {
        for (link, parent, field, name) in [
            ("data/\"ts\"", "data", "ts", ""),
            ("data/'ts'/data", "data", "ts", ""),
            ("data_0/'x'/data_0", "data_0", "x", ""),
            ("ts", "", "ts", ""),
            ("data/data1/\"pol\"", "data/data1", "pol", "1"),
            (
                "data/'data'/data/'ch0'/data/'dvs'/data/'y'/data",
                "data/'data'/data/'ch0'/data/'dvs'/data",
                "y",
                "data/ch0/dvs",
            ),
        ] {
            assert_eq!(split(link), (parent.to_owned(), field.to_owned()), "{link}");
            assert_eq!(display_name(parent), name, "{link}");
        }
    }
}
