//! Evidence from device errors, and the names of devices in results.

use skinrig_device::DeviceError;
use skinrig_model::{CameraId, DeviceRole};
use skinrig_nightly::{Evidence, EvidenceKind};

use crate::bench::Problem;

/// Subject of evidence about this computer.
pub(crate) const COMPUTER: &str = "computer";
/// Subject of evidence about the skin.
pub const SKIN: &str = "skin";

/// Name of a device in results.
#[must_use]
pub const fn subject(role: DeviceRole) -> &'static str {
    match role {
        DeviceRole::Indenter => "robot",
        DeviceRole::Camera1 => "camera1",
        DeviceRole::Camera2 => "camera2",
        DeviceRole::TriggerBox => "trigger box",
    }
}

/// Name of a camera in results.
#[must_use]
pub(crate) const fn camera_subject(camera: CameraId) -> &'static str {
    subject(DeviceRole::of_camera(camera))
}

/// Evidence from a device error, with the next step.
#[must_use]
pub fn from_error(error: &DeviceError) -> Problem {
    let (kind, role) = match error {
        DeviceError::Lost { role, .. } | DeviceError::Silent { role, .. } => {
            (EvidenceKind::DeviceLost, *role)
        }
        DeviceError::ReadBack { role, .. } => (EvidenceKind::ReadBack, *role),
        DeviceError::Refused { role, .. } => (EvidenceKind::Refused, *role),
        DeviceError::State { role, .. } => (EvidenceKind::State, *role),
        // Neither can happen on a real bench: both are bugs in skinrig.
        DeviceError::Diverged { role, .. } | DeviceError::Pending { role, .. } => {
            (EvidenceKind::Software, *role)
        }
    };
    Box::new(Evidence::new(kind, subject(role), error.to_string()).next(next_step(kind, role)))
}

/// Evidence that a device did not respond in time.
#[must_use]
pub fn silent(role: DeviceRole, what: impl Into<String>) -> Problem {
    let kind = EvidenceKind::DeviceLost;
    Box::new(Evidence::new(kind, subject(role), what).next(next_step(kind, role)))
}

/// Next step for evidence of this kind about this device.
const fn next_step(kind: EvidenceKind, role: DeviceRole) -> &'static str {
    match (kind, role) {
        (EvidenceKind::DeviceLost, DeviceRole::Indenter) => {
            "check the robot's power, its light and its cable, then run `skinrig doctor`"
        }
        (EvidenceKind::DeviceLost, DeviceRole::TriggerBox) => {
            "check the box's light and its cable, reset the box, then run `skinrig doctor`"
        }
        (EvidenceKind::DeviceLost, _) => {
            "check the camera's cable and port (USB 3, no hub), then run `skinrig doctor`"
        }
        (EvidenceKind::ReadBack, _) => "power-cycle the device and run the check again",
        (EvidenceKind::State, DeviceRole::Indenter) => {
            "check the robot's light and its force button; initialise it again if it asks for that"
        }
        (EvidenceKind::State, _) => {
            "make sure that no other program uses the device, then power-cycle it"
        }
        (EvidenceKind::Refused, _) => {
            "compare the rig file with the device's capabilities (`skinrig devices`)"
        }
        _ => "this is a bug in skinrig: please report it with the night's folder",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_error_is_evidence_about_its_own_device_with_a_next_step() {
        let text = String::new;
        let role = DeviceRole::Camera2;
        let serial = || "00000002".to_owned();
        let errors = [
            (
                EvidenceKind::DeviceLost,
                DeviceError::Lost {
                    role,
                    serial: serial(),
                    detail: text(),
                },
            ),
            (
                EvidenceKind::DeviceLost,
                DeviceError::Silent {
                    role,
                    serial: serial(),
                    doing: "poll".into(),
                    within: skinrig_model::HostDuration::ZERO,
                },
            ),
            (
                EvidenceKind::ReadBack,
                DeviceError::ReadBack {
                    role,
                    serial: serial(),
                    name: text(),
                    expected: text(),
                    found: text(),
                },
            ),
            (
                EvidenceKind::Refused,
                DeviceError::Refused {
                    role,
                    serial: serial(),
                    expected: text(),
                    found: text(),
                },
            ),
            (
                EvidenceKind::State,
                DeviceError::State {
                    role,
                    serial: serial(),
                    expected: text(),
                    found: text(),
                },
            ),
            (
                EvidenceKind::Software,
                DeviceError::Diverged {
                    role,
                    at: text(),
                    expected: text(),
                    found: text(),
                },
            ),
        ];
        for (kind, error) in errors {
            let problem = from_error(&error);
            assert_eq!((problem.kind, problem.subject.as_str()), (kind, "camera2"));
            assert_eq!(problem.what, error.to_string());
            assert!(problem.next.is_some(), "{kind:?}");
        }
        assert_eq!(subject(DeviceRole::TriggerBox), "trigger box");
        assert_eq!(camera_subject(CameraId::One), "camera1");
    }
}
