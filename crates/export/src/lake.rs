//! Owns the data lake: a Parquet dataset of many sessions in hive partitions, to which sessions are only added.
//!
//! `TABLE/analysis=N/prototype=P/bench=B/day=D/SESSION.parquet` has the rows of one session. All tables of a session are written
//! aside and renamed; its commit, the last file, makes it part of the lake and has their hashes.
//! Adding a session again changes nothing, unless one of its tables is damaged.

use std::collections::BTreeMap;
use std::fs;
use std::io::{ErrorKind, Read as _};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::error::ExportError;
use crate::folder::Folder;
use crate::lake_tables::{LakeTables, TABLES};
use crate::source::{Source, TableName};

/// Folder of the commits.
const COMMITS: &str = "_commits";
/// Folder of files that are being written.
const STAGING: &str = "_staging";

/// Where the rows of a session belong.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Partition {
    /// Version of the analysis.
    pub analysis: u32,
    /// Prototype.
    pub prototype: String,
    /// Name of the rig.
    pub bench: String,
    /// UTC day of the start: year-month-day.
    pub day: String,
}

/// A session in a lake.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct LakeCommit {
    /// ID of the session.
    pub session_id: String,
    /// Hash of its seal.
    pub content_sha256: String,
    /// Its partition.
    pub partition: Partition,
}

/// A commit as stored: the session and its tables.
#[derive(Debug, Serialize, Deserialize)]
struct StoredCommit {
    #[serde(flatten)]
    session: LakeCommit,
    /// SHA-256 of each table's file, lower-case hex.
    #[serde(default)]
    tables_sha256: BTreeMap<String, String>,
}

/// State of a session in a lake.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LakeState {
    /// Nothing.
    Absent,
    /// All of its tables, as they were written.
    Whole,
    /// A commit, but this table is missing or not as it was written.
    Damaged(PathBuf),
}

/// A Parquet dataset of sessions.
#[derive(Debug, Clone)]
pub struct Lake {
    root: PathBuf,
}

impl Partition {
    /// Its folders, in hive notation.
    fn path(&self) -> PathBuf {
        let Self {
            analysis,
            prototype,
            bench,
            day,
        } = self;
        [
            format!("analysis={analysis}"),
            format!("prototype={}", escaped(prototype)),
            format!("bench={}", escaped(bench)),
            format!("day={}", escaped(day)),
        ]
        .iter()
        .collect()
    }
}

impl Lake {
    /// Opens the lake in the folder `root`, which is created with the first session.
    #[must_use]
    pub fn new(root: &Path) -> Self {
        Self {
            root: root.to_owned(),
        }
    }

    /// State of the session with this analysis. Reads the tables that the commit names.
    ///
    /// # Errors
    /// [`ExportError::OtherContent`] if it has the session with another content; [`ExportError::File`] when a commit or a table
    /// cannot be read.
    pub fn state(&self, commit: &LakeCommit) -> Result<LakeState, ExportError> {
        let path = self.commit_path(commit);
        let text = match fs::read(&path) {
            Ok(text) => text,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(LakeState::Absent),
            Err(e) => return Err(ExportError::file(&path)(e)),
        };
        let Ok(found) = serde_json::from_slice::<StoredCommit>(&text) else {
            return Ok(LakeState::Damaged(path));
        };
        if found.session != *commit {
            return Err(ExportError::OtherContent {
                path,
                session_id: commit.session_id.clone(),
            });
        }
        for table in TABLES {
            let file = self.table_path(table, commit);
            let expected = found.tables_sha256.get(table);
            if expected.is_none() || expected != sha256_of(&file)?.as_ref() {
                return Ok(LakeState::Damaged(file));
            }
        }
        Ok(LakeState::Whole)
    }

    /// Adds a session, whose analysis `source` has, if it is not there; a damaged one is written again.
    ///
    /// # Errors
    /// As [`Lake::state`]; when the session cannot be read or a file cannot be written. Then the session is not part of the lake, and
    /// can be added again.
    pub fn add(&self, source: &Source<'_>, commit: &LakeCommit) -> Result<(), ExportError> {
        if self.state(commit)? == LakeState::Whole {
            return Ok(());
        }
        let staging = self.staging()?;
        let added = self.add_from(&staging, source, commit);
        // Leftovers are not part of the lake.
        let _ = fs::remove_dir_all(&staging);
        added
    }

    fn add_from(
        &self,
        staging: &Path,
        source: &Source<'_>,
        commit: &LakeCommit,
    ) -> Result<(), ExportError> {
        let folder = Folder::new(staging, &commit.session_id, true)?;
        let mut tables = LakeTables::new(folder.clone(), &commit.session_id);
        for table in [TableName::Presses, TableName::Results, TableName::Pose] {
            source.write(table, &mut tables)?;
        }
        let mut tables_sha256 = BTreeMap::new();
        for table in TABLES {
            let to = self.table_path(table, commit);
            if let Some(folder) = to.parent() {
                fs::create_dir_all(folder).map_err(ExportError::file(folder))?;
            }
            let from = folder.file(&format!(".{table}.parquet"));
            tables_sha256.extend(sha256_of(&from)?.map(|hash| (table.to_owned(), hash)));
            fs::rename(&from, &to).map_err(ExportError::file(&to))?;
        }
        let to = self.commit_path(commit);
        let commits = self.root.join(COMMITS);
        fs::create_dir_all(&commits).map_err(ExportError::file(&commits))?;
        let stored = StoredCommit {
            session: commit.clone(),
            tables_sha256,
        };
        let text = serde_json::to_vec_pretty(&stored).map_err(ExportError::file(&to))?;
        folder.write_atomic(".commit", |path| {
            fs::write(path, &text).map_err(ExportError::file(path))
        })?;
        fs::rename(folder.file(".commit"), &to).map_err(ExportError::file(&to))
    }

    /// A new folder for the files of one session.
    fn staging(&self) -> Result<PathBuf, ExportError> {
        let parent = self.root.join(STAGING);
        fs::create_dir_all(&parent).map_err(ExportError::file(&parent))?;
        let mut n = 0u64;
        loop {
            let folder = parent.join(format!("{}-{n}", std::process::id()));
            match fs::create_dir(&folder) {
                Ok(()) => return Ok(folder),
                Err(e) if e.kind() == ErrorKind::AlreadyExists => n += 1,
                Err(e) => return Err(ExportError::file(&folder)(e)),
            }
        }
    }

    fn table_path(&self, table: &str, commit: &LakeCommit) -> PathBuf {
        let folder = self.root.join(table).join(commit.partition.path());
        folder.join(format!("{}.parquet", commit.session_id))
    }

    fn commit_path(&self, commit: &LakeCommit) -> PathBuf {
        let (id, version) = (&commit.session_id, commit.partition.analysis);
        self.root
            .join(COMMITS)
            .join(format!("{id}.analysis-{version}.json"))
    }
}

/// SHA-256 of a file in lower-case hex; `None` if it does not exist.
fn sha256_of(path: &Path) -> Result<Option<String>, ExportError> {
    let mut file = match fs::File::open(path) {
        Ok(file) => file,
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(ExportError::file(path)(e)),
    };
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 1 << 18];
    loop {
        match file.read(&mut buffer).map_err(ExportError::file(path))? {
            0 => break,
            n => hash.update(&buffer[..n]),
        }
    }
    let hex = hash.finalize().iter().map(|b| format!("{b:02x}")).collect();
    Ok(Some(hex))
}

/// A partition's value as the name of a folder: every byte but letters, digits and `-._` as `%XX`, which readers of hive
/// partitions undo.
fn escaped(value: &str) -> String {
    let mut out = String::new();
    for byte in value.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' => {
                out.push(char::from(byte))
            }
            _ => out.push_str(&format!("%{byte:02X}")),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_partition_is_one_folder_per_key() {
        let partition = Partition {
            analysis: 14,
            prototype: "../mold 3/é=1".to_owned(),
            bench: "..".to_owned(),
            day: "2026-01-31".to_owned(),
        };
        assert_eq!(
            partition.path(),
            Path::new("analysis=14/prototype=..%2Fmold%203%2F%C3%A9%3D1/bench=../day=2026-01-31")
        );
    }
}
