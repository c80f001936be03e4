//! The seal: a tree hash over the content, and a hash over every byte of the file that holds it.
//!
//! The file hash must lie in the file that it covers. So the seal's row is written with a placeholder of
//! 32 bytes in its place; when SQLite has closed the file, the placeholder's position is found in the one page
//! of table `seal`, the file is hashed with those 32 bytes taken as zero, and the hash overwrites them.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

use sha2::{Digest, Sha256};
use sqlx::sqlite::{SqliteConnection, SqliteRow};
use sqlx::{Row, TypeInfo, ValueRef};

use crate::query::{Fault, each_row, has_table};
use crate::rows::SessionTotals;

/// The tables that the tree hash covers, in its order, each with the rows and columns that count. Blobs of
/// camera bytes and poses are covered by the SHA-256 beside them.
const TABLES: [(&str, &str); 19] = [
    ("session", "SELECT * FROM session ORDER BY id"),
    ("leg", "SELECT * FROM leg ORDER BY number"),
    ("robot_from_skin", "SELECT * FROM robot_from_skin ORDER BY axis"),
    ("device", "SELECT * FROM device ORDER BY id"),
    ("setting", "SELECT * FROM setting ORDER BY device, position"),
    ("preflight", "SELECT * FROM preflight ORDER BY id"),
    ("press", "SELECT * FROM press ORDER BY id"),
    ("attempt", "SELECT * FROM attempt ORDER BY press, number"),
    ("command", "SELECT * FROM command ORDER BY id"),
    ("pose_block", "SELECT id, first_ns, last_ns, samples, sha256 FROM pose_block ORDER BY id"),
    ("mark", "SELECT * FROM mark ORDER BY id"),
    ("box_report", "SELECT * FROM box_report ORDER BY id"),
    (
        "chunk",
        "SELECT camera, seq, host_ns, lost_before, codec, raw_bytes, raw_crc32, stored_sha256, first_us,
         last_us, cd_events, on_events, trigger_edges FROM chunk ORDER BY camera, seq",
    ),
    ("gap", "SELECT camera, seq, from_us, to_us FROM gap ORDER BY camera, seq"),
    (
        "trigger_edge",
        "SELECT camera, seq, position, t_us, channel, rising FROM trigger_edge
         ORDER BY camera, seq, position",
    ),
    ("interruption", "SELECT * FROM interruption ORDER BY id"),
    ("note", "SELECT * FROM note ORDER BY id"),
    ("run_end", "SELECT * FROM run_end ORDER BY id"),
    // Which migrations made the schema: name and content, not when or how fast they ran.
    ("_sqlx_migrations", "SELECT version, checksum FROM _sqlx_migrations ORDER BY version"),
];

/// The digest of one table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableDigest {
    pub name: String,
    pub rows: i64,
    pub sha256: [u8; 32],
}

/// The digests of all tables that the file's schema has. A value is hashed as one type byte (0 null, 1 integer, 2 real, 3 text, 4 blob)
/// and its eight little-endian bytes, or its length in eight such bytes and its content.
pub async fn digest_tables(conn: &mut SqliteConnection) -> Result<Vec<TableDigest>, Fault> {
    let mut digests = Vec::with_capacity(TABLES.len());
    for (name, sql) in TABLES {
        // A table that is missing from a sealed file is missed in the tree hash.
        if !has_table(conn, name).await? {
            continue;
        }
        let (mut hash, mut rows, mut bytes) = (Sha256::new(), 0, Vec::new());
        each_row(sqlx::query(sql), conn, |row| {
            rows += 1;
            bytes.clear();
            encode_row(row, &mut bytes)?;
            hash.update(&bytes);
            Ok(())
        })
        .await?;
        digests.push(TableDigest {
            name: name.to_owned(),
            rows,
            sha256: hash.finalize().into(),
        });
    }
    Ok(digests)
}

fn encode_row(row: &SqliteRow, bytes: &mut Vec<u8>) -> Result<(), Fault> {
    for i in 0..row.len() {
        let value = row.try_get_raw(i)?;
        if value.is_null() {
            bytes.push(0);
            continue;
        }
        let kind = value.type_info().name().to_owned();
        let mut push = |tag: u8, head: [u8; 8], content: &[u8]| {
            bytes.push(tag);
            bytes.extend_from_slice(&head);
            bytes.extend_from_slice(content);
        };
        let length = |content: &[u8]| (content.len() as u64).to_le_bytes();
        match kind.as_str() {
            "INTEGER" => push(1, row.try_get_unchecked::<i64, _>(i)?.to_le_bytes(), &[]),
            "REAL" => push(2, row.try_get_unchecked::<f64, _>(i)?.to_le_bytes(), &[]),
            "TEXT" => {
                let text = row.try_get_unchecked::<String, _>(i)?;
                push(3, length(text.as_bytes()), text.as_bytes());
            }
            _ => {
                let blob = row.try_get_unchecked::<Vec<u8>, _>(i)?;
                push(4, length(&blob), &blob);
            }
        }
    }
    Ok(())
}

/// SHA-256 over, for each table, its name, a zero byte, its row count in eight little-endian bytes, its digest.
pub fn tree_of(digests: &[TableDigest]) -> [u8; 32] {
    let mut hash = Sha256::new();
    for table in digests {
        hash.update(table.name.as_bytes());
        hash.update([0]);
        hash.update(table.rows.to_le_bytes());
        hash.update(table.sha256);
    }
    hash.finalize().into()
}

/// Writes the rows of the seal, with a placeholder for the file hash, in one transaction.
/// Returns (tree hash, placeholder).
pub async fn write_rows(
    conn: &mut SqliteConnection,
    totals: &SessionTotals,
) -> Result<([u8; 32], [u8; 32]), Fault> {
    let digests = digest_tables(conn).await?;
    let tree = tree_of(&digests);
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

/// What stands in the seal until the file hash is known.
pub fn placeholder_of(tree: &[u8; 32]) -> [u8; 32] {
    let mut hash = Sha256::new();
    hash.update(b"skinrig: the file hash goes here");
    hash.update(tree);
    hash.finalize().into()
}

/// The page of table `seal`, from 1.
pub async fn seal_page(conn: &mut SqliteConnection) -> Result<u32, Fault> {
    let row =
        sqlx::query("SELECT rootpage FROM sqlite_schema WHERE type = 'table' AND name = 'seal'")
            .fetch_one(conn)
            .await?;
    crate::query::num(&row, "rootpage")
}

/// Replaces `placeholder` on page `page` of the closed file by the file's hash, and returns it.
pub fn stamp(path: &Path, page: u32, placeholder: &[u8; 32]) -> std::io::Result<[u8; 32]> {
    let mut file = OpenOptions::new().read(true).write(true).open(path)?;
    let at = locate(&mut file, page, placeholder)?.ok_or_else(|| {
        std::io::Error::other("expected the seal's placeholder exactly once on its page")
    })?;
    let digest = hash_around(&mut file, at)?;
    file.seek(SeekFrom::Start(at))?;
    file.write_all(&digest)?;
    file.sync_all()?;
    Ok(digest)
}

/// The hash of a sealed file whose seal, on page `page`, says `recorded`; `None` when that page does not
/// hold `recorded` exactly once.
pub fn file_hash(path: &Path, page: u32, recorded: &[u8; 32]) -> std::io::Result<Option<[u8; 32]>> {
    let mut file = File::open(path)?;
    match locate(&mut file, page, recorded)? {
        Some(at) => hash_around(&mut file, at).map(Some),
        None => Ok(None),
    }
}

/// Where in the file `needle` lies on page `page`, when it lies there exactly once.
fn locate(file: &mut File, page: u32, needle: &[u8; 32]) -> std::io::Result<Option<u64>> {
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
    Read::by_ref(file)
        .take(page_bytes)
        .read_to_end(&mut bytes)?;
    let mut found = bytes
        .windows(needle.len())
        .enumerate()
        .filter(|(_, w)| w == needle);
    Ok(match (found.next(), found.next()) {
        (Some((at, _)), None) => Some(start + at as u64),
        _ => None,
    })
}

/// SHA-256 of the file with the 32 bytes at `at` taken as zero.
fn hash_around(file: &mut File, at: u64) -> std::io::Result<[u8; 32]> {
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
