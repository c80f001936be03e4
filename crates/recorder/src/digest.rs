//! The tree hash: which rows and columns it covers, in the session as it is and as it was when an earlier leg was sealed.

use sha2::{Digest, Sha256};
use sqlx::sqlite::{SqliteConnection, SqliteRow};
use sqlx::{Row, TypeInfo, ValueRef};

use crate::query::{Fault, each_row, has_table};

/// A table that the tree hash covers. Blobs of camera bytes and poses are covered by the SHA-256 beside them.
struct Table {
    name: &'static str,
    /// The schema that brought it.
    since: u32,
    /// Its rows in key order, all columns that count. Parameters: those of [`Extent`].
    rows: &'static str,
    /// The rows of an earlier state, where `rows` is not the way to them: each from this schema on.
    earlier: &'static [(u32, &'static str)],
}

const fn table(name: &'static str, since: u32, rows: &'static str) -> Table {
    Table {
        name,
        since,
        rows,
        earlier: &[],
    }
}

/// In the order of the tree hash.
const TABLES: [Table; 21] = [
    table("session", 1, "SELECT * FROM session ORDER BY id LIMIT ?1"),
    table("leg", 5, "SELECT * FROM leg ORDER BY number LIMIT ?1"),
    table(
        "robot_from_skin",
        1,
        "SELECT * FROM robot_from_skin ORDER BY axis LIMIT ?1",
    ),
    table("device", 1, "SELECT * FROM device ORDER BY id LIMIT ?1"),
    table(
        "setting",
        1,
        "SELECT * FROM setting ORDER BY device, position LIMIT ?1",
    ),
    table(
        "preflight",
        3,
        "SELECT * FROM preflight ORDER BY id LIMIT ?1",
    ),
    table("press", 1, "SELECT * FROM press ORDER BY id LIMIT ?1"),
    Table {
        name: "attempt",
        since: 1,
        rows: "SELECT * FROM attempt ORDER BY press, number",
        // A session that came from an older schema does not know of each attempt which leg it belongs to; only that it is one before.
        earlier: &[
            (
                1,
                "SELECT press, number, previous, intent_ns, verdict, reason, approach_ns, contact_ns, at_depth_ns,
                 retract_ns, release_ns, clear_ns, measured_x_mm, measured_y_mm, measured_depth_mm, peak_force_n, scheduled
                 FROM attempt WHERE coalesce(leg, 1) < ?2 ORDER BY press, number",
            ),
            (
                3,
                "SELECT press, number, previous, intent_ns, verdict, reason, approach_ns, contact_ns, at_depth_ns,
                 retract_ns, release_ns, clear_ns, measured_x_mm, measured_y_mm, measured_depth_mm, peak_force_n, scheduled,
                 touched_mm FROM attempt WHERE coalesce(leg, 1) < ?2 ORDER BY press, number",
            ),
            (
                8,
                "SELECT press, number, previous, intent_ns, verdict, reason, approach_ns, contact_ns, at_depth_ns,
                 retract_ns, release_ns, clear_ns, measured_x_mm, measured_y_mm, measured_depth_mm, peak_force_n, scheduled,
                 touched_mm, faults FROM attempt WHERE coalesce(leg, 1) < ?2 ORDER BY press, number",
            ),
            (
                9,
                "SELECT press, number, previous, intent_ns, verdict, reason, approach_ns, contact_ns, at_depth_ns,
                 retract_ns, release_ns, clear_ns, measured_x_mm, measured_y_mm, measured_depth_mm, peak_force_n, scheduled,
                 touched_mm, faults, leg FROM attempt WHERE coalesce(leg, 1) < ?2 ORDER BY press, number",
            ),
        ],
    },
    table("command", 1, "SELECT * FROM command ORDER BY id LIMIT ?1"),
    table(
        "pose_block",
        1,
        "SELECT id, first_ns, last_ns, samples, sha256 FROM pose_block ORDER BY id LIMIT ?1",
    ),
    table("mark", 1, "SELECT * FROM mark ORDER BY id LIMIT ?1"),
    table(
        "box_report",
        2,
        "SELECT * FROM box_report ORDER BY id LIMIT ?1",
    ),
    table(
        "chunk",
        1,
        "SELECT camera, seq, host_ns, lost_before, codec, raw_bytes, raw_crc32, stored_sha256, first_us,
         last_us, cd_events, on_events, trigger_edges FROM chunk
         WHERE seq <= CASE camera WHEN 1 THEN ?3 ELSE ?4 END ORDER BY camera, seq",
    ),
    table(
        "gap",
        6,
        "SELECT camera, seq, from_us, to_us FROM gap
         WHERE seq <= CASE camera WHEN 1 THEN ?3 ELSE ?4 END ORDER BY camera, seq",
    ),
    table(
        "trigger_edge",
        1,
        "SELECT camera, seq, position, t_us, channel, rising FROM trigger_edge
         WHERE seq <= CASE camera WHEN 1 THEN ?3 ELSE ?4 END ORDER BY camera, seq, position",
    ),
    table(
        "interruption",
        1,
        "SELECT * FROM interruption ORDER BY id LIMIT ?1",
    ),
    table("note", 1, "SELECT * FROM note ORDER BY id LIMIT ?1"),
    Table {
        name: "run_end",
        since: 1,
        rows: "SELECT * FROM run_end ORDER BY id",
        // The next leg moved it into its own row.
        earlier: &[(
            1,
            "SELECT 1, previous_end_ns, previous_status, previous_reason FROM leg
             WHERE number = ?2 AND previous_end_ns IS NOT NULL",
        )],
    },
    // Which migrations made the schema: name and content, not when or how fast they ran.
    table(
        "_sqlx_migrations",
        1,
        "SELECT version, checksum FROM _sqlx_migrations ORDER BY version LIMIT ?1",
    ),
    table(
        "previous_seal",
        9,
        "SELECT * FROM previous_seal ORDER BY leg LIMIT ?1",
    ),
    table(
        "previous_table_digest",
        9,
        "SELECT * FROM previous_table_digest ORDER BY leg, name LIMIT ?1",
    ),
];

/// The digest of one table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TableDigest {
    pub name: String,
    pub rows: i64,
    pub sha256: [u8; 32],
}

/// The state of a session when it was sealed before a further leg.
#[derive(Debug, Clone, Copy)]
pub struct Earlier<'a> {
    /// The leg that followed.
    pub leg: i64,
    /// The schema that the file had.
    pub schema: u32,
    /// The last chunk of each camera, -1 for none.
    pub last_seq: [i64; 2],
    /// What the tables had: rows are appended, so that the first so many are those that there were.
    pub tables: &'a [TableDigest],
}

/// Which rows of a table to take: at most so many, of legs before this one, chunks up to these.
struct Extent(i64, i64, [i64; 2]);

/// The digests of all tables that the file's schema has. A value is hashed as one type byte (0 null, 1 integer, 2 real, 3 text, 4 blob)
/// and its eight little-endian bytes, or its length in eight such bytes and its content.
pub(crate) async fn digest_tables(conn: &mut SqliteConnection) -> Result<Vec<TableDigest>, Fault> {
    let mut digests = Vec::with_capacity(TABLES.len());
    for table in &TABLES {
        // A table that is missing from a sealed file is missed in the tree hash.
        if has_table(conn, table.name).await? {
            let all = Extent(-1, i64::MAX, [i64::MAX; 2]);
            digests.push(digest(conn, table.name, table.rows, &all).await?);
        }
    }
    Ok(digests)
}

/// As [`digest_tables`], of an earlier state: from the rows that belonged to it.
pub(crate) async fn digest_earlier(
    conn: &mut SqliteConnection,
    earlier: &Earlier<'_>,
) -> Result<Vec<TableDigest>, Fault> {
    let mut digests = Vec::with_capacity(earlier.tables.len());
    for table in TABLES.iter().filter(|t| t.since <= earlier.schema) {
        let known = earlier.tables.iter().find(|t| t.name == table.name);
        let extent = Extent(known.map_or(0, |t| t.rows), earlier.leg, earlier.last_seq);
        let mut ways = table.earlier.iter().rev();
        let way = ways.find(|(since, _)| *since <= earlier.schema);
        let sql = way.map_or(table.rows, |(_, sql)| sql);
        digests.push(digest(conn, table.name, sql, &extent).await?);
    }
    Ok(digests)
}

async fn digest(
    conn: &mut SqliteConnection,
    name: &str,
    sql: &'static str,
    Extent(rows, leg, [one, two]): &Extent,
) -> Result<TableDigest, Fault> {
    let query = sqlx::query(sql)
        .bind(*rows)
        .bind(*leg)
        .bind(*one)
        .bind(*two);
    let (mut hash, mut rows, mut bytes) = (Sha256::new(), 0, Vec::new());
    each_row(query, conn, |row| {
        rows += 1;
        bytes.clear();
        encode_row(row, &mut bytes)?;
        hash.update(&bytes);
        Ok(())
    })
    .await?;
    Ok(TableDigest {
        name: name.to_owned(),
        rows,
        sha256: hash.finalize().into(),
    })
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
pub(crate) fn tree_of(digests: &[TableDigest]) -> [u8; 32] {
    let mut hash = Sha256::new();
    for table in digests {
        hash.update(table.name.as_bytes());
        hash.update([0]);
        hash.update(table.rows.to_le_bytes());
        hash.update(table.sha256);
    }
    hash.finalize().into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schema;

    /// A column that a later schema adds changes what `SELECT *` gives of an earlier state: such a table needs its columns by schema.
    #[test]
    fn earlier_states_are_read_with_the_columns_that_they_had() {
        let folder = tempfile::tempdir().unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .unwrap();
        runtime.block_on(async {
            for version in 1..=crate::SCHEMA_VERSION {
                let path = folder.path().join(format!("{version}.session.sqlite"));
                let mut old = schema::create_version(&path, version).await.unwrap();
                let path = folder.path().join(format!("{version}-now.session.sqlite"));
                let mut now = schema::create(&path).await.unwrap();
                for table in &TABLES {
                    let there = has_table(&mut old, table.name).await.unwrap();
                    assert_eq!(
                        there,
                        table.since <= version,
                        "{} in schema {version}",
                        table.name
                    );
                    if !there {
                        continue;
                    }
                    let way = table.earlier.iter().rev().find(|(s, _)| *s <= version);
                    let sql = way.map_or(table.rows, |(_, sql)| sql);
                    let columns = async |conn: &mut SqliteConnection, sql: &'static str| {
                        use sqlx::{Column, Executor, SqlSafeStr, Statement};
                        let statement = conn.prepare(sql.into_sql_str()).await.unwrap();
                        let names = statement.columns().iter().map(|c| c.name().to_owned());
                        names.collect::<Vec<_>>()
                    };
                    let (was, is) = (
                        columns(&mut old, table.rows).await,
                        columns(&mut now, sql).await,
                    );
                    // The end of a run has other names in the row of the next leg.
                    match table.name {
                        "run_end" => assert_eq!(was.len(), is.len()),
                        name => assert_eq!(was, is, "{name} of schema {version}"),
                    }
                }
            }
        });
    }
}
