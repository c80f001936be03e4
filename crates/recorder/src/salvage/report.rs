//! Result of a salvage.

use std::path::Path;

use serde::Serialize;
use skinrig_model::CameraId;

use crate::error::RecorderError;

/// Result of a salvage.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct SalvageReport {
    /// Row counts by table, in schema order, without tables of unknown row counts.
    pub tables: Vec<SalvagedTable>,
    /// Lost camera bytes.
    pub lost: Vec<LostBytes>,
    /// Other damage.
    pub findings: Vec<String>,
    /// Tables with all rows, of which some have other values than those that were sealed.
    pub changed: Vec<String>,
    /// Number of values that contradict others of which none is lost: the file was changed.
    pub contradictions: u64,
    /// Lower-case hex SHA-256 of the damaged file.
    pub source_sha256: String,
}

/// Row counts of one table.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SalvagedTable {
    /// Name of the table.
    pub name: String,
    /// Rows in the new file.
    pub rows: u64,
    /// Rows known to be missing; there may be more.
    pub missing: u64,
}

/// Consecutive lost chunks of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct LostBytes {
    /// Camera of the chunks.
    pub camera: CameraId,
    /// Number of the first lost chunk.
    pub first_seq: u64,
    /// Number of the last lost chunk.
    pub last_seq: u64,
    /// Bytes lost, if the size of every chunk is known.
    pub bytes: Option<u64>,
}

impl SalvageReport {
    /// True if no loss is known.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.lost.is_empty()
            && self.findings.is_empty()
            && self.tables.iter().all(|t| t.missing == 0)
    }
}

/// Error of an operating system call.
pub(super) fn io(path: &Path, doing: &'static str, source: std::io::Error) -> RecorderError {
    RecorderError::Io {
        path: path.to_owned(),
        doing,
        source,
    }
}
