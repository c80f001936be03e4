//! Writes the rows of a night in one transaction.

use sha2::{Digest, Sha256};
use skinrig_nightly::judge::part_verdicts;
use skinrig_nightly::night::{CheckResult, Measurement, Part};
use skinrig_nightly::trend::{Acceptance, NightSummary};
use skinrig_nightly::{Night, Verdict};
use sqlx::{Sqlite, Transaction};

use super::error::QueryError;

type Rows<'a> = Transaction<'a, Sqlite>;

/// SHA-256 of the night's JSON without its messages, which are sent after the history has the night; in hexadecimal.
pub(super) fn digest(night: &Night) -> Result<String, QueryError> {
    let measured = Night {
        notifications: Vec::new(),
        ..night.clone()
    };
    let json = serde_json::to_vec(&measured).map_err(|e| QueryError::Damaged(e.to_string()))?;
    let sum = Sha256::digest(&json);
    Ok(sum.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Digest of the stored night with this name, if any.
pub(super) async fn stored_digest(
    tx: &mut Rows<'_>,
    head: &NightSummary,
) -> Result<Option<String>, QueryError> {
    let found = sqlx::query_scalar("SELECT sha256 FROM night WHERE rig = ? AND night_id = ?")
        .bind(&head.rig)
        .bind(&head.id)
        .fetch_optional(&mut **tx)
        .await?;
    Ok(found)
}

/// Inserts a night with all its checks.
pub(super) async fn night(
    tx: &mut Rows<'_>,
    night: &Night,
    head: &NightSummary,
    sha256: &str,
) -> Result<(), QueryError> {
    let versions = &head.versions;
    let id: i64 = sqlx::query_scalar(
        "INSERT INTO night (night_id, started, suite, suite_sha256, rig, rig_kind, rig_sha256, software, analysis, skin,
             verdict, folder, golden, sha256)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) RETURNING id",
    )
    .bind(&head.id)
    .bind(&head.started)
    .bind(&head.suite)
    .bind(&head.suite_sha256)
    .bind(&head.rig)
    .bind(&head.rig_kind)
    .bind(&head.rig_sha256)
    .bind(&versions.software)
    .bind(i64::from(versions.analysis))
    .bind(&versions.skin)
    .bind(head.verdict.name())
    .bind(&head.folder)
    .bind(&head.golden)
    .bind(sha256)
    .fetch_one(&mut **tx)
    .await?;
    for (device, version) in &versions.firmware {
        sqlx::query("INSERT INTO firmware (night, device, version) VALUES (?, ?, ?)")
            .bind(id)
            .bind(device)
            .bind(version)
            .execute(&mut **tx)
            .await?;
    }
    for check in &night.checks {
        self::check(tx, id, check).await?;
    }
    Ok(())
}

async fn check(tx: &mut Rows<'_>, night: i64, check: &CheckResult) -> Result<(), QueryError> {
    sqlx::query("INSERT INTO check_made (night, name, verdict, attempts) VALUES (?, ?, ?, ?)")
        .bind(night)
        .bind(&check.name)
        .bind(check.verdict.name())
        .bind(whole(check.attempts.len() as u64))
        .execute(&mut **tx)
        .await?;
    for (attempt, record) in (1..).zip(&check.attempts) {
        for (part, verdict) in record.parts.iter().zip(part_verdicts(check, record)) {
            for m in &part.measurements {
                measurement(tx, (night, &check.name, attempt), (part, verdict), m).await?;
            }
        }
    }
    Ok(())
}

async fn measurement(
    tx: &mut Rows<'_>,
    (night, check, attempt): (i64, &str, i64),
    (part, verdict): (&Part, Verdict),
    m: &Measurement,
) -> Result<(), QueryError> {
    // SQLite has no NaN, and infinity is not a measurement.
    let value = m.value.filter(|v| v.is_finite());
    sqlx::query(
        "INSERT INTO measurement (night, check_name, attempt, subject, metric, value, unit, at_least, at_most, margin, low, high,
             n, verdict, part_verdict)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(night)
    .bind(check)
    .bind(attempt)
    .bind(&part.subject)
    .bind(&m.metric)
    .bind(value)
    .bind(&m.unit)
    .bind(m.limit.and_then(|l| l.at_least))
    .bind(m.limit.and_then(|l| l.at_most))
    .bind(m.limit.map(|l| l.margin))
    .bind(m.interval.map(|[low, _]| low))
    .bind(m.interval.map(|[_, high]| high))
    .bind(m.n.map(whole))
    .bind(m.verdict.name())
    .bind(verdict.name())
    .execute(&mut **tx)
    .await?;
    Ok(())
}

/// Inserts an acceptance.
pub(super) async fn acceptance(
    tx: &mut Rows<'_>,
    rig: &str,
    acceptance: &Acceptance,
) -> Result<(), QueryError> {
    sqlx::query(
        "INSERT INTO acceptance (rig, night_id, series, reason, by, at) VALUES (?, ?, ?, ?, ?, ?)",
    )
    .bind(rig)
    .bind(&acceptance.night)
    .bind(&acceptance.series)
    .bind(&acceptance.reason)
    .bind(&acceptance.by)
    .bind(&acceptance.at)
    .execute(&mut **tx)
    .await?;
    Ok(())
}

/// Converts a count; counts never reach 2^63.
fn whole(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}
