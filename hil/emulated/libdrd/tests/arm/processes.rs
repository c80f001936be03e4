//! Connection between library, firmware and control client, and termination of all processes.
//!
//! Other processes are this executable with a variable that selects their role.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use drd::{ARM_VARIABLE, ArmConfig, ArmView, EmulatedArm};

use crate::support::{ID, WITHIN, load};

/// Environment variable that makes the test with the same name play its role.
const ROLE: &str = "ROLE";

fn start_role(role: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", &format!("processes::{role}"), "--nocapture"])
        .env(ROLE, role);
    command
}

fn has_role() -> bool {
    std::env::var_os(ROLE).is_some()
}

#[test]
fn drives_the_arm_that_the_environment_names() {
    if !has_role() {
        return;
    }
    let sdk = load(&drd::library_beside_this_executable().unwrap());
    // SAFETY: functions of the table, called with their signatures.
    unsafe {
        assert_eq!((sdk.drdOpenID)(0), 0);
        assert_eq!((sdk.drdStart)(ID), 0);
        assert!((sdk.drdMoveToPos)(0.0125, 0.0, 0.019, true, ID) >= 0);
        // Keep regulating, because a braked arm sinks.
        let directory = std::env::var_os(ARM_VARIABLE).unwrap();
        let state = ArmView::attach(std::path::Path::new(&directory))
            .unwrap()
            .state()
            .unwrap();
        assert!((state.position_m[2] - 0.019).abs() < 0.0005, "{state:?}");
        assert_eq!((sdk.drdStop)(false, ID), 0);
    }
}

/// A process that is killed on drop.
struct KillOnDrop(Child);

impl Drop for KillOnDrop {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn the_firmware_also_runs_from_a_shell_and_is_found_through_the_environment() {
    let directory = tempfile::tempdir().unwrap();
    let firmware = Command::new(env!("CARGO_BIN_EXE_drd-firmware"))
        .arg(directory.path())
        .spawn();
    let _firmware = KillOnDrop(firmware.unwrap());
    let started = Instant::now();
    while !directory.path().join("arm.sock").exists() {
        assert!(started.elapsed() < WITHIN, "no socket");
        thread::sleep(Duration::from_millis(1));
    }
    let driver = start_role("drives_the_arm_that_the_environment_names")
        .env(ARM_VARIABLE, directory.path())
        .output()
        .unwrap();
    assert!(driver.status.success(), "{driver:?}");
}

#[test]
fn without_an_arm_there_is_no_device() {
    let sdk = load(&drd::library_beside_this_executable().unwrap());
    // SAFETY: functions of the table, called with their signatures.
    unsafe {
        assert_eq!((sdk.dhdGetDeviceCount)(), 0);
        assert_eq!(((sdk.drdOpen)(), (sdk.dhdErrorGetLast)()), (-1, 5));
        assert_eq!(((sdk.drdStart)(ID), (sdk.dhdErrorGetLast)()), (-1, 5));
    }
}

#[test]
fn keeps_an_arm_until_it_is_killed() {
    if !has_role() {
        return;
    }
    let arm = EmulatedArm::spawn(&ArmConfig::default()).unwrap();
    println!(
        "firmware {} {}",
        arm.firmware_pid(),
        arm.directory().display()
    );
    loop {
        thread::sleep(Duration::from_secs(1));
    }
}

#[test]
fn a_firmware_ends_with_the_process_that_started_it() {
    let starter = start_role("keeps_an_arm_until_it_is_killed")
        .stdout(Stdio::piped())
        .spawn();
    let mut starter = KillOnDrop(starter.unwrap());
    let output = BufReader::new(starter.0.stdout.take().unwrap());
    let message = output
        .lines()
        .map(Result::unwrap)
        .find(|l| l.contains("firmware "))
        .unwrap();
    let [pid, directory] = message.rsplit(' ').take(2).collect::<Vec<_>>()[..] else {
        panic!("{message}")
    };
    let (directory, pid) = (pid, directory);
    assert!(ArmView::attach(directory.as_ref()).is_ok());
    drop(starter);
    let started = Instant::now();
    let alive = || {
        Command::new("kill")
            .args(["-0", pid])
            .stderr(Stdio::null())
            .status()
            .unwrap()
            .success()
    };
    while alive() {
        assert!(
            started.elapsed() < WITHIN,
            "the firmware {pid} is left over"
        );
        thread::sleep(Duration::from_millis(5));
    }
    std::fs::remove_dir_all(directory).unwrap();
}

#[test]
fn an_invalid_configuration_is_rejected() {
    let refused = |config: &ArmConfig| EmulatedArm::spawn(config).unwrap_err().to_string();
    assert!(
        refused(&ArmConfig {
            loop_khz: 0.0,
            ..ArmConfig::default()
        })
        .contains("did not start")
    );
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("arm.json"), r#"{"arm_index": 3}"#).unwrap();
    let mut firmware = Command::new(env!("CARGO_BIN_EXE_drd-firmware"))
        .arg(directory.path())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut text = String::new();
    firmware
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut text)
        .unwrap();
    assert!(!firmware.wait().unwrap().success());
    assert!(
        text.contains("arm_index: expected the index of one of the devices"),
        "{text}"
    );
}
