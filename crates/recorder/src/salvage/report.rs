//! What a salvage brought back.

use std::path::Path;

use serde::Serialize;
use skinrig_model::CameraId;

use crate::error::RecorderError;

/// What came back.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct SalvageReport {
    /// Rows by table, in the order of the schema; tables of which nothing is known are absent.
    pub tables: Vec<SalvagedTable>,
    /// Camera bytes that did not come back.
    pub lost: Vec<LostBytes>,
    /// What else is wrong with the file, in words.
    pub findings: Vec<String>,
    /// Lower-case hex SHA-256 of the damaged file as it was read.
    pub source_sha256: String,
}

/// The rows of one table.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SalvagedTable {
    /// Its name.
    pub name: String,
    /// Rows that are in the new file.
    pub rows: u64,
    /// Rows that are known to be missing from it; more may be.
    pub missing: u64,
}

/// Chunks of a camera that did not come back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct LostBytes {
    /// Whose.
    pub camera: CameraId,
    /// The first of them.
    pub first_seq: u64,
    /// The last of them.
    pub last_seq: u64,
    /// How many bytes, when every one of them still tells.
    pub bytes: Option<u64>,
}

impl SalvageReport {
    /// True when nothing is known to be lost.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.lost.is_empty()
            && self.findings.is_empty()
            && self.tables.iter().all(|t| t.missing == 0)
    }
}

/// The operating system refused.
pub(super) fn io(path: &Path, doing: &'static str, source: std::io::Error) -> RecorderError {
    RecorderError::Io {
        path: path.to_owned(),
        doing,
        source,
    }
}
