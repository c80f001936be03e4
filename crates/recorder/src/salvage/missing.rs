//! What did not come back: held against the seal and against what other rows say, and told in the new file.

use super::cells::Value;
use super::fill::{Failed, Filling};
use super::gather::Found;
use super::shapes::Part;
use crate::chain::{self, Link};
use crate::digest;

impl Filling<'_> {
    /// Compares each table with the digest that it was sealed with, when that came back.
    pub(super) async fn compare_with_seal(&mut self) -> Result<(), Failed> {
        let sealed = self
            .shapes
            .iter()
            .zip(self.rows)
            .find(|(s, _)| s.kind.name == "table_digest");
        let Some((_, sealed)) = sealed.filter(|(_, rows)| !rows.rows.is_empty()) else {
            return Ok(());
        };
        for digest in digest::digest_tables(self.conn).await? {
            let key = vec![Part::Text(digest.name.clone())];
            let Some(Found::Row(row)) = sealed.rows.get(&key) else {
                continue;
            };
            if row.get(2) == Some(&Value::Blob(digest.sha256.to_vec())) {
                continue;
            }
            let rows = match row.get(1) {
                Some(Value::Int(n)) => n.to_string(),
                _ => "unknown".to_owned(),
            };
            self.report.findings.push(format!(
                "table {}: expected the {rows} rows that were sealed, found {} rows or other values",
                digest.name, digest.rows
            ));
        }
        Ok(())
    }

    /// A seal before a leg whose rows did not all come back proves nothing any more, and is left out.
    pub(super) async fn drop_broken_links(&mut self) -> Result<(), Failed> {
        for (leg, link) in chain::check(self.conn).await? {
            let Link::Broken(_) = link else { continue };
            for drop in [
                "DELETE FROM previous_table_digest WHERE leg = ?",
                "DELETE FROM previous_seal WHERE leg = ?",
                "UPDATE leg SET previous_tree_sha256 = NULL WHERE number = ?",
            ] {
                sqlx::query(drop).bind(leg).execute(&mut *self.conn).await?;
            }
            self.report.findings.push(format!(
                "leg {leg}: expected the rows that the seal before it covers, found others; that seal was left out"
            ));
        }
        Ok(())
    }

    /// What rows that came back say of rows that did not: an unsealed session has no digests to hold against.
    pub(super) async fn compare_with_each_other(&mut self) -> Result<(), Failed> {
        for (missing, what) in ABSENT {
            let count: i64 = sqlx::query_scalar(missing)
                .fetch_one(&mut *self.conn)
                .await?;
            if count > 0 {
                self.report.findings.push(format!("{count} {what}"));
            }
        }
        if self.pages.is_exhausted() {
            self.report.findings.push(
                "rows go on to the same pages over and over: not all of them were read".to_owned(),
            );
        }
        Ok(())
    }

    /// The new file tells where it comes from.
    pub(super) async fn note(&mut self, name: &str) -> Result<(), Failed> {
        let lost = self.report.tables.iter().filter(|t| t.missing > 0);
        let mut lost: Vec<String> = lost
            .map(|t| format!("{} row(s) of {}", t.missing, t.name))
            .collect();
        lost.extend(self.report.findings.iter().cloned());
        let lost = if lost.is_empty() {
            "nothing known to be lost".to_owned()
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

/// Counts what must be there and is not, each with its words.
const ABSENT: [(&str, &str); 6] = [
    (
        "SELECT 1 - count(*) FROM session",
        "row of session missing: what the session is",
    ),
    (
        "SELECT 3 - count(*) FROM robot_from_skin",
        "row(s) of robot_from_skin missing: where the skin lies",
    ),
    (
        "SELECT coalesce(max(json_array_length(plan_json, '$.presses')), 0) - (SELECT count(*) FROM press) FROM session",
        "press(es) of the plan missing",
    ),
    (
        "SELECT count(*) FROM (SELECT press FROM attempt UNION SELECT press FROM mark) WHERE press NOT IN (SELECT id FROM press)",
        "press(es) missing that an attempt or a mark names",
    ),
    (
        "SELECT count(DISTINCT press) FROM mark WHERE press NOT IN (SELECT press FROM attempt)",
        "press(es) with a mark and without an attempt",
    ),
    (
        "SELECT count(*) FROM (SELECT press FROM attempt GROUP BY press HAVING max(number) <> count(*))",
        "press(es) of which an earlier attempt is missing",
    ),
];
