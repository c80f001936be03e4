//! Owns the phases of a press in the time of a camera: idle time, press, hold, release, and the time after it.

use skinrig_model::{HostTime, PressRole};

use crate::input::SessionInput;
use crate::result::ClockFit;
use crate::segment::Window;

/// Events of a motion arrive this long after its end, µs: delays of pixels and sensor.
const SETTLE_US: u64 = 20_000;
/// The time after the release lasts at most this long, µs.
const AFTER_US: u64 = 2_500_000;

/// Idle time.
pub(crate) const IDLE: usize = 0;
/// From the start of the press window until the tip is at its depth.
pub(crate) const PRESS: usize = 1;
/// From retracting (after the hold, 2) until the tip has left the surface.
pub(crate) const RELEASE: usize = 3;
/// The time after the release.
pub(crate) const AFTER: usize = 4;
/// Number of phases.
pub(crate) const PHASES: usize = 5;

/// Phases of one press, in order and without gaps, µs of camera time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PhasePlan {
    /// Row of the press in the plan.
    pub row: usize,
    /// Start of each phase, and the end of the last.
    pub ends_us: [u64; PHASES + 1],
}

impl PhasePlan {
    /// Length of a phase, s.
    pub(crate) const fn seconds(&self, phase: usize) -> f64 {
        (self.ends_us[phase + 1] - self.ends_us[phase]) as f64 * 1e-6
    }
}

/// True if the calibration presses have more than one depth: only then does an analysis estimate depths.
pub(crate) fn depths_vary(input: &SessionInput) -> bool {
    let mut depths = input
        .planned
        .iter()
        .zip(&input.outcomes)
        .filter(|(p, _)| p.role == PressRole::Calibrate)
        .filter(|(_, o)| {
            o.as_ref()
                .is_some_and(|o| !o.scheduled && o.timing.is_some())
        })
        .map(|(p, _)| p.depth_mm);
    let first = depths.next();
    depths.any(|d| Some(d) != first)
}

/// Phases of all presses of the path with measured times, sorted by start; empty unless [`depths_vary`].
///
/// The time after the release has the same length in every press, up to the next contact of the closest pair: a length that
/// followed the robot would reveal the depth. The same holds for margins.
pub(crate) fn phase_plans(
    input: &SessionInput,
    windows: &[Window],
    clock: &ClockFit,
) -> Vec<PhasePlan> {
    if !depths_vary(input) {
        return Vec::new();
    }
    let tick = |t: HostTime| clock.camera_us_of_host(t).max(0.0) as u64;
    let mut plans: Vec<PhasePlan> = windows
        .iter()
        .filter(|w| input.planned[w.row].role != PressRole::Sync)
        .filter_map(|w| {
            let outcome = input.outcomes[w.row].as_ref().filter(|o| !o.scheduled)?;
            let timing = outcome.timing?;
            let begin = w.start_us;
            let retract = tick(timing.retract).max(begin);
            let at_depth = (tick(timing.at_depth) + SETTLE_US).clamp(begin, retract);
            let released = (tick(timing.release) + SETTLE_US).max(retract);
            Some(PhasePlan {
                row: w.row,
                ends_us: [
                    w.idle_start_us,
                    begin,
                    at_depth,
                    retract,
                    released,
                    released,
                ],
            })
        })
        .collect();
    plans.sort_by_key(|p| (p.ends_us[0], p.row));
    let mut begins: Vec<u64> = windows.iter().map(|w| w.start_us).collect();
    begins.extend(input.earlier.iter().map(|e| tick(e.begun)));
    begins.sort_unstable();
    let free = |p: &PhasePlan| {
        let next = begins.partition_point(|b| *b <= p.ends_us[PRESS]);
        let until = begins.get(next).copied().unwrap_or(u64::MAX);
        until.saturating_sub(p.ends_us[AFTER])
    };
    let after = plans.iter().map(free).min().unwrap_or(0).min(AFTER_US);
    for plan in &mut plans {
        plan.ends_us[PHASES] += after;
    }
    plans
}
