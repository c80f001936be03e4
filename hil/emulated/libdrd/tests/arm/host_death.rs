//! Behaviour of the arm when the program that drives it dies, hangs, or exits without stopping.
//!
//! The program is this executable: started with [`ARM`] set, the test [`driving_program`] drives that arm until it is killed.

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread;
use std::time::Duration;

use drd::{ArmConfig, EmulatedArm, Mode};

use crate::support::{Bench, ID, WITHIN, load, start};

/// Environment variable with the directory of the arm to drive.
const ARM: &str = "DRIVEN_ARM";
/// Watchdog to set, units of 125 µs.
const WATCHDOG: &str = "DRIVEN_WATCHDOG";

#[test]
fn driving_program() {
    let Some(directory) = std::env::var_os(ARM) else {
        return;
    };
    let watchdog: u8 = std::env::var(WATCHDOG).unwrap().parse().unwrap();
    let sdk = load(&Path::new(&directory).join("libdrd.so"));
    start(&sdk);
    // SAFETY: functions of the table, called with their signatures.
    unsafe {
        assert_eq!((sdk.dhdEnableExpertMode)(), 0);
        assert_eq!((sdk.dhdSetWatchdog)(watchdog, ID), 0);
        assert!((sdk.drdMoveToPos)(0.02, 0.0, 0.0, true, ID) >= 0);
    }
    println!("driving");
    loop {
        thread::sleep(Duration::from_secs(1));
    }
}

/// A driving program that has the arm open; killed on drop.
struct Program(Child, BufReader<ChildStdout>);

impl Program {
    fn start(arm: &EmulatedArm, watchdog: u8) -> Self {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "host_death::driving_program", "--nocapture"])
            .env(ARM, arm.directory())
            .env(WATCHDOG, watchdog.to_string())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let output = BufReader::new(child.stdout.take().unwrap());
        let mut program = Self(child, output);
        let driving = (&mut program.1)
            .lines()
            .any(|line| line.unwrap().ends_with("driving"));
        assert!(driving, "the program ended early");
        program
    }

    fn signal(&self, signal: &str) {
        let done = Command::new("kill")
            .args([signal, &self.0.id().to_string()])
            .status()
            .unwrap();
        assert!(done.success());
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

#[test]
fn the_watchdog_brakes_the_arm_when_its_program_is_killed() {
    let arm = EmulatedArm::spawn(&ArmConfig::default()).unwrap();
    let program = Program::start(&arm, 100);
    let before = arm.state().unwrap();
    assert!(
        before.mode == Mode::Force && before.regulating && before.watchdog_trips == 0,
        "{before:?}"
    );
    program.signal("-KILL");
    let after = arm.wait_until(WITHIN, |s| s.mode == Mode::Brake).unwrap();
    assert_eq!((after.force_off_cause, after.watchdog_trips), (3, 1));
    assert!(!after.regulating && !after.held);
}

#[test]
fn without_a_watchdog_the_motors_stay_on_until_another_program_brakes() {
    let arm = EmulatedArm::spawn(&ArmConfig::default()).unwrap();
    let program = Program::start(&arm, 0);
    program.signal("-KILL");
    let released = arm.wait_until(WITHIN, |s| !s.held).unwrap();
    // After many times the longest watchdog, the arm still applies the last force of the dead program.
    let later = arm
        .wait_until(WITHIN, |s| s.t_ns > released.t_ns + 300_000_000)
        .unwrap();
    assert_eq!(
        (later.mode, later.motor_force_n),
        (Mode::Force, released.motor_force_n)
    );
    assert!(later.motor_force_n[2] > 0.5, "{later:?}");

    let sdk = load(&arm.library());
    // SAFETY: functions of the table, called with their signatures.
    let results = unsafe { [(sdk.drdOpenID)(0), (sdk.dhdStop)(ID), (sdk.drdClose)(ID)] };
    assert_eq!(results, [0; 3]);
    let braked = arm.state().unwrap();
    assert_eq!((braked.mode, braked.force_off_cause), (Mode::Brake, 4));
}

#[test]
fn the_watchdog_brakes_the_arm_when_its_program_is_stopped_by_a_signal() {
    let arm = EmulatedArm::spawn(&ArmConfig::default()).unwrap();
    let program = Program::start(&arm, 100);
    program.signal("-STOP");
    let after = arm.wait_until(WITHIN, |s| s.mode == Mode::Brake).unwrap();
    assert_eq!(after.force_off_cause, 3);
    // It still has the device open, so that no other program can open it.
    let sdk = load(&arm.library());
    // SAFETY: functions of the table, called with their signatures.
    let (opened, error) = unsafe { ((sdk.drdOpenID)(0), (sdk.dhdErrorGetLast)()) };
    assert_eq!((opened, error), (-1, 20));
}

#[test]
fn a_close_without_a_stop_leaves_the_motors_on() {
    let bench = Bench::started(&ArmConfig::default());
    // SAFETY: a function of the table.
    assert_eq!(unsafe { (bench.sdk.drdClose)(ID) }, 0);
    let after = bench.arm.state().unwrap();
    assert!(
        after.mode == Mode::Force && !after.regulating && !after.held,
        "{after:?}"
    );
}
