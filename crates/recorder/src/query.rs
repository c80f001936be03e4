//! Small helpers between SQL rows and plain values, and the counts that seal, reader and check share.

use std::future::poll_fn;
use std::path::Path;

use sqlx::Row;
use sqlx::sqlite::{Sqlite, SqliteArguments, SqliteConnection, SqliteRow};

use crate::digest::Earlier;
use crate::error::RecorderError;
use crate::rows::{PressTally, SessionTotals};

/// A failed query, or a row that contradicts the schema; not yet told which file.
#[derive(Debug)]
pub enum Fault {
    /// SQLite's.
    Sql(Box<sqlx::Error>),
    /// A value that should not be there.
    Bad {
        place: String,
        expected: String,
        found: String,
    },
}

impl From<sqlx::Error> for Fault {
    fn from(e: sqlx::Error) -> Self {
        Self::Sql(Box::new(e))
    }
}

impl Fault {
    /// A value that should not be there.
    pub fn bad(place: impl ToString, expected: impl ToString, found: impl ToString) -> Self {
        Self::Bad {
            place: place.to_string(),
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }

    /// The error for the user.
    pub fn at(self, path: &Path, doing: &'static str) -> RecorderError {
        let path = path.to_owned();
        match self {
            Self::Sql(source) => RecorderError::Sql {
                path,
                doing,
                source,
            },
            Self::Bad {
                place,
                expected,
                found,
            } => RecorderError::Damaged {
                path,
                place,
                expected,
                found,
            },
        }
    }
}

/// Calls `each` for every row, one at a time.
pub async fn each_row(
    query: sqlx::query::Query<'_, Sqlite, SqliteArguments>,
    conn: &mut SqliteConnection,
    mut each: impl FnMut(&SqliteRow) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let mut rows = query.fetch(conn);
    while let Some(row) = poll_fn(|context| rows.as_mut().poll_next(context)).await {
        each(&row?)?;
    }
    Ok(())
}

/// An integer column.
pub fn int(row: &SqliteRow, column: &str) -> Result<i64, Fault> {
    Ok(row.try_get(column)?)
}

/// An integer column that may be null.
pub fn opt_int(row: &SqliteRow, column: &str) -> Result<Option<i64>, Fault> {
    Ok(row.try_get(column)?)
}

/// An integer column that must fit `T`.
pub fn num<T: TryFrom<i64>>(row: &SqliteRow, column: &str) -> Result<T, Fault> {
    let value = int(row, column)?;
    T::try_from(value)
        .map_err(|_| Fault::bad(column, format!("a {}", std::any::type_name::<T>()), value))
}

/// An integer column that must fit `T` or be null.
pub fn opt_num<T: TryFrom<i64>>(row: &SqliteRow, column: &str) -> Result<Option<T>, Fault> {
    opt_int(row, column)?.map(|_| num(row, column)).transpose()
}

/// A real column.
pub fn real(row: &SqliteRow, column: &str) -> Result<f64, Fault> {
    Ok(row.try_get(column)?)
}

/// A real column that may be null.
pub fn opt_real(row: &SqliteRow, column: &str) -> Result<Option<f64>, Fault> {
    Ok(row.try_get(column)?)
}

/// Whether the file has this table: sessions of an older schema lack the later ones.
pub async fn has_table(conn: &mut SqliteConnection, name: &str) -> Result<bool, Fault> {
    let row =
        sqlx::query("SELECT count(*) AS n FROM sqlite_schema WHERE type = 'table' AND name = ?")
            .bind(name)
            .fetch_one(conn)
            .await?;
    Ok(int(&row, "n")? > 0)
}

/// A real column that may be null, and that sessions of an older schema do not have.
pub fn later_real(row: &SqliteRow, column: &str) -> Result<Option<f64>, Fault> {
    match row.try_get(column) {
        Err(sqlx::Error::ColumnNotFound(_)) => Ok(None),
        other => Ok(other?),
    }
}

/// A text column that older schemas do not have.
pub fn later_text(row: &SqliteRow, column: &str) -> Result<Option<String>, Fault> {
    match row.try_get(column) {
        Err(sqlx::Error::ColumnNotFound(_)) => Ok(None),
        other => Ok(other?),
    }
}

/// A text column.
pub fn text(row: &SqliteRow, column: &str) -> Result<String, Fault> {
    Ok(row.try_get(column)?)
}

/// A text column that may be null.
pub fn opt_text(row: &SqliteRow, column: &str) -> Result<Option<String>, Fault> {
    Ok(row.try_get(column)?)
}

/// A blob column.
pub fn blob(row: &SqliteRow, column: &str) -> Result<Vec<u8>, Fault> {
    Ok(row.try_get(column)?)
}

/// A blob column of 32 bytes.
pub fn sha(row: &SqliteRow, column: &str) -> Result<[u8; 32], Fault> {
    let bytes = blob(row, column)?;
    <[u8; 32]>::try_from(bytes.as_slice())
        .map_err(|_| Fault::bad(column, "32 bytes", format!("{} bytes", bytes.len())))
}

/// A text column that names one of `all`.
pub fn named<T: Copy>(
    row: &SqliteRow,
    column: &str,
    all: &[T],
    name: impl Fn(T) -> &'static str,
) -> Result<T, Fault> {
    let found = text(row, column)?;
    all.iter()
        .copied()
        .find(|t| name(*t) == found)
        .ok_or_else(|| {
            let names: Vec<_> = all.iter().map(|t| name(*t)).collect();
            Fault::bad(
                column,
                format!("one of {}", names.join(", ")),
                format!("`{found}`"),
            )
        })
}

/// The schema that the file was made with.
pub async fn schema_version(conn: &mut SqliteConnection) -> Result<u32, Fault> {
    let version = sqlx::query("PRAGMA user_version").fetch_one(conn).await?;
    num(&version, "user_version")
}

/// How the presses ended, the sync presses apart, each counted by its last attempt.
pub async fn tallies(conn: &mut SqliteConnection) -> Result<(PressTally, PressTally), Fault> {
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

/// Sizes and counts as the rows have them.
pub async fn totals(conn: &mut SqliteConnection) -> Result<SessionTotals, Fault> {
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

/// As [`totals`], of an earlier state that had so many pose blocks.
pub async fn totals_before(
    conn: &mut SqliteConnection,
    earlier: &Earlier<'_>,
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

/// The columns that `chunk` sums and the seal share.
pub fn sizes(row: &SqliteRow, totals: &mut SessionTotals) -> Result<(), Fault> {
    totals.chunks = num(row, "chunks")?;
    totals.raw_bytes = num(row, "raw_bytes")?;
    totals.stored_bytes = num(row, "stored_bytes")?;
    totals.lost_bytes = num(row, "lost_bytes")?;
    totals.cd_events = num(row, "cd_events")?;
    totals.trigger_edges = num(row, "trigger_edges")?;
    totals.pose_samples = num(row, "pose_samples")?;
    Ok(())
}

/// A tally of the seal; `prefix` is empty or `sync_`.
pub fn tally(row: &SqliteRow, prefix: &str) -> Result<PressTally, Fault> {
    let column = |name: &str| num(row, &format!("{prefix}{name}"));
    Ok(PressTally {
        planned: column("planned")?,
        valid: column("valid")?,
        missed: column("missed")?,
        invalid: column("invalid")?,
        excluded: column("excluded")?,
    })
}
