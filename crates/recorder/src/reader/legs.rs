//! Reading the legs of a session, and the press history that a further leg continues.

use std::collections::BTreeMap;

use skinrig_model::{CameraId, HostTime, PressHistory, PressVerdict, ResumeHeader, RunEnd};

use super::SessionReader;
use crate::cause::{EndColumns, end_from};
use crate::error::RecorderError;
use crate::query::{Fault, has_table, int, num, opt_int, opt_text, text};
use crate::rows::LegRow;

impl SessionReader {
    /// Every leg in order; at least one.
    ///
    /// # Errors
    /// If the file is damaged or its header is not yet written.
    pub fn legs(&self) -> Result<Vec<LegRow>, RecorderError> {
        const DOING: &str = "reading legs";
        let first = "SELECT operator, started_at, host, software, command_line FROM session";
        let mut legs = self.query_all(DOING, first, |row| {
            Ok(LegRow {
                number: 1,
                began: began_from(row)?,
                origin: HostTime::ZERO,
                camera_origin_us: [0; 2],
                first_seq: [0; 2],
                devices_before: 0,
                preflight_before: 0,
                end: None,
                tree_sha256: None,
            })
        })?;
        let mut last = legs.pop().ok_or_else(|| self.no_header())?;
        if self.query(DOING, async |conn| has_table(conn, "leg").await)? {
            for (leg, (end, tree_sha256)) in
                self.query_all(DOING, "SELECT * FROM leg ORDER BY number", further_from)?
            {
                // The row of a leg describes the end of the previous one.
                (last.end, last.tree_sha256) = (end, tree_sha256);
                legs.push(std::mem::replace(&mut last, leg));
            }
        }
        last.end = self.end()?;
        last.tree_sha256 = self.seal()?.map(|seal| seal.tree_sha256);
        legs.push(last);
        Ok(legs)
    }

    /// History of each planned press, in plan order: the starting point of a further leg.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn history(&self) -> Result<Vec<PressHistory>, RecorderError> {
        let ends = self.legs()?.into_iter().map(|leg| leg.end);
        let plan_done = ends
            .into_iter()
            .any(|end| end.is_some_and(|(_, end)| end.is_complete()));
        let known = |attempts: Vec<crate::rows::AttemptRow>| {
            let last = attempts.last()?;
            let verdict = last.outcome.as_ref().map(|o| o.verdict.clone());
            // Without an outcome, the attempt was interrupted. Without fault kinds, it is of an older schema and its cause is unknown.
            let spends = |a: &&crate::rows::AttemptRow| match &a.outcome {
                Some(o) if matches!(o.verdict, PressVerdict::Invalid(_)) => {
                    let kinds = o.verdict.fault_kinds();
                    !o.verdict.is_cut_off()
                        && (kinds.is_empty() || kinds.iter().any(|k| k.is_of_the_place()))
                }
                _ => false,
            };
            let spent = attempts.iter().filter(spends).count();
            let invalid = matches!(verdict, Some(PressVerdict::Invalid(_)));
            Some(PressHistory {
                attempts: last.id.number,
                spent: u32::try_from(spent).unwrap_or(u32::MAX),
                verdict: verdict.filter(|v| !v.is_cut_off()),
                given_back: invalid && !spends(&last),
                plan_done,
            })
        };
        let presses = self.presses()?.into_iter();
        Ok(presses
            .map(|(_, attempts)| known(attempts).unwrap_or_default())
            .collect())
    }

    /// Chunks of `camera` at which its decoder restarts, each with the origin of its times, µs.
    pub(crate) fn restarts(&self, camera: CameraId) -> Result<BTreeMap<u64, u64>, RecorderError> {
        const DOING: &str = "reading legs";
        if !self.query(DOING, async |conn| has_table(conn, "leg").await)? {
            return Ok(BTreeMap::new());
        }
        let sql = match camera {
            CameraId::One => {
                "SELECT first_seq_1 AS seq, camera1_origin_us AS origin_us FROM leg ORDER BY number"
            }
            CameraId::Two => {
                "SELECT first_seq_2 AS seq, camera2_origin_us AS origin_us FROM leg ORDER BY number"
            }
        };
        let restarts = self.query_all(DOING, sql, |row| {
            Ok((num(row, "seq")?, num(row, "origin_us")?))
        })?;
        // If several legs begin with the same chunk, only the last has chunks.
        Ok(restarts.into_iter().collect())
    }
}

fn began_from(row: &sqlx::sqlite::SqliteRow) -> Result<ResumeHeader, Fault> {
    Ok(ResumeHeader {
        operator: text(row, "operator")?,
        started_at: text(row, "started_at")?,
        host: text(row, "host")?,
        software: text(row, "software")?,
        command_line: text(row, "command_line")?,
    })
}

type PreviousLeg = (Option<(HostTime, RunEnd)>, Option<[u8; 32]>);

/// A row of `leg`, and the end and tree hash of the previous leg.
fn further_from(row: &sqlx::sqlite::SqliteRow) -> Result<(LegRow, PreviousLeg), Fault> {
    let leg = LegRow {
        number: num(row, "number")?,
        began: began_from(row)?,
        origin: HostTime(int(row, "origin_ns")?),
        camera_origin_us: [
            num(row, "camera1_origin_us")?,
            num(row, "camera2_origin_us")?,
        ],
        first_seq: [num(row, "first_seq_1")?, num(row, "first_seq_2")?],
        devices_before: num(row, "devices_before")?,
        preflight_before: num(row, "preflight_before")?,
        end: None,
        tree_sha256: None,
    };
    let end = match (
        opt_int(row, "previous_end_ns")?,
        opt_text(row, "previous_status")?,
    ) {
        (None, None) => None,
        (Some(t), Some(_)) => {
            let columns = EndColumns {
                status: "previous_status",
                reason: "previous_reason",
                cause: "previous_cause",
            };
            Some((HostTime(t), end_from(row, &columns)?))
        }
        _ => {
            return Err(Fault::bad(
                "leg",
                "an end with its time or none",
                "only one of them",
            ));
        }
    };
    let tree: Option<Vec<u8>> = sqlx::Row::try_get(row, "previous_tree_sha256")?;
    let tree = tree
        .map(|bytes| {
            <[u8; 32]>::try_from(bytes.as_slice())
                .map_err(|_| Fault::bad("previous_tree_sha256", "32 bytes", bytes.len()))
        })
        .transpose()?;
    Ok((leg, (end, tree)))
}
