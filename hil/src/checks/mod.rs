//! The checks of a suite. They use devices only through their traits.

mod clocks;
mod contact;
mod disk;
mod drills;
mod golden;
mod identity;
mod noise;
mod pixels;
mod reaction;
mod robot;
mod settings;
mod stream;
mod trigger;

use skinrig_nightly::Cause;
use skinrig_protocol::suite::{Check, Measure};

use crate::bench::Bench;
use crate::findings::Findings;

pub use self::disk::disk_write_rate;

/// Runs one attempt at `check`. Devices may stay open; the robot is braked and the cameras are stopped afterwards.
pub fn run(check: &Check, bench: &mut dyn Bench) -> Findings {
    let mut findings = Findings::default();
    let run: fn(&Check, &mut dyn Bench, &mut Findings) = match &check.measure {
        Measure::Identity => identity::identity,
        Measure::Settings => settings::settings,
        Measure::Disk { .. } => disk::disk,
        Measure::TriggerLoopback { .. } => trigger::trigger_loopback,
        Measure::Clocks { .. } => clocks::clocks,
        Measure::Idle { .. } => stream::idle,
        Measure::TestPattern { .. } => stream::test_pattern,
        Measure::Noise { .. } => noise::noise,
        Measure::RobotState => robot::robot_state,
        Measure::Repeatability { .. } => robot::repeatability,
        Measure::StepResponse { .. } => robot::step_response,
        Measure::Depth { .. } => contact::depth,
        Measure::ForceCeiling { .. } => contact::force_ceiling,
        Measure::Golden { .. } => golden::golden,
        Measure::Reaction { .. } => reaction::reaction,
        Measure::WatchdogDrill => drills::watchdog,
        Measure::StopDrill => drills::stop,
    };
    run(check, bench, &mut findings);
    findings
}

/// Cause of a broken limit without other evidence.
#[must_use]
pub const fn default_cause(measure: &Measure) -> Cause {
    match measure {
        Measure::Golden { .. } => Cause::Skin,
        Measure::Disk { .. } => Cause::Infrastructure,
        _ => Cause::Rig,
    }
}
