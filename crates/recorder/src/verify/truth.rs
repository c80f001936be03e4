//! Checks that the measured values of the journal follow from the recorded poses: position, depth, touched surface and phase times.

use serde::Deserialize;
use skinrig_model::{
    HostDuration, HostTime, PlannedPress, PoseSample, PressOutcome, PressTiming, PressVerdict,
    RunHeader,
};

use super::VerifyReport;
use crate::reader::SessionReader;
use crate::rows::AttemptRow;

/// A measured position is the mean of the poses during the hold. The controller begins it a few samples later than the phase, while the
/// tip settles: larger differences, mm, have another reason.
const SETTLING_MM: f64 = 0.1;
/// The touched surface is where the path is at the contact: larger distances, mm, have another reason than rounded times.
const TOUCH_MM: f64 = 0.02;
/// Contact and release are where the path crosses the surface: larger differences have another reason than noise of the poses.
const CROSSING: HostDuration = HostDuration::from_millis(2);
/// At depth and retract begin at samples: larger differences have another reason than a few samples more or less.
const PHASE: HostDuration = HostDuration::from_millis(20);
/// A set point that changes by more than this between two samples moves, mm; see the controller.
const MOVED_MM: f64 = 1e-3;
/// Fewer samples make no mean.
const MIN_SAMPLES: usize = 3;
/// The path between two samples further apart is unknown.
const LONGEST_STEP: HostDuration = HostDuration::from_millis(50);

/// The limits of the plan within which the tip was settled.
#[derive(Deserialize)]
struct Plan {
    limits: Settling,
}

#[derive(Clone, Copy, Deserialize)]
struct Settling {
    position_tolerance_mm: f64,
    settle_time: HostDuration,
}

/// Poses around a press.
struct Path(Vec<PoseSample>);

pub(super) fn check_truth(reader: &SessionReader, report: &mut VerifyReport) {
    // Other checks report a header, a journal or poses that cannot be read.
    let Ok(header) = reader.header_as_it_is() else {
        return;
    };
    let plan = serde_json::from_str::<Plan>(&header.plan_json).ok();
    let limits = plan.map(|plan| plan.limits);
    let mut without_poses = 0u32;
    for (planned, attempts) in reader.presses().unwrap_or_default() {
        for attempt in attempts {
            let Some((outcome, timing)) = measured(&header, &attempt, report) else {
                continue;
            };
            let mut poses = Vec::new();
            let (from, to) = (timing.approach, timing.clear + LONGEST_STEP);
            let mut add = |samples: &[PoseSample]| poses.extend_from_slice(samples);
            if reader.for_each_pose_block(from, to, &mut add).is_err() {
                continue;
            }
            let path = Path(poses);
            let hold = path.between(timing.at_depth, timing.retract);
            if hold.len() < MIN_SAMPLES {
                without_poses += 1;
                continue;
            }
            path.check_values(&attempt, (&outcome, timing), hold, report);
            // The path of a press that a fault broke off has other phases.
            if outcome.verdict != PressVerdict::Valid {
                continue;
            }
            path.check_times(&attempt, (&outcome, timing), report);
            if let Some(limits) = limits {
                path.check_settled(&attempt, &planned, (&outcome, timing), limits, report);
            }
        }
    }
    if without_poses > 0 {
        report.remarks.push(format!(
            "{without_poses} attempts have no poses, so that nothing confirms their measured positions, depths and times"
        ));
    }
}

/// The outcome of an attempt that was measured, and its times. Only a schedule gives times that nothing measured, and a rig has none.
fn measured(
    header: &RunHeader,
    attempt: &AttemptRow,
    report: &mut VerifyReport,
) -> Option<(PressOutcome, PressTiming)> {
    let outcome = attempt.outcome.clone()?;
    if outcome.scheduled {
        if header.is_of_a_rig() {
            report.mismatch(attempt.id, "measured times", "those of a schedule");
        }
        return None;
    }
    let timing = outcome.timing?;
    Some((outcome, timing))
}

impl Path {
    /// Samples of `from <= t <= to`.
    fn between(&self, from: HostTime, to: HostTime) -> &[PoseSample] {
        let start = self.0.partition_point(|s| s.t < from);
        let end = self.0.partition_point(|s| s.t <= to);
        self.0.get(start..end).unwrap_or_default()
    }

    /// Measured height at `t`, on the line between two samples; `None` where the path is unknown.
    fn height_mm(&self, t: HostTime) -> Option<f64> {
        let next = self.0.partition_point(|s| s.t < t);
        let (b, a) = (self.0.get(next)?, self.0.get(next.saturating_sub(1))?);
        if b.t == t || a.t == b.t {
            return Some(b.measured.z_mm);
        }
        let step = b.t - a.t;
        let share = (t - a.t).0 as f64 / step.0 as f64;
        (step <= LONGEST_STEP)
            .then_some(a.measured.z_mm + share * (b.measured.z_mm - a.measured.z_mm))
    }

    /// Position and depth are means of the hold.
    fn check_values(
        &self,
        attempt: &AttemptRow,
        (outcome, timing): (&PressOutcome, PressTiming),
        hold: &[PoseSample],
        report: &mut VerifyReport,
    ) {
        let n = hold.len() as f64;
        let mut sum = [0.0; 3];
        for sample in hold {
            for (sum, v) in sum.iter_mut().zip(sample.measured.to_array()) {
                *sum += v;
            }
        }
        let [x_mm, y_mm, z_mm] = sum.map(|sum| sum / n);
        if let Some(found) = outcome.measured_at {
            let off_mm = libm::hypot(found.x_mm - x_mm, found.y_mm - y_mm);
            if off_mm > SETTLING_MM || off_mm.is_nan() {
                report.mismatch(
                    attempt.id,
                    format!("the measured position ({x_mm:.3}, {y_mm:.3}) mm of its poses"),
                    format!("({:.3}, {:.3}) mm", found.x_mm, found.y_mm),
                );
            }
        }
        if let Some(found) = outcome.measured_depth_mm {
            let depth_mm = outcome.touched_mm.unwrap_or(0.0) - z_mm;
            let off_mm = (found - depth_mm).abs();
            if off_mm > SETTLING_MM || off_mm.is_nan() {
                report.mismatch(
                    attempt.id,
                    format!("the depth {depth_mm:.3} mm of its poses"),
                    format!("{found:.3} mm"),
                );
            }
        }
        if let (Some(found), Some(touched)) = (outcome.touched_mm, self.height_mm(timing.contact)) {
            let off_mm = (found - touched).abs();
            if off_mm > TOUCH_MM || off_mm.is_nan() {
                report.mismatch(
                    attempt.id,
                    format!("the touched surface at the height {touched:.3} mm of its poses"),
                    format!("{found:.3} mm"),
                );
            }
        }
    }

    /// Time of the first crossing of a height after `from`, downwards or upwards, on the line between two samples.
    fn crossing(&self, from: HostTime, surface_mm: f64, down: bool) -> Option<HostTime> {
        let start = self.0.partition_point(|s| s.t < from);
        let pairs = self.0.get(start..)?.windows(2);
        let above = |s: &PoseSample| s.measured.z_mm > surface_mm;
        let pair = pairs.into_iter().find(|pair| {
            let [a, b] = [above(&pair[0]), above(&pair[1])];
            a != b && a == down
        })?;
        let [za, zb] = [0, 1].map(|k| pair[k].measured.z_mm - surface_mm);
        let step = pair[1].t - pair[0].t;
        let share = za / (za - zb);
        (step <= LONGEST_STEP)
            .then(|| pair[0].t + HostDuration((share * step.0 as f64).round() as i64))
    }

    /// Contact and release are where the tip crosses the surface, retract is where the set point begins to rise.
    fn check_times(
        &self,
        attempt: &AttemptRow,
        (outcome, timing): (&PressOutcome, PressTiming),
        report: &mut VerifyReport,
    ) {
        let surface_mm = outcome.touched_mm.unwrap_or(0.0);
        let down = self.crossing(timing.approach, surface_mm, true);
        let up = self.crossing(timing.retract, surface_mm, false);
        // The touch of a search is a sample; its height is that of the surface.
        let down = down.filter(|_| outcome.touched_mm.is_none());
        for (what, found, crossing) in [
            ("contact", timing.contact, down),
            ("release", timing.release, up),
        ] {
            let Some(expected) = crossing else {
                continue;
            };
            if (found - expected).0.abs() > CROSSING.0 {
                report.mismatch(
                    attempt.id,
                    format!("{what} where the poses cross the surface, at {expected}"),
                    format!("{what} at {found}"),
                );
            }
        }
        let found = timing.retract;
        if let Some(rise) = self.rise(timing.at_depth, timing.clear, surface_mm)
            && (found - rise).0.abs() > PHASE.0
        {
            report.mismatch(
                attempt.id,
                format!("a retraction when the set point begins to rise, at {rise}"),
                format!("one at {found}"),
            );
        }
    }

    /// When the set point begins the rise that lifts it above the surface. One of a press that stopped when it was felt has moved before.
    fn rise(&self, from: HostTime, to: HostTime, surface_mm: f64) -> Option<HostTime> {
        let samples = self.between(from, to);
        let lifted = samples.iter().position(|s| s.commanded.z_mm > surface_mm)?;
        samples[..lifted].iter().rev().find_map(|s| {
            let before = samples.partition_point(|b| b.t < s.t - PHASE);
            let risen_mm = s.commanded.z_mm - samples[before].commanded.z_mm;
            (risen_mm <= MOVED_MM).then_some(s.t)
        })
    }

    /// The tip is at depth once it has been within the tolerance for the settle time.
    fn check_settled(
        &self,
        attempt: &AttemptRow,
        planned: &PlannedPress,
        (outcome, timing): (&PressOutcome, PressTiming),
        limits: Settling,
        report: &mut VerifyReport,
    ) {
        let tolerance_mm = limits.position_tolerance_mm;
        let is_planned = outcome
            .measured_depth_mm
            .is_some_and(|mm| (mm - planned.depth_mm).abs() <= tolerance_mm);
        // A press that stopped when it was felt has another target; one within the tolerance of the surface is settled at once.
        if !is_planned || planned.depth_mm <= 2.0 * tolerance_mm {
            return;
        }
        let bottom_mm = outcome.touched_mm.unwrap_or(0.0) - planned.depth_mm;
        let target = planned.at.at_height(bottom_mm);
        let near = |s: &PoseSample| s.measured.distance_mm(target) <= tolerance_mm;
        let down = self.between(timing.contact, timing.retract);
        let until = down.partition_point(|s| s.t <= timing.at_depth);
        let (before, after) = down.split_at(until);
        let settling = before.iter().rev().take_while(|s| near(s)).last();
        let settled = settling.and_then(|since| {
            let both = before.iter().chain(after);
            both.map(|s| s.t)
                .find(|t| *t - since.t >= limits.settle_time)
        });
        if settled.is_none_or(|t| (t - timing.at_depth).0.abs() > PHASE.0) {
            report.mismatch(
                attempt.id,
                "the tip at depth once its poses have settled",
                format!("at depth at {}", timing.at_depth),
            );
        }
    }
}
