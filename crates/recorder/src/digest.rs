//! The tree hash: the rows and columns it covers, now and at the time when an earlier leg was sealed.

use sha2::{Digest, Sha256};
use sqlx::sqlite::{SqliteConnection, SqliteRow};
use sqlx::{Row, TypeInfo, ValueRef};

use crate::query::{Fault, each_row, has_table, int, sha, text};

/// A table under the tree hash. For camera bytes and poses, the hash covers the SHA-256 column beside the blob.
struct Table {
    name: &'static str,
    /// First schema version with this table.
    since: u32,
    /// Query for its rows in key order, with all hashed columns. Parameters: the fields of [`Extent`].
    rows: &'static str,
    /// Queries for an earlier state where `rows` does not work, each with the schema version from which it applies.
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

/// In the order in which the tree hash covers them.
const TABLES: [Table; 23] = [
    table("session", 1, "SELECT * FROM session ORDER BY id LIMIT ?1"),
    Table {
        name: "leg",
        since: 5,
        rows: "SELECT * FROM leg ORDER BY number LIMIT ?1",
        earlier: &[
            (
                5,
                "SELECT number, operator, started_at, host, software, command_line, origin_ns, camera1_origin_us,
                 camera2_origin_us, first_seq_1, first_seq_2, devices_before, preflight_before, previous_status,
                 previous_reason, previous_end_ns, previous_tree_sha256
                 FROM leg ORDER BY number LIMIT ?1",
            ),
            (11, "SELECT * FROM leg ORDER BY number LIMIT ?1"),
        ],
    },
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
        // Sessions migrated from an older schema do not record the leg of each attempt, only that it is an earlier one.
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
            (
                11,
                "SELECT press, number, previous, intent_ns, verdict, reason, approach_ns, contact_ns, at_depth_ns,
                 retract_ns, release_ns, clear_ns, measured_x_mm, measured_y_mm, measured_depth_mm, peak_force_n, scheduled,
                 touched_mm, faults, leg, cause FROM attempt WHERE coalesce(leg, 1) < ?2 ORDER BY press, number",
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
    Table {
        name: "interruption",
        since: 1,
        rows: "SELECT * FROM interruption ORDER BY id LIMIT ?1",
        earlier: &[
            (
                1,
                "SELECT id, t_ns, kind, reason FROM interruption ORDER BY id LIMIT ?1",
            ),
            (11, "SELECT * FROM interruption ORDER BY id LIMIT ?1"),
        ],
    },
    table("note", 1, "SELECT * FROM note ORDER BY id LIMIT ?1"),
    table(
        "notification",
        12,
        "SELECT * FROM notification ORDER BY id LIMIT ?1",
    ),
    Table {
        name: "touch",
        since: 13,
        rows: "SELECT * FROM touch ORDER BY id LIMIT ?1",
        earlier: &[
            (
                13,
                "SELECT id, t_ns, until_ns, until_sd_ns, kind, press, attempt, x_mm, y_mm, major_mm, minor_mm, angle_deg, llr
                 FROM touch ORDER BY id LIMIT ?1",
            ),
            (14, "SELECT * FROM touch ORDER BY id LIMIT ?1"),
        ],
    },
    Table {
        name: "run_end",
        since: 1,
        rows: "SELECT * FROM run_end ORDER BY id",
        // The next leg moves it into its own row.
        earlier: &[
            (
                1,
                "SELECT 1, previous_end_ns, previous_status, previous_reason FROM leg
                 WHERE number = ?2 AND previous_end_ns IS NOT NULL",
            ),
            (
                11,
                "SELECT 1, previous_end_ns, previous_status, previous_reason, previous_cause FROM leg
                 WHERE number = ?2 AND previous_end_ns IS NOT NULL",
            ),
        ],
    },
    // The migrations that made the schema: version and content, not when or how fast they ran.
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

/// State of a session when it was sealed before a further leg.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EarlierState<'a> {
    /// Number of the leg that followed.
    pub leg: i64,
    /// Schema version of the file at that time.
    pub schema: u32,
    /// Last chunk of each camera; -1 for none.
    pub last_seq: [i64; 2],
    /// Digests at that time. Rows are only appended, so the first `rows` of each table belong to that state.
    pub tables: &'a [TableDigest],
}

/// Rows to cover: maximum row count, first excluded leg, last chunk of each camera.
struct Extent(i64, i64, [i64; 2]);

/// Digests of all tables in the file's schema. A value is hashed as one type byte (0 null, 1 integer, 2 real, 3 text, 4 blob) and
/// eight little-endian bytes of value; for text and blobs, eight bytes of length and the content.
pub(crate) async fn digest_tables(conn: &mut SqliteConnection) -> Result<Vec<TableDigest>, Fault> {
    digest_tables_beside(conn, None).await
}

/// A row of `table_digest` or `previous_table_digest`.
pub(crate) fn digest_from(row: &SqliteRow) -> Result<TableDigest, Fault> {
    Ok(TableDigest {
        name: text(row, "name")?,
        rows: int(row, "rows")?,
        sha256: sha(row, "sha256")?,
    })
}

/// Digests of the tables as they were sealed, in the order of the tree hash.
pub(crate) async fn sealed_tables(conn: &mut SqliteConnection) -> Result<Vec<TableDigest>, Fault> {
    let mut recorded = Vec::new();
    let query = sqlx::query("SELECT name, rows, sha256 FROM table_digest");
    each_row(query, conn, |row| {
        recorded.push(digest_from(row)?);
        Ok(())
    })
    .await?;
    recorded.sort_by_key(|table| TABLES.iter().position(|known| known.name == table.name));
    Ok(recorded)
}

/// Like [`digest_tables`], with the digest of one table if it is already known.
pub(crate) async fn digest_tables_beside(
    conn: &mut SqliteConnection,
    known: Option<TableDigest>,
) -> Result<Vec<TableDigest>, Fault> {
    let mut digests = Vec::with_capacity(TABLES.len());
    for table in &TABLES {
        // If a sealed file lacks a table, the tree hash differs.
        let digest = match &known {
            Some(known) if known.name == table.name => Some(known.clone()),
            _ => digest_rows(conn, table, |_| {}).await?,
        };
        digests.extend(digest);
    }
    Ok(digests)
}

/// Digest of one table, `None` without it. Calls `each` with every encoded row, in key order.
pub(crate) async fn digest_table(
    conn: &mut SqliteConnection,
    name: &str,
    each: impl FnMut(&[u8]),
) -> Result<Option<TableDigest>, Fault> {
    match TABLES.iter().find(|table| table.name == name) {
        Some(table) => digest_rows(conn, table, each).await,
        None => Ok(None),
    }
}

async fn digest_rows(
    conn: &mut SqliteConnection,
    table: &Table,
    each: impl FnMut(&[u8]),
) -> Result<Option<TableDigest>, Fault> {
    if !has_table(conn, table.name).await? {
        return Ok(None);
    }
    let all = Extent(-1, i64::MAX, [i64::MAX; 2]);
    digest(conn, table.name, table.rows, &all, each)
        .await
        .map(Some)
}

/// Like [`digest_tables`], over the rows of an earlier state.
pub(crate) async fn digest_earlier(
    conn: &mut SqliteConnection,
    earlier: &EarlierState<'_>,
) -> Result<Vec<TableDigest>, Fault> {
    let mut digests = Vec::with_capacity(earlier.tables.len());
    for table in TABLES.iter().filter(|t| t.since <= earlier.schema) {
        let known = earlier.tables.iter().find(|t| t.name == table.name);
        let extent = Extent(known.map_or(0, |t| t.rows), earlier.leg, earlier.last_seq);
        let mut ways = table.earlier.iter().rev();
        let way = ways.find(|(since, _)| *since <= earlier.schema);
        let sql = way.map_or(table.rows, |(_, sql)| sql);
        digests.push(digest(conn, table.name, sql, &extent, |_| {}).await?);
    }
    Ok(digests)
}

async fn digest(
    conn: &mut SqliteConnection,
    name: &str,
    sql: &'static str,
    Extent(rows, leg, [one, two]): &Extent,
    mut each: impl FnMut(&[u8]),
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
        each(&bytes);
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
        let kind = value.type_info();
        let mut push = |tag: u8, head: [u8; 8], content: &[u8]| {
            bytes.push(tag);
            bytes.extend_from_slice(&head);
            bytes.extend_from_slice(content);
        };
        let length = |content: &[u8]| (content.len() as u64).to_le_bytes();
        match kind.name() {
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

/// SHA-256 over name, a zero byte, row count (8 bytes, little-endian) and digest of each table.
pub(crate) fn tree_hash(digests: &[TableDigest]) -> [u8; 32] {
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

    /// A new column changes the result of `SELECT *` for earlier states: such a table needs a column list per schema.
    #[test]
    fn earlier_states_use_the_columns_of_their_schema() {
        let folder = tempfile::tempdir().unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .unwrap();
        runtime.block_on(async {
            for version in 1..=crate::migrations::SCHEMA_VERSION {
                let path = folder.path().join(format!("{version}.session.sqlite"));
                let mut old = schema::create_version(&path, version).await.unwrap();
                let path = folder.path().join(format!("{version}-now.session.sqlite"));
                let mut now = schema::create(&path).await.unwrap();
                for table in &TABLES {
                    let exists = has_table(&mut old, table.name).await.unwrap();
                    assert_eq!(
                        exists,
                        table.since <= version,
                        "{} in schema {version}",
                        table.name
                    );
                    if !exists {
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
                    // The columns have other names in the row of the next leg.
                    match table.name {
                        "run_end" => assert_eq!(was.len(), is.len()),
                        name => assert_eq!(was, is, "{name} of schema {version}"),
                    }
                }
            }
        });
    }
}
