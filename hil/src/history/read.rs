//! Reads rows of a history.

use std::collections::BTreeMap;

use skinrig_model::Limit;
use skinrig_nightly::trend::{Acceptance, History, NightSummary, Point, Series, SuiteNights};
use skinrig_nightly::{Verdict, Versions};
use sqlx::Row;
use sqlx::sqlite::{SqliteConnection, SqliteRow};

use super::error::QueryError;

/// The suites in the history, the one with the newest night first.
pub(super) async fn suites(conn: &mut SqliteConnection) -> Result<Vec<SuiteNights>, QueryError> {
    let rows = sqlx::query(
        "SELECT rig, rig_kind, suite, count(*) AS nights, max(started) AS newest FROM night
         GROUP BY rig, rig_kind, suite ORDER BY newest DESC, rig, rig_kind, suite",
    )
    .fetch_all(conn)
    .await?;
    rows.iter()
        .map(|row| {
            Ok(SuiteNights {
                rig: row.try_get("rig")?,
                rig_kind: row.try_get("rig_kind")?,
                suite: row.try_get("suite")?,
                nights: number(row, "nights")?,
                newest: row.try_get("newest")?,
            })
        })
        .collect()
}

/// All nights and measurements of one suite on one bench, of one kind.
pub(super) async fn history(
    conn: &mut SqliteConnection,
    of: &SuiteNights,
) -> Result<History, QueryError> {
    let mut all = History::default();
    let mut index = BTreeMap::new();
    let rows = sqlx::query(
        "SELECT * FROM night WHERE rig = ? AND rig_kind = ? AND suite = ? ORDER BY started, id",
    )
    .bind(&of.rig)
    .bind(&of.rig_kind)
    .bind(&of.suite)
    .fetch_all(&mut *conn)
    .await?;
    for row in &rows {
        index.insert(row.try_get::<i64, _>("id")?, all.nights.len());
        all.nights.push(head(row)?);
    }
    let rows = sqlx::query("SELECT * FROM firmware ORDER BY night, device")
        .fetch_all(&mut *conn)
        .await?;
    for row in &rows {
        if let Some(&at) = index.get(&row.try_get("night")?) {
            let device = (row.try_get("device")?, row.try_get("version")?);
            all.nights[at].versions.firmware.push(device);
        }
    }
    points(conn, None, &index, &mut all).await?;
    let accepted = acceptances(conn).await?.into_iter();
    let own = accepted.filter(|(rig, _)| *rig == of.rig);
    all.accepted.extend(own.map(|(_, accepted)| accepted));
    Ok(all)
}

/// All accepted changes, each with the name of its bench.
pub(super) async fn acceptances(
    conn: &mut SqliteConnection,
) -> Result<Vec<(String, Acceptance)>, QueryError> {
    let rows = sqlx::query("SELECT * FROM acceptance ORDER BY id")
        .fetch_all(conn)
        .await?;
    let accepted = |row: &SqliteRow| {
        let accepted = Acceptance {
            series: row.try_get("series")?,
            night: row.try_get("night_id")?,
            reason: row.try_get("reason")?,
            by: row.try_get("by")?,
            at: row.try_get("at")?,
        };
        Ok((row.try_get("rig")?, accepted))
    };
    rows.iter().map(accepted).collect()
}

/// One night, without its firmware, and its series.
pub(super) async fn night(
    conn: &mut SqliteConnection,
    of: &NightSummary,
) -> Result<(NightSummary, Vec<Series>), QueryError> {
    let row = sqlx::query("SELECT * FROM night WHERE rig = ? AND night_id = ?")
        .bind(&of.rig)
        .bind(&of.id)
        .fetch_one(&mut *conn)
        .await?;
    let id = row.try_get("id")?;
    let mut all = History::default();
    points(conn, Some(id), &BTreeMap::from([(id, 0)]), &mut all).await?;
    Ok((head(&row)?, all.series))
}

/// Adds the measurements of the last attempts; `only` those of this night.
async fn points(
    conn: &mut SqliteConnection,
    only: Option<i64>,
    index: &BTreeMap<i64, usize>,
    all: &mut History,
) -> Result<(), QueryError> {
    let rows = sqlx::query(
        "SELECT m.*, c.attempts FROM measurement m
         JOIN check_made c ON c.night = m.night AND c.name = m.check_name AND c.attempts = m.attempt
         JOIN night t ON t.id = m.night
         WHERE ?1 IS NULL OR m.night = ?1
         ORDER BY t.started, t.id, m.check_name, m.subject, m.metric",
    )
    .bind(only)
    .fetch_all(conn)
    .await?;
    for row in &rows {
        let Some(&night) = index.get(&row.try_get("night")?) else {
            continue;
        };
        let text = |column| row.try_get::<String, _>(column);
        let name = format!(
            "{}/{}/{}",
            text("check_name")?,
            text("subject")?,
            text("metric")?
        );
        let real = |column| row.try_get::<Option<f64>, _>(column);
        let limit = real("margin")?.map(|margin| {
            Ok::<_, QueryError>(Limit {
                at_least: real("at_least")?,
                at_most: real("at_most")?,
                margin,
            })
        });
        let point = Point {
            night,
            value: real("value")?,
            interval: real("low")?.zip(real("high")?).map(<[f64; 2]>::from),
            n: match row.try_get::<Option<i64>, _>("n")? {
                Some(_) => Some(number(row, "n")?),
                None => None,
            },
            limit: limit.transpose()?,
            verdict: verdict(row, "verdict")?,
            part: verdict(row, "part_verdict")?,
            attempts: number(row, "attempts")?,
        };
        all.add(&name, &text("unit")?, point);
    }
    Ok(())
}

fn head(row: &SqliteRow) -> Result<NightSummary, QueryError> {
    Ok(NightSummary {
        id: row.try_get("night_id")?,
        started: row.try_get("started")?,
        suite: row.try_get("suite")?,
        suite_sha256: row.try_get("suite_sha256")?,
        rig: row.try_get("rig")?,
        rig_kind: row.try_get("rig_kind")?,
        rig_sha256: row.try_get("rig_sha256")?,
        versions: Versions {
            software: row.try_get("software")?,
            analysis: number(row, "analysis")?,
            firmware: Vec::new(),
            skin: row.try_get("skin")?,
        },
        verdict: verdict(row, "verdict")?,
        folder: row.try_get("folder")?,
        golden: row.try_get("golden")?,
    })
}

fn verdict(row: &SqliteRow, column: &str) -> Result<Verdict, QueryError> {
    let name: String = row.try_get(column)?;
    Verdict::ALL
        .into_iter()
        .find(|v| v.name() == name)
        .ok_or_else(|| {
            QueryError::damaged(column, "a verdict", format!("`{}`", name.escape_debug()))
        })
}

fn number<T: TryFrom<i64>>(row: &SqliteRow, column: &str) -> Result<T, QueryError> {
    let value: i64 = row.try_get(column)?;
    T::try_from(value).map_err(|_| QueryError::damaged(column, "a count", value))
}
