//! The preflight's settings, and its checks of a device's identity and settings.

use skinrig_model::{
    CameraId, CheckKind, DeviceIdentity, DeviceRole, HostDuration, PreflightCheck, Setting,
};
use skinrig_protocol::rig::RigFile;

/// Checks to make before the robot is powered.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Preflight {
    /// Results of checks that the caller has already made: disk, frame, recorder.
    pub caller_checks: Vec<PreflightCheck>,
    /// Expected device per role.
    pub expected: Vec<ExpectedDevice>,
    /// Time within which both cameras' clocks must advance; `None` skips the check.
    pub clocks_within: Option<HostDuration>,
    /// Loop-back of a mark through both cameras; `None` skips the check.
    pub loopback: Option<Loopback>,
}

/// Expected device in a role.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExpectedDevice {
    /// Role in the rig.
    pub role: DeviceRole,
    /// Its serial number; `None` for any.
    pub serial: Option<String>,
    /// Versions that its firmware text must contain.
    pub versions: Vec<String>,
    /// Required values of read-only settings by name, for example a library version.
    pub settings: Vec<(String, String)>,
}

/// Loop-back of a mark from the trigger box through the cameras.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loopback {
    /// Trigger channels of camera 1 and camera 2.
    pub channels: [u8; 2],
    /// Longest time from sending until the bytes of both cameras reach the host.
    pub within: HostDuration,
}

impl ExpectedDevice {
    /// Expected devices of a rig file: the robot, both cameras, and the trigger box if it has one.
    #[must_use]
    pub fn of_rig(file: &RigFile) -> Vec<Self> {
        let robot = &file.robot;
        let mut expected = vec![Self {
            role: DeviceRole::Indenter,
            serial: Some(robot.serial.to_string()),
            versions: [&robot.firmware, &robot.library_version]
                .into_iter()
                .flatten()
                .cloned()
                .collect(),
            settings: robot
                .velocity_threshold
                .map(|t| ("velocity_threshold".to_owned(), t.to_string()))
                .into_iter()
                .collect(),
        }];
        for (id, camera) in CameraId::ALL.into_iter().zip(&file.cameras) {
            expected.push(Self {
                role: DeviceRole::of_camera(id),
                serial: Some(camera.serial.clone()),
                versions: camera.fpga.iter().map(|v| format!("FPGA {v}")).collect(),
                settings: Vec::new(),
            });
        }
        if let Some(device) = &file.trigger_box {
            expected.push(Self {
                role: DeviceRole::TriggerBox,
                serial: device.serial.clone(),
                versions: device.firmware.iter().cloned().collect(),
                settings: Vec::new(),
            });
        }
        expected
    }
}

/// Checks the identity of a device against the expected one of its role, if any.
#[must_use]
pub fn identity_checks(
    role: DeviceRole,
    required: Option<&ExpectedDevice>,
    identity: &DeviceIdentity,
) -> Vec<PreflightCheck> {
    let serial = required.and_then(|w| w.serial.as_deref());
    let mut checks = vec![
        PreflightCheck::new(
            format!("{role}: identity"),
            serial.map_or_else(|| "any serial number".to_owned(), |s| format!("serial {s}")),
            format!("{} {}", identity.model, identity.serial),
            serial.is_none_or(|s| s == identity.serial),
            "connect the right device, or correct its serial number in the rig file",
        )
        .about(CheckKind::Identity(role)),
    ];
    for version in required.iter().flat_map(|w| &w.versions) {
        checks.push(
            PreflightCheck::new(
                format!("{role}: version"),
                version.as_str(),
                identity.firmware.as_str(),
                contains_version(&identity.firmware, version),
                "install the expected version, or accept this one in the rig file after testing it",
            )
            .about(CheckKind::Identity(role)),
        );
    }
    checks
}

/// Settings whose read-back differs from the written value; read-only values are ignored.
pub fn differing(settings: &[Setting]) -> impl Iterator<Item = &Setting> {
    let written = settings.iter().filter(|s| s.was_requested());
    written.filter(|s| !is_same(&s.requested, &s.read_back))
}

/// All checks of a configured device: its identity, required values and settings read back, and the robot's state.
pub(crate) fn device_checks(
    role: DeviceRole,
    required: Option<&ExpectedDevice>,
    identity: &DeviceIdentity,
    settings: &[Setting],
) -> Vec<PreflightCheck> {
    let mut checks = identity_checks(role, required, identity);
    for (name, value) in required.iter().flat_map(|w| &w.settings) {
        let found = settings.iter().find(|s| s.name == *name);
        checks.push(
            PreflightCheck::new(
                format!("{role}: {name}"),
                value.as_str(),
                found.map_or("not reported", |s| s.read_back.as_str()),
                found.is_some_and(|s| is_same(value, &s.read_back)),
                "find out what changed, or accept the value in the rig file after testing it",
            )
            .about(CheckKind::ReadBack(role)),
        );
    }
    if role != DeviceRole::TriggerBox {
        checks.push(read_back(role, settings));
    }
    if role == DeviceRole::Indenter {
        checks.push(initialised(settings));
    }
    checks
}

/// Checks that the robot is initialised, if it reports that.
fn initialised(settings: &[Setting]) -> PreflightCheck {
    match settings.iter().find(|s| s.name == "initialised") {
        Some(s) => PreflightCheck::new(
            "indenter: initialised",
            "true",
            s.read_back.as_str(),
            s.read_back == "true",
            "initialise the robot by hand (calibration pole into the pit), or see docs/how-to/bench.md",
        )
        .about(CheckKind::State(DeviceRole::Indenter)),
        None => PreflightCheck::skipped(
            "indenter: initialised",
            "true",
            "not reported by this robot",
        ),
    }
}

/// Checks that everything written reads back unchanged; read-only values are ignored.
fn read_back(role: DeviceRole, settings: &[Setting]) -> PreflightCheck {
    let written = settings.iter().filter(|s| s.was_requested());
    let differing: Vec<String> = differing(settings)
        .map(|s| format!("{} {} instead of {}", s.name, s.read_back, s.requested))
        .collect();
    PreflightCheck::new(
        format!("{role}: settings read back"),
        format!("{} as written", written.count()),
        if differing.is_empty() {
            "all".to_owned()
        } else {
            differing.join(", ")
        },
        differing.is_empty(),
        "power-cycle the device and try again",
    )
    .about(CheckKind::ReadBack(role))
}

/// Equal as texts, or as numbers in single precision.
fn is_same(required: &str, found: &str) -> bool {
    if required == found {
        return true;
    }
    match (required.parse::<f64>(), found.parse::<f64>()) {
        (Ok(a), Ok(b)) => (a - b).abs() <= 1e-4 * a.abs().max(1e-3),
        _ => false,
    }
}

/// Whether the firmware text `found` contains the version `required` as a whole: `3.0` is in
/// `FPGA 3.0, system 1c`, but not in `13.0` or `3.01`.
#[must_use]
pub fn contains_version(found: &str, required: &str) -> bool {
    let part = |c: char| c.is_ascii_alphanumeric() || c == '.';
    found.match_indices(required).any(|(at, _)| {
        let before = found[..at].chars().next_back();
        let after = found[at + required.len()..].chars().next();
        !before.is_some_and(part) && !after.is_some_and(part)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_and_values_are_compared_as_a_whole() {
        assert!(contains_version("FPGA 3.0, system 1c", "3.0"));
        assert!(contains_version("3.0", "3.0"));
        for found in ["13.0", "3.01", "3.0.1", "v3", ""] {
            assert!(!contains_version(found, "3.0"), "{found}");
        }
        assert!(is_same("0.14", "0.14000000059604645") && is_same("evt2", "evt2"));
        assert!(!is_same("0.14", "0.15") && !is_same("on", "off") && !is_same("", "0"));
    }

    #[test]
    fn read_only_values_are_not_settings() {
        let setting = |requested: &str, read_back: &str| Setting {
            name: "x".into(),
            requested: requested.into(),
            read_back: read_back.into(),
        };
        let found = setting(Setting::AS_FOUND, "7");
        let check = read_back(DeviceRole::Indenter, &[found.clone(), setting("5", "5.0")]);
        assert!(
            !check.failed() && check.expected == "1 as written",
            "{check:?}"
        );
        // A tolerated difference is no written setting; its name explains it.
        let passed = setting(Setting::TOLERATED, "expected 1, found 2");
        assert!(!read_back(DeviceRole::Camera1, &[passed]).failed());
        let check = read_back(DeviceRole::Indenter, &[found, setting("5", "6")]);
        assert!(
            check.failed() && check.found == "x 6 instead of 5",
            "{check:?}"
        );
    }
}
