//! Evidence of devices that could not be opened. If the driver only reports a missing device,
//! enumerates bus or port again to find the reason.

use skinrig_device::DeviceError;
use skinrig_evk1::{CameraState, Evk1Error, UsbError};
use skinrig_hil::Problem;
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_omega3::OmegaError;
use skinrig_omega3::enumerate::Availability;
use skinrig_protocol::rig::{BoxSetup, RigFile};
use skinrig_trigger_box::serial::SerialConnector;
use skinrig_trigger_box::{Connector, OpenError};

const DEVICES: &str =
    "run `skinrig devices` to list connected devices; docs/how-to/bench.md shows the connections";

fn evidence(kind: EvidenceKind, subject: &str, what: &dyn std::fmt::Display) -> Problem {
    Box::new(Evidence::new(kind, subject, what.to_string()).next(DEVICES))
}

/// Evidence from an error in opening the robot.
pub(super) fn robot(error: &OmegaError, rig: &RigFile) -> Problem {
    let kind = match error {
        OmegaError::Load(_) | OmegaError::Thread(_) | OmegaError::Supervisor(_) => {
            EvidenceKind::Absent
        }
        OmegaError::NotFound { .. } => robot_not_found(rig),
        OmegaError::Config(_) => EvidenceKind::Refused,
        OmegaError::Unsuitable { .. } => EvidenceKind::State,
        OmegaError::ReadBack { .. } => EvidenceKind::ReadBack,
        OmegaError::Call { .. } | OmegaError::TimedOut { .. } => EvidenceKind::DeviceLost,
    };
    evidence(kind, "robot", error)
}

/// Enumerates the robots to find out why none that is free matches the rig file.
fn robot_not_found(rig: &RigFile) -> EvidenceKind {
    let listed = skinrig_omega3::load::load(rig.robot.library.as_deref())
        .ok()
        .and_then(|loaded| skinrig_omega3::enumerate::list(&loaded.library).ok());
    let states = listed.unwrap_or_default();
    let any = |state: Availability| states.iter().any(|f| f.availability == state);
    if any(Availability::Busy) {
        EvidenceKind::Busy
    } else if any(Availability::NotPermitted) {
        EvidenceKind::NotPermitted
    } else if states.is_empty() {
        EvidenceKind::Absent
    } else {
        EvidenceKind::OtherDevice
    }
}

/// Evidence from an error in opening a camera. `subject` is its name in results.
pub(super) fn camera(error: &Evk1Error, subject: &str, held: usize) -> Problem {
    let kind = match error {
        Evk1Error::NotFound { .. } => camera_not_found(held),
        Evk1Error::NotEvk1 { .. } => EvidenceKind::OtherDevice,
        Evk1Error::Usb { cause, .. } => match cause {
            UsbError::NoUsb(_) | UsbError::Gone => EvidenceKind::Absent,
            UsbError::Busy => EvidenceKind::Busy,
            UsbError::NoPermission => EvidenceKind::NotPermitted,
            _ => EvidenceKind::DeviceLost,
        },
        Evk1Error::ReadBack { .. } | Evk1Error::Setting { .. } => EvidenceKind::ReadBack,
        Evk1Error::Refused { .. } => EvidenceKind::Refused,
        _ => EvidenceKind::State,
    };
    evidence(kind, subject, error)
}

/// Enumerates the cameras to find out why none that is free has the serial number.
fn camera_not_found(held: usize) -> EvidenceKind {
    let states: Vec<_> = skinrig_evk1::enumerate()
        .unwrap_or_default()
        .into_iter()
        .map(|found| found.state)
        .collect();
    let any = |is: fn(&CameraState) -> bool| states.iter().any(is);
    let busy = states.iter().filter(|s| matches!(s, CameraState::Busy));
    if busy.count() > held {
        EvidenceKind::Busy
    } else if any(|s| matches!(s, CameraState::NoPermission)) {
        EvidenceKind::NotPermitted
    } else if any(|s| matches!(s, CameraState::Faulty(_))) {
        EvidenceKind::DeviceLost
    } else {
        EvidenceKind::Absent
    }
}

/// Evidence from an error in opening the trigger box.
pub(super) fn trigger_box(error: &DeviceError, setup: &BoxSetup) -> Problem {
    let kind = match error {
        DeviceError::Lost { .. } => match SerialConnector::new(&setup.port).connect() {
            Err(OpenError::Absent(_)) => EvidenceKind::Absent,
            Err(OpenError::Busy(_)) => EvidenceKind::Busy,
            Err(OpenError::NotPermitted(_)) => EvidenceKind::NotPermitted,
            Err(OpenError::Other { .. }) | Ok(_) => EvidenceKind::DeviceLost,
        },
        // A different box or firmware.
        DeviceError::Refused { .. } => EvidenceKind::OtherDevice,
        DeviceError::ReadBack { .. } => EvidenceKind::ReadBack,
        DeviceError::State { .. } => EvidenceKind::State,
        DeviceError::Silent { .. } => EvidenceKind::DeviceLost,
        DeviceError::Diverged { .. } | DeviceError::Pending { .. } => EvidenceKind::Software,
    };
    evidence(kind, "trigger box", error)
}
