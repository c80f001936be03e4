//! The path of the robot.

use skinrig_model::{HostTime, PoseSample};

use super::SessionReader;
use crate::error::RecorderError;
use crate::from_row::pose_block_from;

impl SessionReader {
    /// Calls `each` with the pose samples of `from <= t <= to` in time order, a block at a time.
    ///
    /// # Errors
    /// At the first damaged block; samples before it have been handed over.
    pub fn for_each_pose_block(
        &self,
        from: HostTime,
        to: HostTime,
        mut each: impl FnMut(&[PoseSample]),
    ) -> Result<(), RecorderError> {
        let mut after = 0;
        while let Some((id, samples)) = self.pose_block_after(after, from, to)? {
            let start = samples.partition_point(|s| s.t < from);
            let end = samples.partition_point(|s| s.t <= to);
            if start < end {
                each(&samples[start..end]);
            }
            after = id;
        }
        Ok(())
    }

    /// The first pose block with an id above `after` that overlaps the span, checked.
    pub(crate) fn pose_block_after(
        &self,
        after: i64,
        from: HostTime,
        to: HostTime,
    ) -> Result<Option<(i64, Vec<PoseSample>)>, RecorderError> {
        self.ask("reading poses", async |conn| {
            let row = sqlx::query(
                "SELECT id, first_ns, last_ns, samples, sha256, data FROM pose_block
                 WHERE id = (SELECT min(id) FROM pose_block WHERE id > ? AND last_ns >= ? AND first_ns <= ?)",
            )
            .bind(after)
            .bind(from.0)
            .bind(to.0)
            .fetch_optional(conn)
            .await?;
            row.map(|row| pose_block_from(&row)).transpose()
        })
    }

    /// The pose samples of `from <= t <= to`, in time order. For spans of some seconds; see
    /// [`for_each_pose_block`](Self::for_each_pose_block) for long ones.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn poses(&self, from: HostTime, to: HostTime) -> Result<Vec<PoseSample>, RecorderError> {
        let mut poses = Vec::new();
        self.for_each_pose_block(from, to, |block| poses.extend_from_slice(block))?;
        Ok(poses)
    }
}
