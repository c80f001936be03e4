//! Checks that the measured positions of the journal follow from the recorded poses.

use skinrig_model::PoseSample;

use super::VerifyReport;
use crate::reader::SessionReader;

/// A measured position is the mean of the poses during the hold. The controller begins it a few samples later than the phase, while the
/// tip settles: larger differences, mm, have another reason.
const SETTLING_MM: f64 = 0.1;
/// Fewer samples make no mean.
const MIN_SAMPLES: usize = 3;

pub(super) fn check_truth(reader: &SessionReader, report: &mut VerifyReport) {
    // Other checks report a journal or poses that cannot be read.
    for (_, attempts) in reader.presses().unwrap_or_default() {
        for attempt in attempts {
            let Some(outcome) = attempt.outcome.filter(|outcome| !outcome.scheduled) else {
                continue;
            };
            let (Some(timing), Some(measured)) = (outcome.timing, outcome.measured_at) else {
                continue;
            };
            let (mut n, mut sum) = (0, [0.0; 2]);
            let mut add = |samples: &[PoseSample]| {
                n += samples.len();
                for sample in samples {
                    sum[0] += sample.measured.x_mm;
                    sum[1] += sample.measured.y_mm;
                }
            };
            let read = reader.for_each_pose_block(timing.at_depth, timing.retract, &mut add);
            if read.is_err() || n < MIN_SAMPLES {
                continue;
            }
            let [x_mm, y_mm] = sum.map(|sum| sum / n as f64);
            let off_mm = f64::hypot(measured.x_mm - x_mm, measured.y_mm - y_mm);
            if off_mm > SETTLING_MM || off_mm.is_nan() {
                report.mismatch(
                    attempt.id,
                    format!("the measured position ({x_mm:.3}, {y_mm:.3}) mm of its poses"),
                    format!("({:.3}, {:.3}) mm", measured.x_mm, measured.y_mm),
                );
            }
        }
    }
}
