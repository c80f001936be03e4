//! Injected faults of the simulated rig: their times, and the label in the rig's name.

use skinrig_device::Rig;
use skinrig_model::{HostTime, UnsupportedFault};
use skinrig_protocol::{FaultPhase, FaultTime, PlantedFault};
use skinrig_sim::{Fault, FaultTrigger, MotionPhase};

use crate::exit::Failure;

/// The device faults among `faults`, as the simulated rig injects them.
///
/// # Errors
/// [`UnsupportedFault`] for a fault that the simulated rig does not support.
pub fn of_devices(faults: &[PlantedFault]) -> Result<Vec<Fault>, UnsupportedFault> {
    let of_devices = faults.iter().filter(|fault| !fault.kind.is_of_records());
    of_devices
        .filter_map(|fault| Some(Fault::new(fault.kind, fault_trigger(fault.when)?)))
        .collect()
}

/// Converts numbers, which count from 1 on the command line and from 0 in the simulated rig.
fn fault_trigger(time: FaultTime) -> Option<FaultTrigger> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_of_the_simulated_rig_are_named_as_they_were_planted() {
        for text in [
            "camera1-drops@hold:5",
            "camera2-storm@contact:1",
            "robot-lost@press:12",
            "robot-slow@travel:2",
            "box-silent@retract:3",
            "trigger-lost@between:1",
            "robot-stale@arming",
            "camera1-unplugged@preflight",
            "camera2-unplugged@time:1.5 s",
        ] {
            let fault = text.parse().unwrap();
            let faults = of_devices(&[fault]).unwrap();
            let [found] = &faults[..] else {
                panic!("{text}: {faults:?}")
            };
            assert_eq!(found.to_string(), text);
        }
    }
}
