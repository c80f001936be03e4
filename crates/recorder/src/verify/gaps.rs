//! Verification of lost time against the times of the surrounding chunks.

use skinrig_model::CameraId;

use super::report::VerifyReport;
use crate::rows::ChunkMeta;

/// Checks gaps: each belongs to a chunk after lost bytes, begins at the last time before it or earlier, and ends at the first time after
/// it in its leg. Missing chunks in a salvaged file may widen surrounding gaps but never narrow them.
pub(super) fn check(camera: CameraId, index: &[ChunkMeta], report: &mut VerifyReport) {
    let mut after_us = None;
    // Backwards: the first time at or after each chunk, within its leg.
    for (n, meta) in index.iter().enumerate().rev() {
        after_us = meta.facts.first_us.or(after_us);
        if let Some(time) = meta.lost_time {
            let place = format!("gap before {camera} chunk {}", meta.seq);
            if meta.lost_before == 0 {
                report.mismatch(&place, "lost bytes", "none");
            }
            let ends = match (time.to_us, after_us) {
                (Some(to), Some(after)) => to <= after,
                (to, None) => to.is_none() || n + 1 < index.len(),
                (None, Some(_)) => false,
            };
            if !ends {
                let first = describe(after_us);
                report.mismatch(
                    &place,
                    format!("it to end with the first time after it, {first}"),
                    describe(time.to_us),
                );
            }
            let in_leg = index[..n].iter().rev();
            let before_us = match meta.restart_us {
                Some(_) => None,
                None => last_time(in_leg),
            };
            let begins = match (time.from_us, before_us) {
                (Some(from), Some(before)) => {
                    from <= before || time.to_us.is_some_and(|to| from <= to)
                }
                (Some(_), None) => n > 0,
                (None, before) => before.is_none(),
            };
            if !begins {
                let last = describe(before_us);
                report.mismatch(
                    &place,
                    format!("it to begin with the last time before it, {last}, or earlier"),
                    describe(time.from_us),
                );
            }
        }
        if meta.restart_us.is_some() {
            after_us = None;
        }
    }
}

/// Last time in these chunks, which come latest first, within the current leg.
fn last_time<'a>(chunks: impl Iterator<Item = &'a ChunkMeta>) -> Option<u64> {
    for chunk in chunks {
        if chunk.facts.last_us.is_some() || chunk.restart_us.is_some() {
            return chunk.facts.last_us;
        }
    }
    None
}

fn describe(us: Option<u64>) -> String {
    us.map_or_else(|| "none".to_owned(), |us| format!("{us} µs"))
}
