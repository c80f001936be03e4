//! The runner: how long a check should take, told before the night begins, and which checks rely on which.

use skinrig_model::HostDuration;
use skinrig_nightly::judge::RepeatRule;
use skinrig_protocol::suite::{Check, Measure, Suite};

/// Opening a device, writing its settings, or letting go of it, s.
const DEVICES_S: f64 = 4.0;
/// One coded train with the rest after it, s.
const TRAIN_S: f64 = 0.1;
/// One move in free air with settling, besides its way, s.
const MOVE_S: f64 = 1.0;
/// The way to a point of the five in free air and away from it, mm.
const WAY_MM: f64 = 60.0;
/// One slow press: search for the surface, hold, rise, s.
const PRESS_S: f64 = 8.0;
/// Points of a touch-off, when the rig file names none.
const POINTS: usize = 3;
/// A drill with a second process, s.
const DRILL_S: f64 = 20.0;
/// Bytes per second of a disk that is just good enough.
const DISK_B_S: f64 = 60e6;
/// A campaign takes its plan, this share of it more, and preflight and analysis besides.
const GOLDEN_MORE: f64 = 1.25;
/// Preflight, analysis and report of a campaign, s.
const GOLDEN_BESIDES_S: f64 = 30.0;

/// What the plan of a night needs to know besides its suite.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Known {
    /// What the plan of the golden protocol takes.
    pub golden: Option<HostDuration>,
    /// How many points the touch-off has.
    pub touch_points: Option<usize>,
}

/// How long one attempt at a check should take. An estimate on the long side: it decides what is begun.
#[must_use]
pub fn planned(check: &Check, known: &Known) -> HostDuration {
    if check.skip.is_some() {
        return HostDuration::ZERO;
    }
    let measuring_s = match &check.measure {
        Measure::Identity | Measure::Settings => 0.0,
        // Written, synchronised, and read back.
        Measure::Disk { amount_b } => 2.0 * amount_b / DISK_B_S,
        Measure::TriggerLoopback { trains } => f64::from(*trains) * TRAIN_S,
        Measure::Clocks { duration }
        | Measure::Idle { duration }
        | Measure::Noise { duration, .. }
        | Measure::TestPattern { duration, .. } => duration.as_secs_f64(),
        Measure::RobotState => 2.0,
        Measure::Repeatability {
            approaches,
            speed_mm_s,
        } => 5.0 * f64::from(*approaches) * (WAY_MM / speed_mm_s + 2.0 * MOVE_S),
        // There, a second of rest, and back.
        Measure::StepResponse { steps, .. } => f64::from(*steps) * (1.0 + 2.0 * MOVE_S),
        Measure::Depth { presses, .. } => {
            let points = known.touch_points.unwrap_or(POINTS);
            points as f64 * f64::from(*presses) * PRESS_S
        }
        Measure::ForceCeiling { .. } => PRESS_S,
        Measure::Golden { .. } => {
            let plan_s = known.golden.map_or(0.0, HostDuration::as_secs_f64);
            plan_s * GOLDEN_MORE + GOLDEN_BESIDES_S
        }
        Measure::WatchdogDrill => DRILL_S,
        Measure::StopDrill => 2.0 * MOVE_S,
    };
    HostDuration::from_secs_f64(measuring_s + DEVICES_S)
}

/// When a check of this suite is made again. Never: the golden skin, whose presses must not be repeated until they please and
/// which holds its own repeats; what tests a guard (ceiling of the force, drills), for an arm that did not stop is not sent again
/// with nobody there.
#[must_use]
pub const fn repeats(suite: &Suite, measure: &Measure) -> RepeatRule {
    match measure {
        Measure::Golden { .. }
        | Measure::ForceCeiling { .. }
        | Measure::WatchdogDrill
        | Measure::StopDrill => RepeatRule::NEVER,
        _ => RepeatRule {
            at_most: suite.repeats.at_most,
            must_pass: suite.repeats.must_pass,
        },
    }
}

/// Checks that must be good, when they are part of the night, before this one may move the arm: one that does not take its
/// orders does not move in free air, and one that does not bound its force does not press.
#[must_use]
pub(crate) const fn relies_on(measure: &Measure) -> &'static [&'static str] {
    match measure {
        Measure::Repeatability { .. }
        | Measure::StepResponse { .. }
        | Measure::Depth { .. }
        | Measure::ForceCeiling { .. }
        | Measure::WatchdogDrill
        | Measure::StopDrill => &["robot_state"],
        Measure::Golden { .. } => &["robot_state", "force_ceiling"],
        _ => &[],
    }
}
