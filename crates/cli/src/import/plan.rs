//! A schedule as a plan: the same presses at the same times, executed by the same controller.

use skinrig_model::{HostDuration, HostTime, PlannedPress, Point3, Robot};
use skinrig_protocol::{
    Plan, PressStep, Retakes, RunLimits, Schedule, Step, Surface, Suspend, TripReaction,
};

/// Height of the scheduled tip before the first press, mm. Nothing moves.
const START_MM: f64 = 5.0;
/// Speed between presses, mm/s: fast enough for any schedule, nothing moves.
const TRAVEL_MM_S: f64 = 1_000.0;
/// How long the scheduled tip must rest to count as settled.
const SETTLE: HostDuration = HostDuration::from_millis(10);

/// Where the scheduled tip waits before the first press.
pub(super) const fn start() -> Point3<Robot> {
    Point3::new(0.0, 0.0, START_MM)
}

/// The plan of `presses` at `times`.
pub(super) fn compile(schedule: &Schedule, presses: Vec<PlannedPress>, times: &[HostTime]) -> Plan {
    let phases = schedule.phases;
    let span = |from: HostDuration, to: HostDuration| (to.0 - from.0) as f64 * 1e-9;
    let deepest_mm = presses.iter().map(|p| p.depth_mm).fold(0.0, f64::max);
    // One retraction at one speed passes the surface at `release` and ends at `clear`: that gives the height.
    let clearance_mm =
        deepest_mm * span(phases.release, phases.clear) / span(phases.retract, phases.release);
    let mut steps = vec![Step::Begin { repetition: None }];
    for (press, time) in presses.iter().zip(times) {
        steps.push(Step::Travel {
            to: press.at.at_height(clearance_mm),
            speed_mm_s: TRAVEL_MM_S,
            deadline: HostDuration::from_millis(10_000),
        });
        let begin = *time + phases.approach;
        steps.push(Step::Press(PressStep {
            press: press.id,
            at: press.at,
            depth_mm: press.depth_mm,
            surface: Surface::Known,
            start_after_begin: Some(HostDuration(begin.0)),
            approach_speed_mm_s: clearance_mm / span(phases.approach, phases.contact),
            indent_speed_mm_s: press.depth_mm / span(phases.contact, phases.at_depth),
            react: None,
            hold: HostDuration((phases.retract.0 - phases.at_depth.0 - SETTLE.0).max(0)),
            retract_speed_mm_s: press.depth_mm / span(phases.retract, phases.release),
            marks: Vec::new(),
            deadline: HostDuration::from_millis(10_000),
        }));
    }
    let far = 1e5;
    Plan {
        version: 1,
        name: schedule.name.clone(),
        seed: 0,
        limits: RunLimits {
            workspace_min_mm: [-far; 3],
            workspace_max_mm: [far; 3],
            clearance_mm,
            max_depth_mm: deepest_mm,
            max_speed_mm_s: 1e6,
            max_force_n: 1e6,
            position_tolerance_mm: 0.05,
            settle_time: SETTLE,
            max_acceleration_mm_s2: None,
            on_trip: TripReaction::Retract,
        },
        surroundings: None,
        retakes: Retakes::NONE,
        max_consecutive_invalid: 0,
        surface_check: None,
        suspend: Suspend::default(),
        stop: None,
        online: None,
        presses,
        steps,
    }
}
