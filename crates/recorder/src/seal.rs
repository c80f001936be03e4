//! The seal: a tree hash over the content, and a hash over every byte of the file that contains it.
//!
//! The file contains its own hash. So the seal's row is first written with a 32-byte placeholder. After SQLite has closed
//! the file, the placeholder is located on the page of table `seal`, the file is hashed with those 32 bytes as zero,
//! and the hash replaces the placeholder.

use std::fs::OpenOptions;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

use sha2::{Digest, Sha256};
use sqlx::sqlite::SqliteConnection;

use crate::digest::{digest_tables, tree_hash};
use crate::object::ReadSeek;
use crate::query::Fault;
use crate::rows::SessionTotals;

/// Writes the rows of the seal, with a placeholder for the file hash, in one transaction.
/// Returns (tree hash, placeholder).
pub(crate) async fn write_rows(
    conn: &mut SqliteConnection,
    totals: &SessionTotals,
) -> Result<([u8; 32], [u8; 32]), Fault> {
    let digests = digest_tables(conn).await?;
    let tree = tree_hash(&digests);
    let placeholder = placeholder_of(&tree);
    sqlx::query("BEGIN IMMEDIATE").execute(&mut *conn).await?;
    for table in &digests {
        sqlx::query("INSERT INTO table_digest (name, rows, sha256) VALUES (?, ?, ?)")
            .bind(&table.name)
            .bind(table.rows)
            .bind(table.sha256.as_slice())
            .execute(&mut *conn)
            .await?;
    }
    let mut insert = sqlx::query(
        "INSERT INTO seal (id, planned, valid, missed, invalid, excluded, sync_planned, sync_valid,
           sync_missed, sync_invalid, sync_excluded, chunks, raw_bytes, stored_bytes, lost_bytes, cd_events,
           trigger_edges, pose_samples, tree_sha256, file_sha256)
         VALUES (1, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    );
    for t in [&totals.presses, &totals.sync] {
        for n in [t.planned, t.valid, t.missed, t.invalid, t.excluded] {
            insert = insert.bind(n as i64);
        }
    }
    for n in [
        totals.chunks,
        totals.raw_bytes,
        totals.stored_bytes,
        totals.lost_bytes,
        totals.cd_events,
        totals.trigger_edges,
        totals.pose_samples,
    ] {
        insert = insert.bind(n as i64);
    }
    insert
        .bind(tree.as_slice())
        .bind(placeholder.as_slice())
        .execute(&mut *conn)
        .await?;
    sqlx::query("COMMIT").execute(&mut *conn).await?;
    Ok((tree, placeholder))
}

/// Placeholder for the file hash.
pub(crate) fn placeholder_of(tree: &[u8; 32]) -> [u8; 32] {
    let mut hash = Sha256::new();
    hash.update(b"skinrig: the file hash goes here");
    hash.update(tree);
    hash.finalize().into()
}

/// Page number of table `seal`, from 1.
pub(crate) async fn seal_page(conn: &mut SqliteConnection) -> Result<u32, Fault> {
    let row =
        sqlx::query("SELECT rootpage FROM sqlite_schema WHERE type = 'table' AND name = 'seal'")
            .fetch_one(conn)
            .await?;
    crate::query::num(&row, "rootpage")
}

/// Replaces `placeholder` on page `page` of the closed file with the file's hash, and returns the hash.
pub(crate) fn stamp(path: &Path, page: u32, placeholder: &[u8; 32]) -> std::io::Result<[u8; 32]> {
    let mut file = OpenOptions::new().read(true).write(true).open(path)?;
    let at = locate(&mut file, page, placeholder)?.ok_or_else(|| {
        std::io::Error::other("expected the placeholder exactly once on the page of the seal")
    })?;
    let digest = hash_around(&mut file, at)?;
    file.seek(SeekFrom::Start(at))?;
    file.write_all(&digest)?;
    file.sync_all()?;
    Ok(digest)
}

/// State of the file hash in a sealed file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stamp {
    /// Complete, and it matches the file.
    Whole,
    /// Sealing was interrupted: the file still has the placeholder, or the first bytes of the hash followed by the rest of the
    /// placeholder.
    CutOff,
    /// It differs; the actual hash of the file.
    Wrong([u8; 32]),
    /// The recorded hash is not exactly once on the page of the seal.
    Misplaced,
}

/// Compares the file hash `recorded` on page `page` with the file, whose recorded tree hash is `tree`.
pub(crate) fn check_stamp(
    file: &mut dyn ReadSeek,
    page: u32,
    recorded: &[u8; 32],
    tree: &[u8; 32],
) -> std::io::Result<Stamp> {
    let Some(at) = locate(file, page, recorded)? else {
        return Ok(Stamp::Misplaced);
    };
    let found = hash_around(file, at)?;
    let placeholder = placeholder_of(tree);
    let written =
        (0..32).find(|n| recorded[..*n] == found[..*n] && recorded[*n..] == placeholder[*n..]);
    Ok(match written {
        _ if found == *recorded => Stamp::Whole,
        Some(_) => Stamp::CutOff,
        None => Stamp::Wrong(found),
    })
}

/// Offset of `needle` in the file, if page `page` contains it exactly once.
fn locate(file: &mut dyn ReadSeek, page: u32, needle: &[u8; 32]) -> std::io::Result<Option<u64>> {
    let mut head = [0u8; 18];
    file.seek(SeekFrom::Start(0))?;
    file.read_exact(&mut head)?;
    // Page size: bytes 16 and 17, big-endian, 1 for 65536 (sqlite.org/fileformat.html section 1.3.2).
    let page_bytes = match u16::from_be_bytes([head[16], head[17]]) {
        1 => 65536,
        n => u64::from(n),
    };
    let start = u64::from(page).saturating_sub(1) * page_bytes;
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(start))?;
    Read::take(file, page_bytes).read_to_end(&mut bytes)?;
    let mut found = bytes
        .windows(needle.len())
        .enumerate()
        .filter(|(_, w)| w == needle);
    Ok(match (found.next(), found.next()) {
        (Some((at, _)), None) => Some(start + at as u64),
        _ => None,
    })
}

/// SHA-256 of the file with the 32 bytes at `at` as zero.
fn hash_around(file: &mut dyn ReadSeek, at: u64) -> std::io::Result<[u8; 32]> {
    let mut hash = Sha256::new();
    let mut buffer = vec![0u8; 1 << 20];
    let mut position = 0u64;
    file.seek(SeekFrom::Start(0))?;
    loop {
        let n = file.read(&mut buffer)?;
        if n == 0 {
            return Ok(hash.finalize().into());
        }
        let end = position + n as u64;
        let (from, to) = (at.max(position), (at + 32).min(end));
        if from < to {
            buffer[(from - position) as usize..(to - position) as usize].fill(0);
        }
        hash.update(&buffer[..n]);
        position = end;
    }
}
