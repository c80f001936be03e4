//! Lists missing rows, by comparison with the seal and with other rows, and documents them in the new file.

use super::cells::Value;
use super::gather::RecoveredRow;
use super::shapes::KeyPart;
use super::writer::{SalvageError, SalvageWriter};
use crate::chain::{self, PreviousSeal};
use crate::digest;

impl SalvageWriter<'_> {
    /// Compares each table with its digest in the seal, if that was recovered.
    pub(super) async fn compare_with_seal(&mut self) -> Result<(), SalvageError> {
        let sealed = self
            .shapes
            .iter()
            .zip(self.rows)
            .find(|(s, _)| s.kind.name == "table_digest");
        let Some((_, sealed)) = sealed.filter(|(_, rows)| !rows.rows.is_empty()) else {
            return Ok(());
        };
        for digest in digest::digest_tables(self.conn).await? {
            let key = vec![KeyPart::Text(digest.name.clone())];
            let Some(RecoveredRow::Values(row)) = sealed.rows.get(&key) else {
                continue;
            };
            if row.get(2) == Some(&Value::Blob(digest.sha256.to_vec())) {
                continue;
            }
            let name = &digest.name;
            let found = match row.get(1) {
                // As many rows, and not the same ones: which values are wrong is unknown.
                Some(Value::Int(n)) if *n == digest.rows => {
                    self.report.changed.push(name.clone());
                    format!(
                        "table {name}: expected the {n} rows that were sealed, found as many with other values"
                    )
                }
                Some(Value::Int(n)) => format!(
                    "table {name}: expected the {n} rows that were sealed, found {} rows",
                    digest.rows
                ),
                _ => format!("table {name}: expected the rows that were sealed, found others"),
            };
            self.report.findings.push(found);
        }
        Ok(())
    }

    /// Drops the seals of earlier legs whose rows are incomplete: they prove nothing any more.
    pub(super) async fn drop_unprovable_seals(&mut self) -> Result<(), SalvageError> {
        for (leg, link) in chain::check(self.conn).await? {
            let PreviousSeal::Mismatch(_) = link else {
                continue;
            };
            for drop in [
                "DELETE FROM previous_table_digest WHERE leg = ?",
                "DELETE FROM previous_seal WHERE leg = ?",
                "UPDATE leg SET previous_tree_sha256 = NULL WHERE number = ?",
            ] {
                sqlx::query(drop).bind(leg).execute(&mut *self.conn).await?;
            }
            self.report.findings.push(format!(
                "leg {leg}: expected the rows under the previous seal, found different ones; that seal was dropped"
            ));
        }
        Ok(())
    }

    /// Finds rows that other rows refer to. An unsealed session has no digests to compare with.
    pub(super) async fn compare_with_each_other(&mut self) -> Result<(), SalvageError> {
        for (missing, what) in MISSING_ROW_QUERIES {
            let count: i64 = sqlx::query_scalar(missing)
                .fetch_one(&mut *self.conn)
                .await?;
            if count > 0 {
                self.report.findings.push(format!("{count} {what}"));
            }
        }
        if self.pages.is_exhausted() {
            self.report
                .findings
                .push("rows share overflow pages: not all of them were read".to_owned());
        }
        Ok(())
    }

    /// Adds a note about the origin of the new file.
    pub(super) async fn note(&mut self, name: &str) -> Result<(), SalvageError> {
        let lost = self.report.tables.iter().filter(|t| t.missing > 0);
        let mut lost: Vec<String> = lost
            .map(|t| format!("{} row(s) of {}", t.missing, t.name))
            .collect();
        lost.extend(self.report.findings.iter().cloned());
        let lost = if lost.is_empty() {
            "no known losses".to_owned()
        } else {
            format!("lost: {}", lost.join("; "))
        };
        let text = format!(
            "salvaged from {name} (SHA-256 {}); {lost}",
            self.report.source_sha256
        );
        sqlx::query(
            "INSERT INTO note (t_ns, text) VALUES ((SELECT coalesce(max(host_ns), 0) FROM chunk), ?)",
        )
        .bind(text)
        .execute(&mut *self.conn)
        .await?;
        Ok(())
    }
}

/// Queries that count missing rows, each with its message.
const MISSING_ROW_QUERIES: [(&str, &str); 6] = [
    (
        "SELECT 1 - count(*) FROM session",
        "row of session missing: the header of the session",
    ),
    (
        "SELECT 3 - count(*) FROM robot_from_skin",
        "row(s) of robot_from_skin missing: the pose of the skin",
    ),
    (
        "SELECT coalesce(max(json_array_length(plan_json, '$.presses')), 0) - (SELECT count(*) FROM press) FROM session",
        "press(es) of the plan missing",
    ),
    (
        "SELECT count(*) FROM (SELECT press FROM attempt UNION SELECT press FROM mark) WHERE press NOT IN (SELECT id FROM press)",
        "press(es) missing to which an attempt or a mark refers",
    ),
    (
        "SELECT count(DISTINCT press) FROM mark WHERE press NOT IN (SELECT press FROM attempt)",
        "press(es) with a mark but no attempt",
    ),
    (
        "SELECT count(*) FROM (SELECT press FROM attempt GROUP BY press HAVING max(number) <> count(*))",
        "press(es) with a missing earlier attempt",
    ),
];
