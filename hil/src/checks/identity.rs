//! Checks: who each device is.

use skinrig_controller::{ExpectedDevice, identity_checks};

use skinrig_model::{CameraId, DeviceIdentity, DeviceRole};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::Check;

use crate::bench::{Bench, Trouble};
use crate::findings::Findings;
use crate::trouble;

const METRICS: &[&str] = &["differences"];

/// Makes the check.
pub fn identity(_check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let expected = ExpectedDevice::of_rig(bench.rig());
    let devices = bench.devices();
    let mut one = |role: DeviceRole, answer: Result<DeviceIdentity, Trouble>| {
        let subject = trouble::subject(role);
        match answer {
            Ok(identity) => {
                let wanted = expected.iter().find(|e| e.role == role);
                compare(role, wanted, &identity, found);
            }
            Err(trouble) => found.trouble(*trouble, subject, METRICS),
        }
    };
    let robot = devices.robot.as_ref().map(|d| d.identity());
    one(DeviceRole::Indenter, robot.map_err(Clone::clone));
    for camera in CameraId::ALL {
        let answer = devices.cameras[camera.index()]
            .as_ref()
            .map(|d| d.identity());
        one(DeviceRole::of_camera(camera), answer.map_err(Clone::clone));
    }
    if let Some(slot) = &devices.trigger_box {
        let answer = slot.as_ref().map(|d| d.identity());
        one(DeviceRole::TriggerBox, answer.map_err(Clone::clone));
    }
}

/// Counts what differs from what is wanted; who it is stays on record.
fn compare(
    role: DeviceRole,
    wanted: Option<&ExpectedDevice>,
    identity: &DeviceIdentity,
    found: &mut Findings,
) {
    let subject = trouble::subject(role);
    let checks = identity_checks(role, wanted, identity);
    let differences = checks.iter().filter(|c| c.failed());
    for check in differences.clone() {
        let what = format!(
            "{}: expected {}, found {}",
            check.check, check.expected, check.found
        );
        let evidence = Evidence::new(EvidenceKind::OtherDevice, subject, what);
        found.evidence.push(evidence.next(check.next_step.as_str()));
    }
    let count = differences.count();
    let DeviceIdentity {
        model,
        serial,
        firmware,
    } = identity;
    found
        .value(subject, "differences", count as f64)
        .noting(format!("{model}, serial {serial}, {firmware}"));
}
