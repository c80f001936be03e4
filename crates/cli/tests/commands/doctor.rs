//! `skinrig doctor` on emulated hardware with wrong cables or permissions.

use std::path::Path;

use emulated_libdrd::{ArmConfig, EmulatedArm, Fault, When};
use serde_json::Value;
use skinrig_emulated_camera::config::Access;
use skinrig_emulated_camera::{Bus, BusConfig, DeviceConfig, Evk1Config};

/// A camera of the rig file `hil/rigs/emulated.yaml`.
fn camera(serial: &str, change: impl FnOnce(&mut Evk1Config)) -> DeviceConfig {
    let mut camera = Evk1Config::new(serial);
    change(&mut camera);
    camera.into()
}

/// Report of the doctor on these devices, and its exit code.
fn doctor(cameras: Vec<DeviceConfig>, fault: Option<Fault>) -> (Value, Option<i32>) {
    let bus = Bus::start(&BusConfig { devices: cameras }).unwrap();
    let arm = EmulatedArm::spawn(&ArmConfig {
        devices: vec![emulated_libdrd::DeviceConfig {
            serial: 4711,
            ..Default::default()
        }],
        ..ArmConfig::default()
    });
    let arm = arm.unwrap();
    if let Some(fault) = fault {
        arm.inject(When::Now, fault).unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let mut command = bus.command(env!("CARGO_BIN_EXE_skinrig")).unwrap();
    command
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."))
        .env("SKINRIG_EMULATED_LIBDRD", arm.library())
        .env("SKINRIG_EMULATED_TRIGGER_BOX", "/nowhere/box")
        .env("SKINRIG_EMULATED_LAMPS_OFF", "/nowhere/lamps-off")
        .args(["doctor", "--json", "--rig", "hil/rigs/emulated.yaml"])
        .arg("--sessions")
        .arg(folder.path());
    let output = command.output().unwrap();
    let json = serde_json::from_slice(&output.stdout);
    (
        json.unwrap_or_else(|e| panic!("{e}\n{output:?}")),
        output.status.code(),
    )
}

/// Verdict and next step of a check.
fn find_check<'a>(report: &'a Value, area: &str, check: &str) -> (&'a str, &'a str) {
    let all = report["findings"].as_array().unwrap();
    let found = all
        .iter()
        .find(|f| f["area"] == area && f["check"] == check);
    let found = found.unwrap_or_else(|| panic!("{area}, {check}: {report:#}"));
    (
        found["verdict"].as_str().unwrap(),
        found["next_step"].as_str().unwrap_or(""),
    )
}

#[test]
fn a_slow_camera_a_forbidden_one_and_an_unplugged_robot_get_different_findings() {
    let cameras = vec![
        camera("00000001", |c| c.speed_mbit = 480),
        camera("00000002", |c| c.access = Access::NotPermitted),
    ];
    let (report, code) = doctor(cameras, Some(Fault::Lost));
    assert_eq!(code, Some(3), "{report:#}");
    assert_eq!(report["kind"], "emulated");
    let (verdict, next) = find_check(&report, "USB speed", "camera1");
    assert!(
        verdict == "problem" && next.contains("USB 3 cable"),
        "{report:#}"
    );
    // The other camera cannot be opened, so it is unknown whether it is camera 2.
    let (verdict, next) = find_check(&report, "permissions", "camera at bus 1 device 3");
    assert!(
        verdict == "problem" && next.contains("70-skinrig.rules"),
        "{report:#}"
    );
    assert_eq!(find_check(&report, "cables", "camera2").0, "not checked");
    let (verdict, next) = find_check(&report, "cables", "robot");
    assert!(
        verdict == "problem" && next.contains("plug it in"),
        "{report:#}"
    );
    assert_eq!(find_check(&report, "versions", "robot library").0, "ok");
}

#[test]
fn devices_as_they_should_be_are_no_problem() {
    let cameras = ["00000001", "00000002"].map(|serial| camera(serial, |_| {}));
    let (report, _) = doctor(cameras.into(), None);
    for (area, check) in [
        ("permissions", "camera1"),
        ("permissions", "robot"),
        ("cables", "robot"),
        ("cables", "camera1"),
        ("cables", "camera2"),
        ("cables", "camera2: hub"),
        ("USB speed", "camera1"),
        ("versions", "camera1"),
        ("bench", "devices"),
    ] {
        assert_eq!(
            find_check(&report, area, check).0,
            "ok",
            "{area}, {check}: {report:#}"
        );
    }
}
