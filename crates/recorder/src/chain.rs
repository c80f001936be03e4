//! The chain of seals: archives the seal that a further leg removes, and checks that the rows still match it.

use sqlx::Row;
use sqlx::sqlite::SqliteConnection;

use crate::digest::{EarlierState, TableDigest, digest_earlier, digest_from, tree_hash};
use crate::hex::hex;
use crate::problem::Problem;
use crate::query::{Fault, each_row, has_table, int, num, opt_int, sha};
use crate::rows::SessionTotals;
use crate::totals;

/// Result of checking the seal that a leg removed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum PreviousSeal {
    /// The rows of the earlier legs match its hashes and counts.
    Verified,
    /// An old version of skinrig archived only its tree hash, which cannot be recomputed.
    Unverifiable,
    /// The rows differ from it.
    Mismatch(Vec<Problem>),
}

impl PreviousSeal {
    fn unless(self, problems: Vec<Problem>) -> Self {
        if problems.is_empty() {
            self
        } else {
            Self::Mismatch(problems)
        }
    }
}

/// Archives the seal, if any, that leg `leg` removes from a file with schema version `schema`.
pub(crate) async fn archive_seal(
    conn: &mut SqliteConnection,
    leg: u32,
    schema: u32,
) -> Result<(), Fault> {
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

/// A leg that removed a seal, from its row.
struct Leg {
    number: i64,
    tree: Option<[u8; 32]>,
    first_seq: [i64; 2],
}

/// Checks every seal that a leg removed; returns leg number and result.
pub(crate) async fn check(conn: &mut SqliteConnection) -> Result<Vec<(i64, PreviousSeal)>, Fault> {
    if !has_table(conn, "leg").await? {
        return Ok(Vec::new());
    }
    let has_archive = has_table(conn, "previous_seal").await?;
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
    let mut results = Vec::new();
    for leg in legs {
        let result = match (has_archive, leg.tree) {
            (false, None) => None,
            (false, Some(_)) => Some(PreviousSeal::Unverifiable),
            (true, _) => check_previous_seal(conn, &leg).await?,
        };
        results.extend(result.map(|result| (leg.number, result)));
    }
    Ok(results)
}

async fn check_previous_seal(
    conn: &mut SqliteConnection,
    leg: &Leg,
) -> Result<Option<PreviousSeal>, Fault> {
    let query = sqlx::query("SELECT * FROM previous_seal WHERE leg = ?");
    let row = query.bind(leg.number).fetch_optional(&mut *conn).await?;
    let (row, tree) = match (row, leg.tree) {
        (None, None) => return Ok(None),
        (Some(row), Some(tree)) => (row, tree),
        (row, _) => {
            let (there, missing) = if row.is_some() {
                ("in previous_seal", "in its row")
            } else {
                ("in its row", "in previous_seal")
            };
            let problem = Problem::new(
                "previous seal",
                format_args!("it {there} and {missing}"),
                format_args!("it only {there}"),
            );
            return Ok(Some(PreviousSeal::Mismatch(vec![problem])));
        }
    };
    let mut problems = Vec::new();
    let archived = sha(&row, "tree_sha256")?;
    if archived != tree {
        problems.push(Problem::new(
            "tree hash of the previous seal",
            hex(&archived),
            hex(&tree),
        ));
    }
    if opt_int(&row, "schema_version")?.is_none() {
        return Ok(Some(PreviousSeal::Unverifiable.unless(problems)));
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
        recorded.push(digest_from(row)?);
        Ok(())
    })
    .await?;
    let earlier = EarlierState {
        leg: leg.number,
        schema,
        last_seq: leg.first_seq.map(|seq| seq.saturating_sub(1)),
        tables: &recorded,
    };
    let computed = digest_earlier(conn, &earlier).await?;
    problems.extend(compare_digests(&recorded, &computed, &tree));
    let poses = recorded.iter().find(|t| t.name == "pose_block");
    let counted = totals::totals_before(conn, &earlier, poses.map_or(0, |t| t.rows)).await?;
    if counted != totals {
        problems.push(Problem::new(
            "counts of the previous seal",
            format_args!("{totals:?}"),
            format_args!("{counted:?}"),
        ));
    }
    Ok(Some(PreviousSeal::Verified.unless(problems)))
}

/// Differences between the digests in a seal and those of the rows.
fn compare_digests(
    recorded: &[TableDigest],
    computed: &[TableDigest],
    sealed_tree: &[u8; 32],
) -> Vec<Problem> {
    let changed = computed.iter().filter(|table| !recorded.contains(table));
    let mut problems: Vec<Problem> = changed
        .map(|table| Problem::new(&table.name, "the sealed rows of earlier legs", "other rows"))
        .collect();
    if computed.len() != recorded.len() {
        problems.push(Problem::new(
            "digests of tables",
            computed.len(),
            recorded.len(),
        ));
    }
    let tree = tree_hash(computed);
    if tree != *sealed_tree {
        problems.push(Problem::new(
            "tree hash of the rows",
            format_args!("{} of the previous seal", hex(sealed_tree)),
            hex(&tree),
        ));
    }
    problems
}
