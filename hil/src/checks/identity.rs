//! Check `identity`: model, serial number and firmware of each device.

use skinrig_controller::{ExpectedDevice, identity_checks};

use skinrig_model::{CameraId, DeviceIdentity, DeviceRole};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::Check;

use crate::bench::{Bench, Problem};
use crate::device_evidence;
use crate::findings::Findings;

const METRICS: &[&str] = &["differences"];

/// Runs the check.
pub(super) fn identity(_check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let expected = ExpectedDevice::of_rig(bench.rig());
    let devices = bench.devices();
    let mut check = |role: DeviceRole, identity: Result<DeviceIdentity, Problem>| {
        let subject = device_evidence::subject(role);
        match identity {
            Ok(identity) => {
                let expected_device = expected.iter().find(|e| e.role == role);
                compare(role, expected_device, &identity, findings);
            }
            Err(problem) => findings.failed(*problem, subject, METRICS),
        }
    };
    let robot = devices.robot.as_ref().map(|d| d.identity());
    check(DeviceRole::Indenter, robot.map_err(Clone::clone));
    for camera in CameraId::ALL {
        let identity = devices.cameras[camera.index()]
            .as_ref()
            .map(|d| d.identity());
        check(
            DeviceRole::of_camera(camera),
            identity.map_err(Clone::clone),
        );
    }
    if let Some(slot) = &devices.trigger_box {
        let identity = slot.as_ref().map(|d| d.identity());
        check(DeviceRole::TriggerBox, identity.map_err(Clone::clone));
    }
}

/// Counts the differences from the rig file and records the device's identity.
fn compare(
    role: DeviceRole,
    expected_device: Option<&ExpectedDevice>,
    identity: &DeviceIdentity,
    findings: &mut Findings,
) {
    let subject = device_evidence::subject(role);
    let checks = identity_checks(role, expected_device, identity);
    let differences = checks.iter().filter(|c| c.failed());
    for check in differences.clone() {
        let what = format!(
            "{}: expected {}, found {}",
            check.check, check.expected, check.found
        );
        let evidence = Evidence::new(EvidenceKind::OtherDevice, subject, what);
        findings
            .evidence
            .push(evidence.next(check.next_step.as_str()));
    }
    let count = differences.count();
    let DeviceIdentity {
        model,
        serial,
        firmware,
    } = identity;
    findings
        .value(subject, "differences", count as f64)
        .with_note(format!("{model}, serial {serial}, {firmware}"));
}
