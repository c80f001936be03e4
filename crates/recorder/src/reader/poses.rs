//! Reading the measured path of the robot.

use skinrig_model::{HostTime, PoseSample};

use super::SessionReader;
use crate::error::RecorderError;
use crate::from_row::pose_block_from;
use crate::query::{Fault, num};

/// Uses the index over the blocks' end times: a long session has thousands of blocks between its chunks.
const BLOCK_ENDING_AFTER: &str = EXPLAINED.split_at(EXPLAIN.len()).1;
/// The same with EXPLAIN, for the test of the index: a statement must be a literal.
const EXPLAINED: &str = "EXPLAIN QUERY PLAN SELECT id, first_ns, last_ns, samples, sha256, data FROM pose_block
     WHERE id = (SELECT id FROM pose_block WHERE last_ns >= ?1 AND (last_ns > ?1 OR id > ?2) ORDER BY last_ns, id LIMIT 1)
     AND first_ns <= ?3";
const EXPLAIN: &str = "EXPLAIN QUERY PLAN ";

impl SessionReader {
    /// Calls `each` with the pose samples of `from <= t <= to` in time order, one block at a time.
    ///
    /// # Errors
    /// At the first damaged block, after passing on all earlier samples.
    pub fn for_each_pose_block(
        &self,
        from: HostTime,
        to: HostTime,
        mut each: impl FnMut(&[PoseSample]),
    ) -> Result<(), RecorderError> {
        let mut after = (from, i64::MIN);
        while let Some((id, samples)) = self.pose_block_ending_after(after, to)? {
            let start = samples.partition_point(|s| s.t < from);
            let end = samples.partition_point(|s| s.t <= to);
            if start < end {
                each(&samples[start..end]);
            }
            let Some(last) = samples.last() else {
                break;
            };
            after = (last.t, id);
        }
        Ok(())
    }

    /// The first pose block that ends at `from` or later, after block `id` if both end at the same time; checked.
    /// `None` if it begins after `to`. Blocks are in time order.
    fn pose_block_ending_after(
        &self,
        (end, id): (HostTime, i64),
        to: HostTime,
    ) -> Result<Option<(i64, Vec<PoseSample>)>, RecorderError> {
        self.query("reading poses", async |conn| {
            let row = sqlx::query(BLOCK_ENDING_AFTER)
                .bind(end.0)
                .bind(id)
                .bind(to.0)
                .fetch_optional(conn)
                .await?;
            let found = row.map(|row| pose_block_from(&row)).transpose()?;
            let Some((block, samples)) = found else {
                return Ok(None);
            };
            // In a damaged file, the search may find an earlier block again and again.
            match samples.last() {
                Some(last) if (last.t, block) <= (end, id) => Err(misplaced(block)),
                _ => Ok(Some((block, samples))),
            }
        })
    }

    /// Number of pose samples.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn pose_samples(&self) -> Result<u64, RecorderError> {
        self.query("counting poses", async |conn| {
            let sql = "SELECT coalesce(sum(samples), 0) AS n FROM pose_block";
            let row = sqlx::query(sql).fetch_one(conn).await?;
            num(&row, "n")
        })
    }

    /// The first pose block with an id above `after`, checked.
    pub(crate) fn pose_block_after(
        &self,
        after: i64,
    ) -> Result<Option<(i64, Vec<PoseSample>)>, RecorderError> {
        self.query("reading poses", async |conn| {
            let row = sqlx::query(
                "SELECT id, first_ns, last_ns, samples, sha256, data FROM pose_block
                 WHERE id > ? ORDER BY id LIMIT 1",
            )
            .bind(after)
            .fetch_optional(conn)
            .await?;
            match row.map(|row| pose_block_from(&row)).transpose()? {
                Some((block, _)) if block <= after => Err(misplaced(block)),
                found => Ok(found),
            }
        })
    }

    /// Pose samples of `from <= t <= to`, in time order. For spans of seconds; use
    /// [`for_each_pose_block`](Self::for_each_pose_block) for long ones.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn poses(&self, from: HostTime, to: HostTime) -> Result<Vec<PoseSample>, RecorderError> {
        let mut poses = Vec::new();
        self.for_each_pose_block(from, to, |block| poses.extend_from_slice(block))?;
        Ok(poses)
    }
}

fn misplaced(block: i64) -> Fault {
    let place = format!("pose block {block}");
    Fault::bad(place, "blocks in order", "this one after a later one")
}

#[cfg(test)]
mod tests {
    use sqlx::{Connection as _, Row as _, SqliteConnection};

    use super::EXPLAINED;
    use crate::migrations::MIGRATOR;

    #[test]
    fn finding_a_block_does_not_scan_the_others() {
        let plan = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .unwrap()
            .block_on(async {
                let mut conn = SqliteConnection::connect("sqlite::memory:").await?;
                MIGRATOR.run(&mut conn).await?;
                sqlx::query(EXPLAINED).fetch_all(&mut conn).await
            })
            .unwrap();
        let steps: Vec<String> = plan.iter().map(|row| row.get("detail")).collect();
        assert!(
            steps
                .iter()
                .any(|s| s.contains("pose_block_by_time (last_ns>?)")),
            "{steps:?}"
        );
        assert!(!steps.iter().any(|s| s.contains("SCAN")), "{steps:?}");
    }
}
