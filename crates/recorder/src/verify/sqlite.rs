//! Verification by SQLite itself: its integrity check and the foreign keys.

use super::report::VerifyReport;
use crate::query::{each_row, text};
use crate::reader::SessionReader;

pub(super) fn check(reader: &SessionReader, report: &mut VerifyReport) {
    let messages = reader.query("checking its integrity", async |conn| {
        let messages: Vec<String> = sqlx::query_scalar("PRAGMA integrity_check")
            .fetch_all(&mut *conn)
            .await?;
        let mut problems: Vec<String> = messages.into_iter().filter(|m| m != "ok").collect();
        let orphans = sqlx::query("SELECT \"table\", parent FROM pragma_foreign_key_check");
        each_row(orphans, conn, |row| {
            let (child, parent) = (text(row, "table")?, text(row, "parent")?);
            problems.push(format!(
                "a row of {child} refers to a missing row of {parent}"
            ));
            Ok(())
        })
        .await?;
        Ok(problems)
    });
    for message in report.ok_or_add(messages).unwrap_or_default() {
        report.mismatch("sqlite", "an intact database", message);
    }
}
