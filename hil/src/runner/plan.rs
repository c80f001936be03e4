//! The runner: estimates the duration of each check and lists the checks that must be good before
//! others may run.

use skinrig_model::HostDuration;
use skinrig_nightly::judge::RepeatRule;
use skinrig_protocol::suite::{Check, Measure, Suite};

/// Opening a device, writing its settings and closing it, s.
const DEVICES_S: f64 = 4.0;
/// One coded train and the pause after it, s.
const TRAIN_S: f64 = 0.1;
/// Settling after one move in free air, without the travel, s.
const MOVE_S: f64 = 1.0;
/// Distance to one of the five points in free air and back, mm.
const TRAVEL_MM: f64 = 60.0;
/// One slow press: touch search, hold and rise, s.
const PRESS_S: f64 = 8.0;
/// Touch-off points assumed when the rig file has none.
const POINTS: usize = 3;
/// A drill with a helper process, s.
const DRILL_S: f64 = 20.0;
/// Write rate of the slowest acceptable disk, bytes/s.
const DISK_B_S: f64 = 60e6;
/// Safety factor on the planned duration of a campaign.
const CAMPAIGN_SAFETY_FACTOR: f64 = 1.25;
/// Preflight, analysis and report of a campaign, s.
const CAMPAIGN_OVERHEAD_S: f64 = 30.0;

/// Inputs of the time estimates that are not part of the suite.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PlanInputs {
    /// Planned duration of the golden protocol.
    pub golden: Option<HostDuration>,
    /// Planned duration of the protocol of `reaction`.
    pub reaction: Option<HostDuration>,
    /// Number of touch-off points.
    pub touch_points: Option<usize>,
}

/// Estimated duration of one attempt, deliberately generous: a check starts only if this much budget is left.
#[must_use]
pub(crate) fn estimated_duration(check: &Check, inputs: &PlanInputs) -> HostDuration {
    if check.skip.is_some() {
        return HostDuration::ZERO;
    }
    let measuring_s = match &check.measure {
        Measure::Identity | Measure::Settings => 0.0,
        // Write, sync and read back.
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
        } => 5.0 * f64::from(*approaches) * (TRAVEL_MM / speed_mm_s + 2.0 * MOVE_S),
        // A move out, one second of rest, and a move back.
        Measure::StepResponse { steps, .. } => f64::from(*steps) * (1.0 + 2.0 * MOVE_S),
        Measure::Depth { presses, .. } => {
            let points = inputs.touch_points.unwrap_or(POINTS);
            points as f64 * f64::from(*presses) * PRESS_S
        }
        Measure::ForceCeiling { .. } => PRESS_S,
        Measure::Golden { .. } => campaign_s(inputs.golden),
        Measure::Reaction { .. } => campaign_s(inputs.reaction),
        Measure::WatchdogDrill => DRILL_S,
        Measure::StopDrill => 2.0 * MOVE_S,
    };
    HostDuration::from_secs_f64(measuring_s + DEVICES_S)
}

/// Estimated duration of a campaign, s.
fn campaign_s(plan: Option<HostDuration>) -> f64 {
    plan.map_or(0.0, HostDuration::as_secs_f64) * CAMPAIGN_SAFETY_FACTOR + CAMPAIGN_OVERHEAD_S
}

/// How often a failed check of this suite is repeated. Two kinds are never repeated. A
/// campaign has its own retakes, and repeating presses until they pass would bias the result. After
/// a failed force ceiling check or drill, the arm may not have stopped, so it must not move again
/// unattended.
#[must_use]
pub(crate) const fn repeat_rule(suite: &Suite, measure: &Measure) -> RepeatRule {
    match measure {
        Measure::Golden { .. }
        | Measure::Reaction { .. }
        | Measure::ForceCeiling { .. }
        | Measure::WatchdogDrill
        | Measure::StopDrill => RepeatRule::NEVER,
        _ => RepeatRule {
            at_most: suite.repeats.at_most,
            must_pass: suite.repeats.must_pass,
        },
    }
}

/// Checks that must be good before this one may move the arm, if they are part of the night: an arm
/// that ignores commands must not travel, and an arm without a force limit must not press.
#[must_use]
pub(crate) const fn prerequisites(measure: &Measure) -> &'static [&'static str] {
    match measure {
        Measure::Repeatability { .. }
        | Measure::StepResponse { .. }
        | Measure::Depth { .. }
        | Measure::ForceCeiling { .. }
        | Measure::WatchdogDrill
        | Measure::StopDrill => &["robot_state"],
        Measure::Golden { .. } | Measure::Reaction { .. } => &["robot_state", "force_ceiling"],
        _ => &[],
    }
}
