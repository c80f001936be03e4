//! Timing of contacts and descents from the pose stream of a session.

use skinrig_analysis::Descent;
use skinrig_model::{HostDuration, HostTime, PlannedPress, PoseSample, PressOutcome, PressRole};
use skinrig_online::{TipCourse, TipCourses};
use skinrig_recorder::{RecorderError, SessionReader};

/// Maximum number of contacts to examine, evenly spread.
const MAX_CONTACTS: usize = 100;
/// Poses are read this far on each side of a contact, ms.
const SIDE_MS: i64 = 20;
/// Maximum duration of a descent before its contact.
const LONGEST_DESCENT: HostDuration = HostDuration::from_millis(2_000);
/// The tip's path is assumed straight this far on each side of a contact, ms.
const STRAIGHT_MS: i64 = 5;

/// (RMS interval between the two pose samples around a measured contact, RMS standard error of the instant at which the pose
/// crossed the surface), µs: the contact is interpolated between noisy samples. `None` without measured contacts.
///
/// # Errors
/// When the poses cannot be read.
pub(crate) fn timing(
    reader: &SessionReader,
    outcomes: &[Option<PressOutcome>],
) -> Result<(Option<f64>, Option<f64>), RecorderError> {
    let side = HostDuration::from_millis(SIDE_MS);
    let measured = outcomes.iter().flatten().filter(|o| !o.scheduled);
    let contacts: Vec<HostTime> = measured.filter_map(|o| Some(o.timing?.contact)).collect();
    let (mut intervals, mut errors) = (Squares::default(), Squares::default());
    for contact in contacts
        .iter()
        .step_by(contacts.len().div_ceil(MAX_CONTACTS).max(1))
    {
        let poses = reader.poses(*contact - side, *contact + side)?;
        let after = poses.partition_point(|p| p.t < *contact);
        if let Some([before, after]) = poses.get(after.saturating_sub(1)..=after) {
            intervals.add((after.t.0 - before.t.0) as f64 * 1e-3);
        }
        if let Some(error_us) = crossing_se_us(&poses, *contact) {
            errors.add(error_us);
        }
    }
    Ok((intervals.rms(), errors.rms()))
}

/// Descents to the contacts whose height was taken from the frame, for at most 100 presses, evenly spread.
///
/// # Errors
/// When the poses cannot be read.
pub(crate) fn descents(
    reader: &SessionReader,
    outcomes: &[Option<PressOutcome>],
) -> Result<Vec<Option<Descent>>, RecorderError> {
    let of_frame = |o: &PressOutcome| {
        let told_by_touch = o.scheduled || o.touched_mm.is_some();
        o.timing.filter(|_| !told_by_touch)
    };
    let mut found = vec![None; outcomes.len()];
    let rows = outcomes.iter().enumerate();
    let ways: Vec<_> = rows
        .filter_map(|(row, o)| Some((row, of_frame(o.as_ref()?)?)))
        .collect();
    for (row, timing) in ways
        .iter()
        .step_by(ways.len().div_ceil(MAX_CONTACTS).max(1))
    {
        let begin = timing.approach.max(timing.contact - LONGEST_DESCENT);
        let poses = reader.poses(begin, timing.contact)?;
        found[*row] = Some(descent(&poses));
    }
    Ok(found)
}

/// The way of the tip during every press of these roles whose depth was measured.
///
/// # Errors
/// When the poses cannot be read.
pub(crate) fn tip_courses(
    reader: &SessionReader,
    planned: &[PlannedPress],
    outcomes: &[Option<PressOutcome>],
    scored: bool,
) -> Result<TipCourses, RecorderError> {
    let mut courses = TipCourses::new();
    for (press, outcome) in planned.iter().zip(outcomes) {
        let measured = outcome.as_ref().filter(|o| !o.scheduled);
        let wanted = measured.filter(|_| (press.role == PressRole::Score) == scored);
        let Some((outcome, timing)) = wanted.and_then(|o| Some((o, o.timing?))) else {
            continue;
        };
        let surface_mm = outcome.touched_mm.unwrap_or(0.0);
        let side = HostDuration::from_millis(SIDE_MS);
        let poses = reader.poses(timing.contact - side, timing.retract)?;
        let depth = |p: &PoseSample| (p.t.0 as f64 * 1e-3, surface_mm - p.measured.z_mm);
        courses.insert(press.id, TipCourse::new(poses.iter().map(depth)));
    }
    Ok(courses)
}

/// Mean force during the hold of each press, N; empty if the planned depths are all the same, `None` for a press without
/// reported forces.
///
/// # Errors
/// When the poses cannot be read.
pub(crate) fn hold_forces(
    reader: &SessionReader,
    planned: &[PlannedPress],
    outcomes: &[Option<PressOutcome>],
) -> Result<Vec<Option<f64>>, RecorderError> {
    let mut own = planned.iter().filter(|p| p.role != PressRole::Sync);
    let first = own.next().map(|p| p.depth_mm);
    if own.all(|p| Some(p.depth_mm) == first) {
        return Ok(Vec::new());
    }
    let of = |outcome: &Option<PressOutcome>| {
        let reported = outcome
            .as_ref()
            .filter(|o| !o.scheduled && o.peak_force_n.is_some());
        let Some(timing) = reported.and_then(|o| o.timing) else {
            return Ok(None);
        };
        let poses = reader.poses(timing.at_depth, timing.retract)?;
        let sum: f64 = poses.iter().map(|p| p.force_n).sum();
        Ok((!poses.is_empty()).then(|| sum / poses.len() as f64))
    };
    outcomes.iter().map(of).collect()
}

/// The descent at the end of these poses.
fn descent(poses: &[PoseSample]) -> Descent {
    let heights = (1..=Descent::STEPS).map(|k| k as f64 * Descent::STEP_MM);
    let last_above = heights.map_while(|mm| {
        let above = poses.iter().rfind(|p| p.measured.z_mm > mm)?;
        Some(above.t)
    });
    Descent {
        last_above: last_above.collect(),
    }
}

/// Standard error of the instant at which a straight line through the heights around `contact` reaches its height there, µs:
/// that of the height divided by the speed. `None` if the tip does not move.
fn crossing_se_us(poses: &[PoseSample], contact: HostTime) -> Option<f64> {
    let near = HostDuration::from_millis(STRAIGHT_MS);
    let points: Vec<(f64, f64)> = poses
        .iter()
        .filter(|p| contact - near <= p.t && p.t <= contact + near)
        .map(|p| ((p.t - contact).as_secs_f64(), p.measured.z_mm))
        .collect();
    let n = points.len() as f64;
    if points.len() < 4 {
        return None;
    }
    let (mean_t, mean_z) = (
        points.iter().map(|p| p.0).sum::<f64>() / n,
        points.iter().map(|p| p.1).sum::<f64>() / n,
    );
    let spread: f64 = points.iter().map(|p| (p.0 - mean_t).powi(2)).sum();
    let product: f64 = points.iter().map(|p| (p.0 - mean_t) * (p.1 - mean_z)).sum();
    let speed_mm_s = product / spread;
    let squares: f64 = points
        .iter()
        .map(|p| (p.1 - mean_z - speed_mm_s * (p.0 - mean_t)).powi(2))
        .sum();
    let height_se_mm = (squares / (n - 2.0) * (1.0 / n + mean_t * mean_t / spread)).sqrt();
    let error_us = height_se_mm / speed_mm_s.abs() * 1e6;
    error_us.is_finite().then_some(error_us)
}

/// Sum of squares.
#[derive(Default)]
struct Squares {
    sum: f64,
    n: u32,
}

impl Squares {
    fn add(&mut self, value: f64) {
        self.sum += value * value;
        self.n += 1;
    }

    fn rms(&self) -> Option<f64> {
        (self.n > 0).then(|| (self.sum / f64::from(self.n)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::Point3;

    #[test]
    fn crossing_time_error_is_noise_over_speed() {
        let pose = |ms: i64, z_mm: f64| {
            let at = Point3::new(0.0, 0.0, z_mm);
            PoseSample {
                t: HostTime(1_000_000_000 + ms * 1_000_000),
                commanded: at,
                measured: at,
                force_n: 0.0,
            }
        };
        // 20 mm/s downwards, heights off by 10 µm up and down: residuals of 10 µm, 11 samples.
        let off = |ms: i64| if ms % 2 == 0 { 0.01 } else { -0.01 };
        let poses: Vec<_> = (-20..=20)
            .map(|ms| pose(ms, -0.02 * ms as f64 + off(ms)))
            .collect();
        let found = crossing_se_us(&poses, HostTime(1_000_000_000)).unwrap();
        let expected = 10.0 * (11.0f64 / 9.0).sqrt() / 11f64.sqrt() / 20.0 * 1e3;
        assert!((found / expected - 1.0).abs() < 0.02, "{found} {expected}");
        let still: Vec<_> = (-20..=20).map(|ms| pose(ms, 1.0)).collect();
        assert_eq!(crossing_se_us(&still, HostTime(1_000_000_000)), None);
    }
}
