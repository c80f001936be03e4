//! Verification of the seal against the rows and bytes that it covers.

use std::path::Path;
use std::sync::mpsc::Receiver;

use super::report::VerifyReport;
use crate::digest::{TableDigest, digest_tables, digest_tables_beside, sealed_tables, tree_hash};
use crate::hex::hex;
use crate::lock::WriterLock;
use crate::object::{SessionReference, open_bytes};
use crate::query::num;
use crate::reader::SessionReader;
use crate::seal::{self, Stamp};

/// Checks counts, digests, tree hash and file hash. A seal without its file hash seals nothing, but its counts and digests must
/// match the rows; so must digests without a seal. `edges` gives the digest of `trigger_edge`, or `None`.
pub(super) fn check(
    reader: &SessionReader,
    edges: &Receiver<Option<TableDigest>>,
    report: &mut VerifyReport,
) {
    report.totals = report.ok_or_add(reader.totals());
    let Some(seal) = report.ok_or_add(reader.seal_row()) else {
        return;
    };
    let Some(seal) = seal else {
        check_digests_alone(reader, report);
        return;
    };
    if let Some(totals) = report.totals {
        report.expect_equal("seal: counts", &totals, &seal.totals);
    }
    let mut stamp = None;
    let read = reader.query("checking the seal", async |conn| {
        let recorded = sealed_tables(conn).await?;
        let page = seal::seal_page(conn).await;
        // Before the digests: another thread reads the largest of these tables meanwhile.
        if let Ok(page) = page {
            let bytes = open_bytes(reader.path()).map_err(std::io::Error::other);
            stamp = Some(bytes.and_then(|mut bytes| {
                seal::check_stamp(&mut *bytes, page, &seal.file_sha256, &seal.tree_sha256)
            }));
        }
        // A digest other than the recorded one may be of a moment before the seal.
        let edges = edges.recv().ok().flatten();
        let edges = edges.filter(|table| recorded.contains(table));
        let computed = digest_tables_beside(conn, edges).await?;
        page?;
        Ok((recorded, computed))
    });
    let (Some((recorded, computed)), Some(stamp)) = (report.ok_or_add(read), stamp) else {
        report.sealed = true;
        return;
    };
    compare_digests(&recorded, &computed, report);
    report.expect_equal(
        "seal: tree hash",
        &hex(&tree_hash(&computed)),
        &hex(&seal.tree_sha256),
    );
    report.sealed = !matches!(stamp, Ok(Stamp::CutOff));
    match stamp {
        Ok(Stamp::Whole) => {}
        Ok(Stamp::CutOff) => report.remarks.push(
            "sealing was interrupted before the file hash was written: `skinrig resume` finishes it".to_owned(),
        ),
        Ok(Stamp::Wrong(found)) => {
            report.expect_equal("seal: file hash", &hex(&seal.file_sha256), &hex(&found));
        }
        Ok(Stamp::Misplaced) => {
            report.mismatch(
                "seal: file hash",
                "it exactly once on the page of the seal",
                "it missing or repeated",
            );
        }
        Err(e) => report.mismatch("seal: file hash", "a readable file", e),
    }
    let ends = reader.query("counting ends", async |conn| {
        let row = sqlx::query("SELECT count(*) AS n FROM run_end")
            .fetch_one(conn)
            .await?;
        num::<u64>(&row, "n")
    });
    if report.ok_or_add(ends) == Some(0) {
        report.mismatch("seal", "the run's end in a sealed session", "none");
    }
}

/// Compares the rows with digests whose seal is missing. Both are written at once, and a further leg removes both.
fn check_digests_alone(reader: &SessionReader, report: &mut VerifyReport) {
    let read = reader.query("checking the digests of its tables", async |conn| {
        let recorded = sealed_tables(conn).await?;
        let computed = match recorded.is_empty() {
            true => Vec::new(),
            false => digest_tables(conn).await?,
        };
        Ok((recorded, computed))
    });
    if let Some((recorded, computed)) = report.ok_or_add(read) {
        compare_digests(&recorded, &computed, report);
    }
}

fn compare_digests(recorded: &[TableDigest], computed: &[TableDigest], report: &mut VerifyReport) {
    for table in computed {
        if !recorded.contains(table) {
            report.mismatch(&table.name, "the sealed rows", "other rows");
        }
    }
    report.expect_equal("seal: tables", &computed.len(), &recorded.len());
}

/// Makes a sealed but writable file read-only. Its writer ended just before it did so, or just after it began to resume the session.
pub(crate) fn protect(path: &Path, report: &mut VerifyReport) {
    let is_writable = std::fs::metadata(path).is_ok_and(|m| !m.permissions().readonly());
    // Objects never change, and their references are replaced.
    if !is_writable || matches!(SessionReference::of(path), Ok(Some(_))) {
        return;
    }
    // Only if no writer is about to remove the seal.
    let Ok(_lock) = WriterLock::take(path) else {
        return;
    };
    let protected = std::fs::metadata(path).and_then(|metadata| {
        let mut permissions = metadata.permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(path, permissions)
    });
    report.remarks.push(match protected {
        Ok(()) => "the sealed file was still writable; it is read-only now".to_owned(),
        Err(e) => {
            format!("the sealed file is still writable, and could not be made read-only: {e}")
        }
    });
}
