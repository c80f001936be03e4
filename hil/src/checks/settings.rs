//! Check `settings`: camera settings, written and read back.

use skinrig_controller::differing;
use skinrig_model::{CameraId, Setting};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::Check;

use crate::bench::Bench;
use crate::device_evidence;
use crate::findings::Findings;

const METRICS: &[&str] = &["differences"];

/// Runs the check.
pub(super) fn settings(_check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    for camera in CameraId::ALL {
        check_camera(camera, bench, findings);
    }
}

fn check_camera(camera: CameraId, bench: &mut dyn Bench, findings: &mut Findings) {
    let subject = device_evidence::camera_subject(camera);
    let settings = match bench.camera_settings(camera) {
        Ok(settings) => settings,
        Err(problem) => return findings.failed(*problem, subject, METRICS),
    };
    let device = match &mut bench.devices().cameras[camera.index()] {
        Ok(device) => device,
        Err(problem) => return findings.failed(*problem.clone(), subject, METRICS),
    };
    // The previous check may have been interrupted while it streamed.
    let stopped = device.stop(&mut Vec::new());
    let read = match stopped.and_then(|()| device.configure(&settings)) {
        Ok(read) => read,
        Err(e) => {
            let problem = device_evidence::from_error(&e);
            if problem.kind != EvidenceKind::ReadBack {
                return findings.failed(*problem, subject, METRICS);
            }
            // The first mismatch ends the configuration: later settings were not written.
            findings
                .value(subject, "differences", 1.0)
                .with_note(format!("at least: {}", problem.what));
            findings.evidence.push(*problem);
            return;
        }
    };
    let mut count = 0;
    for setting in differing(&read) {
        let (name, wrote, found_value) = (&setting.name, &setting.requested, &setting.read_back);
        let what = format!("{name}: expected {wrote} after writing, found {found_value}");
        let next = "power-cycle the camera; use `read_back_exceptions` only for registers that this camera is known to read back differently";
        findings
            .evidence
            .push(Evidence::new(EvidenceKind::ReadBack, subject, what).next(next));
        count += 1;
    }
    // Report tolerated mismatches too: the camera did not accept these settings.
    for mismatch in read.iter().filter(|s| s.requested == Setting::TOLERATED) {
        let next = "if this value is right for this camera, add the key to the rig file and run without --tolerant";
        let what = format!("{}: {}", mismatch.name, mismatch.read_back);
        findings
            .evidence
            .push(Evidence::new(EvidenceKind::ReadBack, subject, what).next(next));
        count += 1;
    }
    let values = read.iter().map(|s| format!("{} {}", s.name, s.read_back));
    findings
        .value(subject, "differences", f64::from(count))
        .with_note(values.collect::<Vec<_>>().join(", "));
}
