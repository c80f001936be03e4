//! Offsets of a further leg: moves its times and chunk numbers behind those of the earlier legs.

use skinrig_model::{BoxReport, HostTime, Record};

use crate::error::RecorderError;

/// Offsets from a leg's own clocks and chunk numbers to those of the session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct LegOffset {
    /// Added to every host time, ns.
    pub origin_ns: i64,
    /// Added to every time on a camera's clock, µs.
    pub camera_origin_us: [u64; 2],
    /// Added to every chunk number.
    pub first_seq: [u64; 2],
}

/// Start of the next leg: the first whole second at least one second after `last`, in units of `1 / per_second` seconds.
/// 0 without a `last`. `None` beyond half of the range, where no leg would fit.
pub(crate) fn next_second(last: Option<i64>, per_second: i64) -> Option<i64> {
    let Some(last) = last else { return Some(0) };
    let next = (last.max(0) / per_second).checked_add(2)?;
    next.checked_mul(per_second).filter(|t| *t <= i64::MAX / 2)
}

impl LegOffset {
    /// The record with the session's times and chunk numbers.
    ///
    /// # Errors
    /// [`RecorderError::Record`] if a time or chunk number overflows.
    pub(crate) fn apply(&self, mut record: Record) -> Result<Record, RecorderError> {
        match self.shift(&mut record) {
            Some(()) => Ok(record),
            None => Err(RecorderError::Record {
                record: "times of a further leg".into(),
                expected: "times and chunk numbers that fit after those of the earlier legs".into(),
                found: "one that overflows".into(),
            }),
        }
    }

    fn shift(&self, record: &mut Record) -> Option<()> {
        let later = |t: &mut HostTime| {
            t.0 = t.0.checked_add(self.origin_ns)?;
            Some(())
        };
        match record {
            Record::Started(_)
            | Record::Resumed(_)
            | Record::Device { .. }
            | Record::Preflight(_)
            | Record::Notification(_)
            | Record::Missed(..) => {}
            Record::Intent { t, .. }
            | Record::Command { t, .. }
            | Record::Interruption { t, .. }
            | Record::Note { t, .. }
            | Record::Ended { t, .. } => later(t)?,
            Record::MarkSent(mark) => later(&mut mark.t)?,
            Record::Touch(estimate) => {
                later(&mut estimate.t)?;
                later(&mut estimate.until)?;
            }
            Record::Poses(samples) => {
                for sample in samples {
                    later(&mut sample.t)?;
                }
            }
            Record::BoxReports { t, reports } => {
                later(t)?;
                for report in reports {
                    match report {
                        BoxReport::Exchange { sent, received, .. } => {
                            later(sent)?;
                            later(received)?;
                        }
                        BoxReport::Reset { noticed } => later(noticed)?,
                        BoxReport::Mark { .. }
                        | BoxReport::Sync { .. }
                        | BoxReport::Input { .. } => {}
                    }
                }
            }
            Record::Outcome(outcome) => {
                if let Some(t) = &mut outcome.timing {
                    for moment in [
                        &mut t.approach,
                        &mut t.contact,
                        &mut t.at_depth,
                        &mut t.retract,
                        &mut t.release,
                        &mut t.clear,
                    ] {
                        later(moment)?;
                    }
                }
            }
            Record::Chunk(chunk) => {
                let camera = chunk.camera.index();
                let origin_us = self.camera_origin_us[camera];
                later(&mut chunk.host_time)?;
                chunk.seq = chunk.seq.checked_add(self.first_seq[camera])?;
                let facts = [
                    &mut chunk.facts.first_us,
                    &mut chunk.facts.last_us,
                    &mut chunk.lost_from_us,
                ];
                let edges = chunk.triggers.iter_mut().map(|edge| &mut edge.t_us);
                for t_us in facts.into_iter().flatten().chain(edges) {
                    *t_us = t_us.checked_add(origin_us)?;
                }
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leg_begins_at_a_whole_second_after_all_records() {
        for (last, next) in [
            (None, Some(0)),
            (Some(-5), Some(2_000)),
            (Some(0), Some(2_000)),
            (Some(999), Some(2_000)),
            (Some(1_000), Some(3_000)),
            (Some(i64::MAX), None),
        ] {
            assert_eq!(next_second(last, 1_000), next, "{last:?}");
        }
    }

    #[test]
    fn a_time_beyond_the_end_is_rejected() {
        let offset = LegOffset {
            origin_ns: 2_000_000_000,
            ..LegOffset::default()
        };
        let note = |t| Record::Note {
            t: HostTime(t),
            text: String::new(),
        };
        assert_eq!(offset.apply(note(1)).unwrap(), note(2_000_000_001));
        assert!(matches!(
            offset.apply(note(i64::MAX)),
            Err(RecorderError::Record { .. })
        ));
    }
}
