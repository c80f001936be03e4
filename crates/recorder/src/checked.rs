//! Opens a session whose rows agree with its seal or, without one, with each other.

use std::path::Path;

use crate::digest::{digest_table, digest_tables, sealed_tables, tree_hash};
use crate::error::RecorderError;
use crate::reader::SessionReader;
use crate::verify::check_unsealed;

/// Tables with many rows, that a description of a session does not need.
const BULK: [&str; 6] = [
    "pose_block",
    "mark",
    "box_report",
    "chunk",
    "gap",
    "trigger_edge",
];

impl SessionReader {
    /// Opens a session to compute results. Compares the rows of a sealed one with its seal, and those of an unsealed one with each other:
    /// the plan with the presses, the poses with the measured values. The stored bytes of cameras and poses have checksums of their own,
    /// which are compared when they are read.
    ///
    /// # Errors
    /// Those of [`open`](Self::open); [`RecorderError::Changed`]; [`RecorderError::Contradictory`].
    pub fn open_checked(path: impl AsRef<Path>) -> Result<Self, RecorderError> {
        let reader = Self::open(path)?;
        if !reader.compare_with_seal()? {
            check_unsealed(&reader)?;
        }
        Ok(reader)
    }

    /// Opens a session to describe it. Compares the journal of a sealed one with its seal, not the rows of camera bytes, poses and
    /// edges, of which there are many; an unsealed one may be growing or damaged.
    ///
    /// # Errors
    /// Those of [`open`](Self::open); [`RecorderError::Changed`].
    pub fn open_unchanged(path: impl AsRef<Path>) -> Result<Self, RecorderError> {
        let reader = Self::open(path)?;
        reader.compare_journal_with_seal()?;
        Ok(reader)
    }

    /// True for rows that are those of the seal, false without a seal.
    fn compare_with_seal(&self) -> Result<bool, RecorderError> {
        let seal = self.seal_row()?;
        let tables = self.query("checking the seal", async |conn| {
            let recorded = sealed_tables(conn).await?;
            // A power cut leaves them behind without a seal.
            if seal.is_none() && recorded.is_empty() {
                return Ok(Vec::new());
            }
            let found = digest_tables(conn).await?;
            let differ = found.iter().filter(|table| !recorded.contains(table));
            let mut names: Vec<String> = differ.map(|table| table.name.clone()).collect();
            let tree_sha256 = seal.as_ref().map(|seal| seal.tree_sha256);
            if names.is_empty() && tree_sha256.is_some_and(|sealed| tree_hash(&found) != sealed) {
                names.push("seal".to_owned());
            }
            Ok(names)
        })?;
        self.unchanged(tables)?;
        Ok(seal.is_some())
    }

    fn compare_journal_with_seal(&self) -> Result<(), RecorderError> {
        let seal = self.seal_row()?;
        let tables = self.query("checking the seal", async |conn| {
            let mut names = Vec::new();
            let recorded = sealed_tables(conn).await?;
            if seal.is_some_and(|seal| tree_hash(&recorded) != seal.tree_sha256) {
                names.push("seal".to_owned());
            }
            for recorded in recorded {
                let is_journal = !BULK.contains(&recorded.name.as_str());
                if is_journal
                    && digest_table(conn, &recorded.name, |_| {}).await?.as_ref() != Some(&recorded)
                {
                    names.push(recorded.name);
                }
            }
            Ok(names)
        })?;
        self.unchanged(tables)
    }

    /// An error if these tables differ from the seal.
    fn unchanged(&self, tables: Vec<String>) -> Result<(), RecorderError> {
        if tables.is_empty() {
            return Ok(());
        }
        Err(RecorderError::Changed {
            path: self.path().to_owned(),
            tables,
        })
    }
}
