//! Checks: settings of the cameras, read back.

use skinrig_controller::differing;
use skinrig_model::{CameraId, Setting};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::Check;

use crate::bench::Bench;
use crate::findings::Findings;
use crate::trouble;

const METRICS: &[&str] = &["differences"];

/// Makes the check.
pub fn settings(_check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    for camera in CameraId::ALL {
        one(camera, bench, found);
    }
}

fn one(camera: CameraId, bench: &mut dyn Bench, found: &mut Findings) {
    let subject = trouble::of_camera(camera);
    let wanted = match bench.camera_settings(camera) {
        Ok(wanted) => wanted,
        Err(trouble) => return found.trouble(*trouble, subject, METRICS),
    };
    let device = match &mut bench.devices().cameras[camera.index()] {
        Ok(device) => device,
        Err(trouble) => return found.trouble(*trouble.clone(), subject, METRICS),
    };
    // An earlier check may have been cut off.
    let stopped = device.stop(&mut Vec::new());
    let read = match stopped.and_then(|()| device.configure(&wanted)) {
        Ok(read) => read,
        Err(e) => {
            let trouble = trouble::of(&e);
            if trouble.kind != EvidenceKind::ReadBack {
                return found.trouble(*trouble, subject, METRICS);
            }
            // The first one ends it: what comes after it is not written.
            found
                .value(subject, "differences", 1.0)
                .noting(format!("at least: {}", trouble.what));
            found.evidence.push(*trouble);
            return;
        }
    };
    let mut count = 0;
    for setting in differing(&read) {
        let (name, wrote, told) = (&setting.name, &setting.requested, &setting.read_back);
        let what = format!("{name}: expected {wrote} after writing, found {told}");
        let next = "power-cycle the camera; `read_back_exceptions` is for registers that a camera is known to read differently";
        found
            .evidence
            .push(Evidence::new(EvidenceKind::ReadBack, subject, what).next(next));
        count += 1;
    }
    // A night on tolerance must not look like one on settings that hold.
    for mismatch in read.iter().filter(|s| s.requested == Setting::TOLERATED) {
        let next = "add the key to the rig file if that is right for this camera, and run without --tolerant";
        let what = format!("{}: {}", mismatch.name, mismatch.read_back);
        found
            .evidence
            .push(Evidence::new(EvidenceKind::ReadBack, subject, what).next(next));
        count += 1;
    }
    let told = read.iter().map(|s| format!("{} {}", s.name, s.read_back));
    found
        .value(subject, "differences", f64::from(count))
        .noting(told.collect::<Vec<_>>().join(", "));
}
