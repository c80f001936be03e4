//! Salvage: copies every intact row of a damaged session into a new file.
//!
//! SQLite rejects a file with a single damaged page. So the salvage examines each page of the file and of its log separately. It
//! identifies rows by their shape, and camera bytes and poses by the SHA-256 beside them, without using the page tree or the stored
//! schema. It lists all losses; lost camera bytes become gaps in the stream, so that the analysis excludes the affected
//! presses.

mod cells;
mod gather;
mod missing;
mod pages;
mod report;
mod shapes;
mod writer;

use std::io::Read;
use std::path::Path;

use sha2::{Digest, Sha256};

use crate::error::RecorderError;
use crate::hex::hex;
use crate::object::SessionReference;
use crate::query::Fault;
use crate::reader::SessionReader;
use crate::schema;
use crate::sidecar::{reject_special_files, sidecar_path};
use crate::verify::check_unsealed;

use self::pages::Pages;
use self::report::io;
pub use self::report::{LostBytes, SalvageReport, SalvagedTable};
use self::writer::SalvageWriter;

/// Copies all intact rows of the session `from` and its log into the new file `to`, which stays unsealed. `from` is
/// only read.
///
/// # Errors
/// [`RecorderError::Exists`] if `to` exists; [`RecorderError::NotASession`] if no row of a session is found;
/// [`RecorderError::Io`] if a file cannot be read or written.
pub fn salvage(from: &Path, to: &Path) -> Result<SalvageReport, RecorderError> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .map_err(|source| io(from, "starting to read it", source))?;
    reject_special_files(from)?;
    if let Some(reference) = SessionReference::of(from)? {
        return Err(RecorderError::Referred {
            path: from.to_owned(),
            url: reference.url,
        });
    }
    let log = sidecar_path(from, "-wal");
    let source_sha256 = sha256_of(from)?;
    let mut pages = Pages::open(from, &log).map_err(|e| io(from, "reading it", e))?;
    let mut report = runtime.block_on(async {
        let mut conn = schema::create(to).await?;
        let fault = |e: Fault| e.at(to, "writing the salvaged rows");
        let shapes = shapes::shapes(&mut conn).await.map_err(fault)?;
        let rows = gather::gather(&mut pages, &shapes).map_err(|e| io(from, "reading it", e))?;
        if rows.iter().all(|r| r.rows.is_empty()) {
            drop(conn);
            for file in [
                to.to_owned(),
                sidecar_path(to, "-wal"),
                sidecar_path(to, "-shm"),
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
                "the log: {n} page(s) with a wrong checksum: damaged, or from a transaction that was never committed"
            ));
        }
        if pages.cut_bytes > 0 {
            report.findings.push(format!(
                "{} bytes after the last whole page",
                pages.cut_bytes
            ));
        }
        let mut filling = SalvageWriter {
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
        Ok::<_, RecorderError>(report)
    })?;
    find_contradictions(to, &mut report)?;
    Ok(report)
}

/// Compares the rows of the new file with each other: numbers of an unsealed session have no checksum, but the poses have.
fn find_contradictions(to: &Path, report: &mut SalvageReport) -> Result<(), RecorderError> {
    let checked = SessionReader::open(to).and_then(|reader| check_unsealed(&reader));
    match checked {
        Err(RecorderError::Contradictory {
            first, problems, ..
        }) => {
            if report.is_whole() {
                report.contradictions = problems;
            }
            let others = match problems {
                1 => "a value contradicts others".to_owned(),
                n => format!("{n} values contradict others, the first"),
            };
            report.findings.push(format!("{others}: {first}"));
            Ok(())
        }
        // A header that is lost is among the losses.
        Err(e) if e.is_system_failure() => Err(e),
        _ => Ok(()),
    }
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
