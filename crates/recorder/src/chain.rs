//! The chain of seals: what a further leg keeps of the seal that it takes off, and whether the rows still give its hash.

use sqlx::Row;
use sqlx::sqlite::SqliteConnection;

use crate::digest::{Earlier, TableDigest, digest_earlier, tree_of};
use crate::hex::hex;
use crate::query::{Fault, each_row, has_table, int, num, opt_int, sha, text};
use crate::rows::SessionTotals;
use crate::totals;

/// What the seal before a leg proves.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Link {
    /// The rows of the legs before give its hash and its counts.
    Proven,
    /// It was taken off by a version of skinrig that kept the hash alone, and not what it covers.
    Unprovable,
    /// They do not: each difference in words.
    Broken(Vec<String>),
}

/// Keeps the seal that leg `leg` takes off, of a file that had schema `schema`, when there is one.
pub async fn keep(conn: &mut SqliteConnection, leg: u32, schema: u32) -> Result<(), Fault> {
    sqlx::query(
        "INSERT INTO previous_seal (leg, schema_version, planned, valid, missed, invalid, excluded, sync_planned, sync_valid,
           sync_missed, sync_invalid, sync_excluded, chunks, raw_bytes, stored_bytes, lost_bytes, cd_events, trigger_edges,
           pose_samples, tree_sha256, file_sha256)
         SELECT ?, ?, planned, valid, missed, invalid, excluded, sync_planned, sync_valid, sync_missed, sync_invalid,
           sync_excluded, chunks, raw_bytes, stored_bytes, lost_bytes, cd_events, trigger_edges, pose_samples, tree_sha256,
           file_sha256 FROM seal",
    )
    .bind(leg)
    .bind(schema)
    .execute(&mut *conn)
    .await?;
    sqlx::query(
        "INSERT INTO previous_table_digest (leg, name, rows, sha256)
         SELECT ?1, name, rows, sha256 FROM table_digest WHERE EXISTS (SELECT 1 FROM previous_seal WHERE leg = ?1)",
    )
    .bind(leg)
    .execute(&mut *conn)
    .await?;
    Ok(())
}

/// A leg that took a seal off, as its own row has it.
struct Leg {
    number: i64,
    tree: Option<[u8; 32]>,
    first_seq: [i64; 2],
}

/// Every leg that took a seal off, with what that seal proves.
pub async fn check(conn: &mut SqliteConnection) -> Result<Vec<(i64, Link)>, Fault> {
    if !has_table(conn, "leg").await? {
        return Ok(Vec::new());
    }
    let kept = has_table(conn, "previous_seal").await?;
    let mut legs = Vec::new();
    let sql =
        "SELECT number, previous_tree_sha256, first_seq_1, first_seq_2 FROM leg ORDER BY number";
    each_row(sqlx::query(sql), conn, |row| {
        let tree: Option<Vec<u8>> = row.try_get("previous_tree_sha256")?;
        legs.push(Leg {
            number: int(row, "number")?,
            tree: tree.map(|_| sha(row, "previous_tree_sha256")).transpose()?,
            first_seq: [int(row, "first_seq_1")?, int(row, "first_seq_2")?],
        });
        Ok(())
    })
    .await?;
    let mut links = Vec::new();
    for leg in legs {
        let link = match (kept, leg.tree) {
            (false, None) => None,
            (false, Some(_)) => Some(Link::Unprovable),
            (true, _) => link(conn, &leg).await?,
        };
        links.extend(link.map(|link| (leg.number, link)));
    }
    Ok(links)
}

async fn link(conn: &mut SqliteConnection, leg: &Leg) -> Result<Option<Link>, Fault> {
    let query = sqlx::query("SELECT * FROM previous_seal WHERE leg = ?");
    let row = query.bind(leg.number).fetch_optional(&mut *conn).await?;
    let (row, tree) = match (row, leg.tree) {
        (None, None) => return Ok(None),
        (Some(row), Some(tree)) => (row, tree),
        (row, _) => {
            let words = ["in its row", "in previous_seal"];
            let (expected, found) = if row.is_some() {
                (words[1], words[0])
            } else {
                (words[0], words[1])
            };
            let told = format!(
                "expected the seal that it took off {expected} and {found}, found it {expected} alone"
            );
            return Ok(Some(Link::Broken(vec![told])));
        }
    };
    let mut told = Vec::new();
    let kept = sha(&row, "tree_sha256")?;
    if kept != tree {
        told.push(format!(
            "expected tree hash {} of the seal before, found {}",
            hex(&kept),
            hex(&tree)
        ));
    }
    if opt_int(&row, "schema_version")?.is_none() {
        return Ok(Some(if told.is_empty() {
            Link::Unprovable
        } else {
            Link::Broken(told)
        }));
    }
    let schema = num(&row, "schema_version")?;
    let mut totals = SessionTotals {
        presses: totals::tally(&row, "")?,
        sync: totals::tally(&row, "sync_")?,
        ..SessionTotals::default()
    };
    totals::sizes(&row, &mut totals)?;
    let mut recorded = Vec::new();
    let sql = "SELECT name, rows, sha256 FROM previous_table_digest WHERE leg = ? ORDER BY name";
    each_row(sqlx::query(sql).bind(leg.number), conn, |row| {
        recorded.push(TableDigest {
            name: text(row, "name")?,
            rows: int(row, "rows")?,
            sha256: sha(row, "sha256")?,
        });
        Ok(())
    })
    .await?;
    let earlier = Earlier {
        leg: leg.number,
        schema,
        last_seq: leg.first_seq.map(|seq| seq.saturating_sub(1)),
        tables: &recorded,
    };
    let computed = digest_earlier(conn, &earlier).await?;
    for table in &computed {
        if !recorded.contains(table) {
            told.push(format!(
                "{}: the rows of the legs before are not those that were sealed",
                table.name
            ));
        }
    }
    if computed.len() != recorded.len() {
        told.push(format!(
            "expected the digests of {} tables, found {}",
            computed.len(),
            recorded.len()
        ));
    }
    if tree_of(&computed) != tree {
        let found = hex(&tree_of(&computed));
        told.push(format!(
            "expected rows with the tree hash {} of the seal before, found {found}",
            hex(&tree)
        ));
    }
    let poses = recorded.iter().find(|t| t.name == "pose_block");
    let counted = totals::totals_before(conn, &earlier, poses.map_or(0, |t| t.rows)).await?;
    if counted != totals {
        told.push(format!(
            "expected the counts of the seal before, {totals:?}, found {counted:?}"
        ));
    }
    Ok(Some(if told.is_empty() {
        Link::Proven
    } else {
        Link::Broken(told)
    }))
}
