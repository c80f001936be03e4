//! Estimated durations of the steps of a plan, for deadlines, feasibility and summaries.
//!
//! The estimate moves along each straight line with a trapezoidal speed profile of an assumed acceleration. It affects
//! deadlines, the check of periods and printed durations only, never measured values.

use skinrig_model::{HostDuration, MarkKind, Point3, Skin};

use crate::plan::{Plan, PressStep, RunLimits, Step};
use crate::surface::Surface;

/// Acceleration assumed for estimates, mm/s². Chosen by this project, far below the limits of a haptic robot.
pub(crate) const ASSUMED_ACCELERATION_MM_S2: f64 = 1000.0;
/// A period must be this many times the estimated time of its press.
pub(crate) const FIT_RESERVE: f64 = 1.1;
/// A deadline is this many times the estimate ...
pub(crate) const DEADLINE_FACTOR: f64 = 3.0;
/// ... plus this, s.
pub(crate) const DEADLINE_SLACK_S: f64 = 1.0;

/// Speed of motions that are not steps of the plan, mm/s: the controller's default; never more than the plan's own limit.
pub(crate) const OWN_SPEED_MM_S: f64 = 20.0;

/// Time of a straight motion from rest to rest, s.
#[must_use]
pub(crate) fn motion_s(distance_mm: f64, speed_mm_s: f64) -> f64 {
    let ramp = speed_mm_s * speed_mm_s / ASSUMED_ACCELERATION_MM_S2;
    if distance_mm > ramp {
        distance_mm / speed_mm_s + speed_mm_s / ASSUMED_ACCELERATION_MM_S2
    } else {
        2.0 * (distance_mm / ASSUMED_ACCELERATION_MM_S2).sqrt()
    }
}

/// Estimated moments of a press, s after its start, in order: the marks, without the end.
pub(crate) fn moments_s(limits: &RunLimits, press: &PressStep) -> [(MarkKind, f64); 5] {
    let settle = limits.settle_time.as_secs_f64();
    // Mean case: a touched surface lies at the frame's surface.
    let contact = match press.surface {
        Surface::Known => motion_s(limits.clearance_mm, press.approach_speed_mm_s) + settle,
        Surface::Touch(t) => {
            let way = (limits.clearance_mm - t.band_mm).max(0.0);
            motion_s(way, press.approach_speed_mm_s) + settle + t.band_mm / t.speed_mm_s
        }
    };
    let at_depth = contact + motion_s(press.depth_mm, press.indent_speed_mm_s) + settle;
    let retract = at_depth + press.hold.as_secs_f64();
    let release = retract + press.depth_mm / press.retract_speed_mm_s;
    [
        (MarkKind::Approach, 0.0),
        (MarkKind::Contact, contact),
        (MarkKind::AtDepth, at_depth),
        (MarkKind::Retract, retract),
        (MarkKind::Release, release),
    ]
}

/// Estimated time of a press in motion and at rest (hold and three times settling), s.
pub(crate) fn press_s(limits: &RunLimits, press: &PressStep) -> (f64, f64) {
    // Worst case: a touched surface is found at the lower end of its band.
    let (search, tare) = match press.surface {
        Surface::Known => (0.0, 0.0),
        Surface::Touch(t) => (
            motion_s(2.0 * t.band_mm, t.speed_mm_s) + limits.settle_time.as_secs_f64(),
            t.tare.as_secs_f64(),
        ),
    };
    let motion = search
        + motion_s(limits.clearance_mm, press.approach_speed_mm_s)
        + motion_s(press.depth_mm, press.indent_speed_mm_s)
        + motion_s(
            limits.clearance_mm + press.depth_mm,
            press.retract_speed_mm_s,
        );
    let still = tare + press.hold.as_secs_f64() + 3.0 * limits.settle_time.as_secs_f64();
    (motion, still)
}

/// Estimated time of a travel with settling, s.
pub(crate) fn travel_s(limits: &RunLimits, distance_mm: f64, speed_mm_s: f64) -> f64 {
    motion_s(distance_mm, speed_mm_s) + limits.settle_time.as_secs_f64()
}

/// Estimated time of all surface checks, s: one before the first press, and one after each repetition if
/// configured. Mean case: the surface lies at the frame's surface.
pub(crate) fn surface_checks_s(plan: &Plan) -> f64 {
    let Some(check) = &plan.surface_check else {
        return 0.0;
    };
    let (limits, search) = (&plan.limits, &check.search);
    let speed = OWN_SPEED_MM_S.min(limits.max_speed_mm_s);
    let down = (limits.clearance_mm - search.band_mm).max(0.0);
    let touch = search.tare.as_secs_f64()
        + travel_s(limits, down, speed)
        + search.band_mm / search.speed_mm_s
        + travel_s(limits, limits.clearance_mm, speed);
    let first_press = plan.steps.iter().find_map(|step| match step {
        Step::Press(p) => Some(p.at),
        _ => None,
    });
    // From near the presses to every point, and back.
    let stops = || first_press.iter().chain(&check.points);
    let next = stops().skip(1).chain(stops().take(1));
    let ways: f64 = stops()
        .zip(next)
        .map(|(from, to)| travel_s(limits, from.distance_mm(*to), speed))
        .sum();
    let is_repetition =
        |step: &&Step| matches!(step, Step::Begin { repetition } if repetition.is_some());
    let repetitions = plan.steps.iter().filter(is_repetition).count();
    let times = 1 + if check.each_repetition {
        repetitions
    } else {
        0
    };
    times as f64 * (ways + check.points.len() as f64 * touch)
}

/// Deadline for a step with this estimated duration.
pub(crate) fn deadline(estimate_s: f64) -> HostDuration {
    HostDuration::from_secs_f64(estimate_s * DEADLINE_FACTOR + DEADLINE_SLACK_S)
}

/// Presses that differ in more than their location, to check timing once for each kind.
pub(crate) fn distinct_presses(plan: &Plan) -> Vec<&PressStep> {
    let mut kinds: Vec<&PressStep> = Vec::new();
    for step in &plan.steps {
        if let Step::Press(p) = step
            && !kinds.iter().any(|k| k.depth_mm == p.depth_mm)
        {
            kinds.push(p);
        }
    }
    kinds
}

/// A press that does not fit between its start and the next one's.
pub(crate) struct TimingConflict {
    pub sync: bool,
    pub press: String,
    pub needed_s: f64,
    pub period_s: f64,
    pub motion_s: f64,
    pub still_s: f64,
    pub travel_s: f64,
}

/// The press that exceeds its period most, if any.
pub(crate) fn first_misfit(plan: &Plan) -> Option<TimingConflict> {
    let mut worst: Option<TimingConflict> = None;
    let mut sync = false;
    let mut before: Option<&PressStep> = None;
    let mut position: Option<Point3<Skin>> = None;
    let mut travel = 0.0;
    for step in &plan.steps {
        match step {
            Step::Begin { repetition } => {
                sync = repetition.is_none();
                before = None;
                travel = 0.0;
            }
            Step::Travel { to, speed_mm_s, .. } => {
                let distance = position.map_or(0.0, |p| p.distance_mm(*to));
                travel += travel_s(&plan.limits, distance, *speed_mm_s);
                position = Some(*to);
            }
            Step::Pause { duration } => travel += duration.as_secs_f64(),
            Step::Look { .. } | Step::Learn => {}
            Step::Press(press) => {
                position = Some(press.at.at_height(plan.limits.clearance_mm));
                if let (Some(previous), Some(start)) = (before, press.start_after_begin)
                    && let Some(from) = previous.start_after_begin
                {
                    let (motion, still) = press_s(&plan.limits, previous);
                    let needed = (motion + still + travel) * FIT_RESERVE;
                    let period = (start.0 - from.0) as f64 * 1e-9;
                    let excess = |m: &TimingConflict| m.needed_s - m.period_s;
                    if needed > period && worst.as_ref().is_none_or(|w| needed - period > excess(w))
                    {
                        worst = Some(TimingConflict {
                            sync,
                            press: previous.press.to_string(),
                            needed_s: needed,
                            period_s: period,
                            motion_s: motion,
                            still_s: still,
                            travel_s: travel,
                        });
                    }
                }
                before = Some(press);
                travel = 0.0;
            }
        }
    }
    worst
}

/// Estimated duration of the whole plan, s, and of the time that the tip is in contact with the skin, s.
pub(crate) fn duration_s(plan: &Plan) -> (f64, f64) {
    let limits = &plan.limits;
    let (mut now, mut begin, mut contact) = (0.0f64, 0.0f64, 0.0f64);
    let mut position: Option<Point3<Skin>> = None;
    for step in &plan.steps {
        match step {
            Step::Begin { .. } => begin = now,
            Step::Travel { to, speed_mm_s, .. } => {
                now += travel_s(
                    limits,
                    position.map_or(0.0, |p| p.distance_mm(*to)),
                    *speed_mm_s,
                );
                position = Some(*to);
            }
            Step::Pause { duration } => now += duration.as_secs_f64(),
            Step::Look { .. } | Step::Learn => {}
            Step::Press(press) => {
                if let Some(start) = press.start_after_begin {
                    now = now.max(begin + start.as_secs_f64());
                }
                let (motion, still) = press_s(limits, press);
                now += motion + still;
                let [_, (_, down), _, _, (_, up)] = moments_s(limits, press);
                contact += up - down;
                position = Some(press.at.at_height(limits.clearance_mm));
            }
        }
    }
    (now + surface_checks_s(plan), contact)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trapezoid_and_triangle() {
        // 100 mm at 50 mm/s: 2 s, and 50/1000 s for the two ramps together.
        assert!((motion_s(100.0, 50.0) - 2.05).abs() < 1e-12);
        // Too short to reach the speed: d = a (t/2)^2.
        assert!((motion_s(1.0, 100.0) - 2.0 * 0.001f64.sqrt()).abs() < 1e-12);
        assert_eq!(motion_s(0.0, 100.0), 0.0);
    }
}
