//! Injected faults of the simulated rig: effect and time of each kind, and the label in the rig's name.

use skinrig_device::Rig;
use skinrig_model::HostTime;
use skinrig_protocol::{FaultKind, FaultPhase, FaultTime, PlantedFault};
use skinrig_sim::{Fault, FaultTrigger, MarkFault, MotionPhase};

use crate::exit::Failure;

/// Words of 4 bytes that a camera loses.
const LOST_WORDS: u64 = 2_000;
/// Forward step of a camera's clock, µs.
const CLOCK_STEP_US: u32 = 300_000;
/// Speed of a slow robot, percent of the usual one.
const SLOW_PERCENT: u32 = 4;
/// Error of the reported height, µm.
const HEIGHT_OFF_UM: i32 = 500;
/// Delay by a slow recorder, ms.
const HELD_UP_MS: u32 = 800;

/// The device faults among `faults`, as the simulated rig injects them.
#[must_use]
pub fn of_devices(faults: &[PlantedFault]) -> Vec<Fault> {
    faults.iter().filter_map(of_device).collect()
}

fn of_device(fault: &PlantedFault) -> Option<Fault> {
    let when = when(fault.when)?;
    let mark = |fate| Fault::Mark { fate, when };
    Some(match fault.kind {
        FaultKind::CameraUnplugged(camera) => Fault::CameraUnplugged { camera, when },
        FaultKind::CameraStalled(camera) => Fault::CameraStalled { camera, when },
        FaultKind::CameraDrops(camera) => Fault::CameraBytesLost {
            camera,
            when,
            words: LOST_WORDS,
        },
        FaultKind::CameraStorm(camera) => Fault::HotPixelStorm { camera, when },
        FaultKind::CameraClockStep(camera) => Fault::ClockStep {
            camera,
            when,
            by_us: CLOCK_STEP_US,
        },
        FaultKind::CameraHot(camera) => Fault::CameraHot { camera, when },
        FaultKind::TriggerLost => mark(MarkFault::Lost),
        FaultKind::TriggerDoubled => mark(MarkFault::Doubled),
        FaultKind::TriggerDelayed => mark(MarkFault::Delayed),
        FaultKind::BoxSilent => Fault::TriggerBoxLost(when),
        FaultKind::BoxNoisy => Fault::TriggerBoxNoisy(when),
        FaultKind::RobotLost => Fault::IndenterLost(when),
        FaultKind::RobotStalled => Fault::IndenterStuck(when),
        FaultKind::RobotSlow => Fault::Sluggish {
            when,
            percent: SLOW_PERCENT,
        },
        FaultKind::RobotZHigh => Fault::HeightOff {
            when,
            by_um: -HEIGHT_OFF_UM,
        },
        FaultKind::RobotZLow => Fault::HeightOff {
            when,
            by_um: HEIGHT_OFF_UM,
        },
        FaultKind::RobotForceSpike => Fault::ForceSpike(when),
        FaultKind::RobotStale => Fault::PosesStale(when),
        FaultKind::RecorderSlow => Fault::HostHeldUp {
            when,
            for_ms: HELD_UP_MS,
        },
        FaultKind::DiskFull | FaultKind::Killed => return None,
    })
}

/// Converts numbers, which count from 1 on the command line and from 0 in the simulated rig.
fn when(time: FaultTime) -> Option<FaultTrigger> {
    Some(match time {
        FaultTime::Preflight => FaultTrigger::At(HostTime::ZERO),
        FaultTime::Arming => FaultTrigger::Moment(MotionPhase::Arming, 0),
        FaultTime::Time(after) => FaultTrigger::At(HostTime::ZERO + after),
        FaultTime::Nth(phase, n) => {
            let moment = match phase {
                FaultPhase::Travel => MotionPhase::Travel,
                FaultPhase::Press => MotionPhase::Approach,
                FaultPhase::Contact => return Some(FaultTrigger::Contact(n.checked_sub(1)?)),
                FaultPhase::Hold => MotionPhase::Hold,
                FaultPhase::Retract => MotionPhase::Retract,
                FaultPhase::Between => MotionPhase::Between,
                FaultPhase::Record | FaultPhase::Journal => return None,
            };
            FaultTrigger::Moment(moment, n.checked_sub(1)?)
        }
        FaultTime::Seal => return None,
    })
}

/// Adds the faults to the name of the rig, so that every view of the session shows them.
pub fn mark_name(rig: &mut Rig, faults: &[PlantedFault]) {
    if let Some(label) = label(faults) {
        rig.name = format!("{}, {label}", rig.name);
    }
}

/// `FAULTS ON PURPOSE: ...`; `None` without any.
#[must_use]
pub fn label(faults: &[PlantedFault]) -> Option<String> {
    let names: Vec<String> = faults.iter().map(ToString::to_string).collect();
    (!names.is_empty()).then(|| format!("FAULTS ON PURPOSE: {}", names.join(", ")))
}

/// Rejects injected faults on a bench.
///
/// # Errors
/// [`Failure::input`] if `faults` is not empty.
pub fn refuse(faults: &[PlantedFault], bench: &str) -> Result<(), Failure> {
    match label(faults) {
        None => Ok(()),
        Some(label) => Err(Failure::input(format!(
            "{bench}: expected a protocol and a command line without faults, because only the simulated rig injects \
            them, found {label}\n  next: leave out `faults:` and --fault, or leave out --rig"
        ))),
    }
}
