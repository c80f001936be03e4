//! Counts and sizes, shared by seal, reader and verification.

use sqlx::sqlite::{Sqlite, SqliteArguments, SqliteConnection, SqliteRow};

use crate::digest::EarlierState;
use crate::query::{Fault, each_row, int, num, opt_text};
use crate::rows::{PressTally, SessionTotals};

/// Verdict counts by last attempt: calibrating and scored presses, then sync presses.
pub(crate) async fn tallies(
    conn: &mut SqliteConnection,
) -> Result<(PressTally, PressTally), Fault> {
    let presses = "SELECT p.role = 'sync' AS sync, a.verdict AS verdict, count(*) AS n
         FROM press p LEFT JOIN attempt a
           ON a.press = p.id AND a.number = (SELECT max(number) FROM attempt WHERE press = p.id)
         GROUP BY 1, 2";
    tally_all(conn, sqlx::query(presses)).await
}

async fn tally_all(
    conn: &mut SqliteConnection,
    presses: sqlx::query::Query<'_, Sqlite, SqliteArguments>,
) -> Result<(PressTally, PressTally), Fault> {
    let (mut scored, mut sync) = (PressTally::default(), PressTally::default());
    each_row(presses, conn, |row| {
        let tally = if int(row, "sync")? != 0 {
            &mut sync
        } else {
            &mut scored
        };
        let n: u64 = num(row, "n")?;
        tally.planned += n;
        match opt_text(row, "verdict")?.as_deref() {
            Some("valid") => tally.valid += n,
            Some("missed") => tally.missed += n,
            Some("invalid") => tally.invalid += n,
            Some("excluded") => tally.excluded += n,
            _ => {}
        }
        Ok(())
    })
    .await?;
    Ok((scored, sync))
}

/// Sizes and counts, computed from the rows.
pub(crate) async fn totals(conn: &mut SqliteConnection) -> Result<SessionTotals, Fault> {
    let (presses, sync) = tallies(conn).await?;
    let mut totals = SessionTotals {
        presses,
        sync,
        ..SessionTotals::default()
    };
    let row = sqlx::query(
        "SELECT count(*) AS chunks, coalesce(sum(raw_bytes), 0) AS raw_bytes,
           coalesce(sum(length(stored)), 0) AS stored_bytes, coalesce(sum(lost_before), 0) AS lost_bytes,
           coalesce(sum(cd_events), 0) AS cd_events, coalesce(sum(trigger_edges), 0) AS trigger_edges,
           (SELECT coalesce(sum(samples), 0) FROM pose_block) AS pose_samples
         FROM chunk",
    )
    .fetch_one(conn)
    .await?;
    sizes(&row, &mut totals)?;
    Ok(totals)
}

/// Like [`totals`], for an earlier state with this many pose blocks.
pub(crate) async fn totals_before(
    conn: &mut SqliteConnection,
    earlier: &EarlierState<'_>,
    pose_blocks: i64,
) -> Result<SessionTotals, Fault> {
    let presses = "SELECT p.role = 'sync' AS sync, a.verdict AS verdict, count(*) AS n
         FROM press p LEFT JOIN attempt a
           ON a.press = p.id
           AND a.number = (SELECT max(number) FROM attempt WHERE press = p.id AND coalesce(leg, 1) < ?)
         GROUP BY 1, 2";
    let (presses, sync) = tally_all(conn, sqlx::query(presses).bind(earlier.leg)).await?;
    let mut totals = SessionTotals {
        presses,
        sync,
        ..SessionTotals::default()
    };
    let row = sqlx::query(
        "SELECT count(*) AS chunks, coalesce(sum(raw_bytes), 0) AS raw_bytes,
           coalesce(sum(length(stored)), 0) AS stored_bytes, coalesce(sum(lost_before), 0) AS lost_bytes,
           coalesce(sum(cd_events), 0) AS cd_events, coalesce(sum(trigger_edges), 0) AS trigger_edges,
           (SELECT coalesce(sum(samples), 0) FROM (SELECT samples FROM pose_block ORDER BY id LIMIT ?1)) AS pose_samples
         FROM chunk WHERE seq <= CASE camera WHEN 1 THEN ?2 ELSE ?3 END",
    )
    .bind(pose_blocks)
    .bind(earlier.last_seq[0])
    .bind(earlier.last_seq[1])
    .fetch_one(conn)
    .await?;
    sizes(&row, &mut totals)?;
    Ok(totals)
}

/// Reads the columns that the sums over `chunk` and the seal have in common.
pub(crate) fn sizes(row: &SqliteRow, totals: &mut SessionTotals) -> Result<(), Fault> {
    totals.chunks = num(row, "chunks")?;
    totals.raw_bytes = num(row, "raw_bytes")?;
    totals.stored_bytes = num(row, "stored_bytes")?;
    totals.lost_bytes = num(row, "lost_bytes")?;
    totals.cd_events = num(row, "cd_events")?;
    totals.trigger_edges = num(row, "trigger_edges")?;
    totals.pose_samples = num(row, "pose_samples")?;
    Ok(())
}

/// Reads a tally of the seal; `prefix` is empty or `sync_`.
pub(crate) fn tally(row: &SqliteRow, prefix: &str) -> Result<PressTally, Fault> {
    let column = |name: &str| num(row, &format!("{prefix}{name}"));
    Ok(PressTally {
        planned: column("planned")?,
        valid: column("valid")?,
        missed: column("missed")?,
        invalid: column("invalid")?,
        excluded: column("excluded")?,
    })
}
