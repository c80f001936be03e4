//! Checks `identity` and `settings`.

use skinrig_model::{CameraId, HostTime, RigFault, SimLevel};
use skinrig_nightly::EvidenceKind;
use skinrig_sim::{Fault, FaultTrigger};

use crate::cameras::bench::{SimBench, kinds_and_subjects, number, value};

const IDENTITY: &str = "identity: {differences: {at_most: 0}}";
const SETTINGS: &str = "settings: {differences: {at_most: 0}}";

/// A bench whose rig file has the identity of the simulated devices.
fn known(faults: Vec<Fault>) -> SimBench {
    use skinrig_hil::Bench as _;
    let mut bench = SimBench::new(SimLevel::Kinematic, faults);
    let devices = bench.devices();
    let serials = devices
        .cameras
        .each_ref()
        .map(|c| c.as_ref().unwrap().identity().serial);
    for (setup, serial) in bench.rig.cameras.iter_mut().zip(serials) {
        setup.serial = serial;
    }
    bench
}

#[test]
fn every_device_is_identified_and_compared_with_the_rig_file() {
    let mut bench = known(Vec::new());
    let found = bench.run_check(IDENTITY);
    for device in ["camera1", "camera2", "trigger box"] {
        assert_eq!(number(&found, device, "differences"), 0.0, "{found:#?}");
        let note = value(&found, device, "differences").note.clone().unwrap();
        assert!(
            note.contains("simulated") && note.contains("sim-"),
            "{note}"
        );
    }
    // The simulated robot does not have serial number 4711.
    assert_eq!(number(&found, "robot", "differences"), 1.0);
    assert_eq!(
        kinds_and_subjects(&found),
        [(EvidenceKind::OtherDevice, "robot")]
    );
    bench.rig.cameras[1].fpga = Some("3.0.1".to_owned());
    bench.rig.cameras.swap(0, 1);
    let swapped = bench.run_check(IDENTITY);
    assert_eq!(number(&swapped, "camera1", "differences"), 2.0);
    assert_eq!(number(&swapped, "camera2", "differences"), 1.0);
}

#[test]
fn accepted_settings_are_noted_and_others_count_as_differences() {
    let found = known(Vec::new()).run_check(SETTINGS);
    assert_eq!(found.evidence, []);
    for camera in ["camera1", "camera2"] {
        assert_eq!(number(&found, camera, "differences"), 0.0);
        let note = value(&found, camera, "differences").note.clone().unwrap();
        assert!(note.contains("bias_fo 1477"), "{note}");
    }
    let ignored = RigFault::CameraSettingIgnored(CameraId::Two);
    let ignored = Fault::new(ignored, FaultTrigger::At(HostTime::ZERO)).unwrap();
    let found = known(vec![ignored]).run_check(SETTINGS);
    assert_eq!(number(&found, "camera1", "differences"), 0.0);
    assert_eq!(number(&found, "camera2", "differences"), 1.0);
    assert_eq!(
        kinds_and_subjects(&found),
        [(EvidenceKind::ReadBack, "camera2")]
    );
}
