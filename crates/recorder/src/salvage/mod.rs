//! Brings back what a damaged session file still holds: every row whose bytes are whole, into a new file.
//!
//! SQLite gives up on a file of which one page is damaged. Here every page of the file and of its log is looked at for itself:
//! a row is known by its shape, and camera bytes and poses by the SHA-256 beside them, so that neither the tree that leads to a
//! page nor the schema is needed. What does not come back is told, and lost camera bytes become gaps in the stream, so that an
//! analysis leaves out the presses that they touch.

mod cells;
mod fill;
mod gather;
mod missing;
mod pages;
mod report;
mod shapes;

use std::io::Read;
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::beside::{beside, refuse_special_files};
use crate::error::RecorderError;
use crate::hex::hex;
use crate::query::Fault;
use crate::schema;

use self::fill::Filling;
use self::pages::Pages;
use self::report::io;
pub use self::report::{LostBytes, SalvageReport, SalvagedTable};

/// Copies all that is whole of the session `from`, and of the log beside it, into the new file `to`, which is left unsealed. `from` is
/// only read.
///
/// # Errors
/// [`RecorderError::Exists`] when there is a file `to`; [`RecorderError::NotASession`] when nothing of a session is found;
/// [`RecorderError::Io`] when a file cannot be read or written.
pub fn salvage(from: &Path, to: &Path) -> Result<SalvageReport, RecorderError> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .map_err(|source| io(from, "starting to read it", source))?;
    refuse_special_files(from)?;
    let log = beside(from, "-wal");
    let source_sha256 = sha256_of(from)?;
    let mut pages = Pages::open(from, &log).map_err(|e| io(from, "reading it", e))?;
    runtime.block_on(async {
        let mut conn = schema::create(to).await?;
        let fault = |e: Fault| e.at(to, "writing what was salvaged");
        let shapes = shapes::shapes(&mut conn).await.map_err(fault)?;
        let rows = gather::gather(&mut pages, &shapes).map_err(|e| io(from, "reading it", e))?;
        if rows.iter().all(|r| r.rows.is_empty()) {
            drop(conn);
            for file in [
                to.to_owned(),
                beside(to, "-wal"),
                beside(to, "-shm"),
            ] {
                let _ = std::fs::remove_file(file);
            }
            return Err(RecorderError::NotASession {
                path: from.to_owned(),
                found: "no row of any table of a session".to_owned(),
            });
        }
        let name = from.file_name().map(|n| n.to_string_lossy().into_owned());
        let mut report = SalvageReport {
            source_sha256,
            ..SalvageReport::default()
        };
        if pages.damaged_frames > 0 {
            let n = pages.damaged_frames;
            report.findings.push(format!(
                "the log: {n} page(s) with a wrong checksum, damaged or left of a transaction that was never committed"
            ));
        }
        if pages.cut_bytes > 0 {
            report.findings.push(format!(
                "{} bytes after the last whole page",
                pages.cut_bytes
            ));
        }
        let mut filling = Filling {
            conn: &mut conn,
            pages: &mut pages,
            shapes: &shapes,
            rows: &rows,
            report: &mut report,
        };
        filling
            .fill(&name.unwrap_or_default())
            .await
            .map_err(|e| e.at(from, to))?;
        use sqlx::Connection;
        conn.close().await.map_err(|e| fault(e.into()))?;
        Ok(report)
    })
}

fn sha256_of(path: &Path) -> Result<String, RecorderError> {
    let mut file = std::fs::File::open(path).map_err(|source| {
        if source.kind() == std::io::ErrorKind::NotFound {
            RecorderError::Missing {
                path: path.to_owned(),
            }
        } else {
            io(path, "reading it", source)
        }
    })?;
    let (mut hash, mut block) = (Sha256::new(), vec![0u8; 1 << 20]);
    loop {
        match file
            .read(&mut block)
            .map_err(|e| io(path, "reading it", e))?
        {
            0 => return Ok(hex(&hash.finalize())),
            n => hash.update(&block[..n]),
        }
    }
}
