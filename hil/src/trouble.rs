//! What an error of a device means as evidence, and what devices are called in results.

use skinrig_device::DeviceError;
use skinrig_model::{CameraId, DeviceRole};
use skinrig_nightly::{Evidence, EvidenceKind};

use crate::bench::Trouble;

/// What this computer is called in results.
pub(crate) const COMPUTER: &str = "computer";
/// What the skin is called in results.
pub const SKIN: &str = "skin";

/// What the device in this role is called in results.
#[must_use]
pub const fn subject(role: DeviceRole) -> &'static str {
    match role {
        DeviceRole::Indenter => "robot",
        DeviceRole::Camera1 => "camera1",
        DeviceRole::Camera2 => "camera2",
        DeviceRole::TriggerBox => "trigger box",
    }
}

/// What this camera is called in results.
#[must_use]
pub const fn of_camera(camera: CameraId) -> &'static str {
    subject(DeviceRole::of_camera(camera))
}

/// The evidence that `error` is, with what to do next.
#[must_use]
pub fn of(error: &DeviceError) -> Trouble {
    let (kind, role) = match error {
        DeviceError::Lost { role, .. } | DeviceError::Silent { role, .. } => {
            (EvidenceKind::DeviceLost, *role)
        }
        DeviceError::ReadBack { role, .. } => (EvidenceKind::ReadBack, *role),
        DeviceError::Refused { role, .. } => (EvidenceKind::Refused, *role),
        DeviceError::State { role, .. } => (EvidenceKind::State, *role),
        // No bench replays: whoever asked took the wrong devices.
        // Neither does any leave a call under way.
        DeviceError::Diverged { role, .. } | DeviceError::Pending { role, .. } => {
            (EvidenceKind::Software, *role)
        }
    };
    Box::new(Evidence::new(kind, subject(role), error.to_string()).next(next(kind, role)))
}

/// A device that should have shown something within a time, and did not.
#[must_use]
pub fn silent(role: DeviceRole, what: impl Into<String>) -> Trouble {
    let kind = EvidenceKind::DeviceLost;
    Box::new(Evidence::new(kind, subject(role), what).next(next(kind, role)))
}

/// What to do about a device in this trouble.
const fn next(kind: EvidenceKind, role: DeviceRole) -> &'static str {
    match (kind, role) {
        (EvidenceKind::DeviceLost, DeviceRole::Indenter) => {
            "look at the robot's power, its light and its cable, then `skinrig doctor`"
        }
        (EvidenceKind::DeviceLost, DeviceRole::TriggerBox) => {
            "look at the box's light and its cable, reset the box, then `skinrig doctor`"
        }
        (EvidenceKind::DeviceLost, _) => {
            "look at the camera's cable and its port (USB 3, no hub), then `skinrig doctor`"
        }
        (EvidenceKind::ReadBack, _) => "power-cycle the device and make the check again",
        (EvidenceKind::State, DeviceRole::Indenter) => {
            "look at the robot's light and its force button; initialise it again when it says so"
        }
        (EvidenceKind::State, _) => {
            "make sure that nothing else uses the device, and power-cycle it"
        }
        (EvidenceKind::Refused, _) => {
            "compare the rig file with what the device can do (`skinrig devices`)"
        }
        _ => "this is a fault of the program: please report it with the night's folder",
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
                    doing: "poll",
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
            let trouble = of(&error);
            assert_eq!((trouble.kind, trouble.subject.as_str()), (kind, "camera2"));
            assert_eq!(trouble.what, error.to_string());
            assert!(trouble.next.is_some(), "{kind:?}");
        }
        assert_eq!(subject(DeviceRole::TriggerBox), "trigger box");
        assert_eq!(of_camera(CameraId::One), "camera1");
    }
}
