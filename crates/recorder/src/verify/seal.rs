//! The seal, held against the rows and the bytes that it covers.

use std::path::Path;

use super::report::VerifyReport;
use crate::digest::{TableDigest, digest_tables, tree_of};
use crate::hex::hex;
use crate::lock::WriterLock;
use crate::query::{each_row, int, num, sha, text};
use crate::reader::SessionReader;
use crate::seal::{self, Stamp};

/// Checks counts, digests, tree hash and file hash. A seal whose file hash was not yet written seals nothing, but what it says of
/// the rows must hold.
pub fn check(reader: &SessionReader, report: &mut VerifyReport) {
    let Some(Some(seal)) = report.take(reader.seal_row()) else {
        return;
    };
    if let Some(totals) = report.totals {
        report.equal("seal: counts", &totals, &seal.totals);
    }
    let read = reader.ask("checking the seal", async |conn| {
        let mut recorded = Vec::new();
        let query = sqlx::query("SELECT name, rows, sha256 FROM table_digest");
        each_row(query, conn, |row| {
            recorded.push(TableDigest {
                name: text(row, "name")?,
                rows: int(row, "rows")?,
                sha256: sha(row, "sha256")?,
            });
            Ok(())
        })
        .await?;
        let computed = digest_tables(conn).await?;
        Ok((recorded, computed, seal::seal_page(conn).await?))
    });
    let Some((recorded, computed, page)) = report.take(read) else {
        report.sealed = true;
        return;
    };
    for table in &computed {
        if !recorded.contains(table) {
            report.add(format!(
                "{}: rows are not those that were sealed",
                table.name
            ));
        }
    }
    report.equal("seal: tables", &computed.len(), &recorded.len());
    report.equal(
        "seal: tree hash",
        &hex(&tree_of(&computed)),
        &hex(&seal.tree_sha256),
    );
    let stamp = seal::check_stamp(reader.path(), page, &seal.file_sha256, &seal.tree_sha256);
    report.sealed = !matches!(stamp, Ok(Stamp::CutOff));
    match stamp {
        Ok(Stamp::Whole) => {}
        Ok(Stamp::CutOff) => report.remarks.push(
            "sealing was cut off before the hash of the file was written: `skinrig resume` finishes it".to_owned(),
        ),
        Ok(Stamp::Wrong(found)) => {
            report.equal("seal: file hash", &hex(&seal.file_sha256), &hex(&found));
        }
        Ok(Stamp::Misplaced) => {
            report.add("seal: file hash: expected once on the seal's page, found otherwise");
        }
        Err(e) => report.add(format!("seal: file hash: {e}")),
    }
    let ends = reader.ask("counting ends", async |conn| {
        let row = sqlx::query("SELECT count(*) AS n FROM run_end")
            .fetch_one(conn)
            .await?;
        num::<u64>(&row, "n")
    });
    if report.take(ends) == Some(0) {
        report.add("seal: expected the run's end in a sealed session, found none");
    }
}

/// Makes a sealed file read-only that can still be written: its writer ended just before it did so, or one that wanted to go on with it.
pub(crate) fn protect(path: &Path, report: &mut VerifyReport) {
    let is_writable = || std::fs::metadata(path).is_ok_and(|m| !m.permissions().readonly());
    if !is_writable() {
        return;
    }
    // Nobody is about to take the seal off.
    let Ok(_lock) = WriterLock::take(path) else {
        return;
    };
    let protected = std::fs::metadata(path).and_then(|metadata| {
        let mut permissions = metadata.permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(path, permissions)
    });
    report.remarks.push(match protected {
        Ok(()) => "the sealed file could still be written, and was made read-only now".to_owned(),
        Err(e) => {
            format!("the sealed file can still be written, and could not be made read-only: {e}")
        }
    });
}
