//! Death of the driving program: the device's watchdog or the supervisor process brakes the arm.

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use emulated_libdrd::{EmulatedArm, Fault, Mode, When};
use skinrig_device::Indenter;
use skinrig_omega3::config::{SupervisorCommand, Watchdog};
use skinrig_omega3::enumerate;
use skinrig_omega3::load::load;
use skinrig_omega3::supervisor::supervise;
use skinrig_omega3::{OmegaConfig, Remark};

use crate::support::*;

/// Environment variable that turns this test program into the driver to kill: `library,watchdog in ms,supervised`.
const VICTIM: &str = "SKINRIG_TEST_VICTIM";
/// Environment variable that turns this test program into a supervisor.
const SUPERVISOR: &str = "SKINRIG_TEST_SUPERVISOR";

fn this_test(name: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("path of this test program"));
    command.args(["--exact", name, "--nocapture", "--test-threads=1"]);
    command
}

/// Command of the supervisor: this program, started through `env`, which replaces itself with it.
fn supervisor() -> SupervisorCommand {
    let exe = std::env::current_exe().expect("path of this test program");
    SupervisorCommand {
        program: "env".into(),
        arguments: [
            &format!("{SUPERVISOR}=1"),
            exe.to_str().expect("UTF-8 path"),
            "--exact",
            "death::supervisor_process",
            "--nocapture",
            "--test-threads=1",
        ]
        .map(str::to_owned)
        .to_vec(),
    }
}

/// Not a test: see [`SUPERVISOR`].
#[test]
fn supervisor_process() {
    if std::env::var_os(SUPERVISOR).is_some() {
        println!(); // ends the line started by the test harness
        let watch = supervise(std::io::stdin(), std::io::stdout(), std::io::sink());
        // Discards the output of the test harness.
        std::process::exit(i32::from(watch.is_err()));
    }
}

/// Not a test: see [`VICTIM`].
#[test]
fn victim_process() {
    let Ok(orders) = std::env::var(VICTIM) else {
        return;
    };
    let [library, watchdog, supervised] = orders.split(',').collect::<Vec<_>>()[..] else {
        panic!("{orders}")
    };
    let mut config = OmegaConfig {
        library: Some(PathBuf::from(library)),
        supervisor: (supervised == "true").then(supervisor),
        ..OmegaConfig::default()
    };
    config.watchdog = match watchdog.parse().expect("a number") {
        0.0 => Watchdog::Off,
        ms => Watchdog::ArmMilliseconds(ms),
    };
    config.trips.min_control_khz = 0.05;
    config.timeouts.open = TIMEOUT;
    config.timeouts.regulation = TIMEOUT;
    let mut omega = armed_with(config);
    omega
        .command(point([12.5, 0.0, 5.0]), 1.0)
        .expect("command is accepted");
    println!("\nmoving");
    let _ = poll_until(&mut omega, |_| false);
}

/// A driver in a separate process that is moving the arm.
fn victim(arm: &EmulatedArm, watchdog_ms: f64, supervised: bool) -> Child {
    let library = arm.library();
    let orders = format!("{},{watchdog_ms},{supervised}", library.display());
    let mut child = this_test("death::victim_process")
        .env(VICTIM, orders)
        .stdout(Stdio::piped())
        .spawn()
        .expect("process starts");
    let output = child.stdout.take().expect("piped stdout");
    let mut lines = BufReader::new(output).lines().map_while(Result::ok);
    assert!(lines.any(|line| line == "moving"), "the victim never moved");
    child
}

fn kill(mut child: Child) {
    child.kill().expect("process killed");
    child.wait().expect("process reaped");
}

#[test]
fn the_watchdog_brakes_the_arm_of_a_killed_program() {
    let arm = arm();
    let child = victim(&arm, 20.0, false);
    assert_eq!(arm.state().expect("arm state").mode, Mode::Force);
    kill(child);
    let state = arm
        .wait_until(TIMEOUT, |s| s.mode == Mode::Brake)
        .expect("arm is braked");
    assert!(state.watchdog_trips > 0, "{state:?}");
}

#[test]
fn the_watchdog_brakes_the_arm_of_a_hanging_program() {
    let arm = arm();
    let child = victim(&arm, 20.0, false);
    let stopped = Command::new("kill")
        .args(["-STOP", &child.id().to_string()])
        .status();
    assert!(stopped.is_ok_and(|s| s.success()));
    let braked = arm.wait_until(TIMEOUT, |s| s.mode == Mode::Brake);
    kill(child);
    braked.expect("arm is braked");
}

#[test]
fn the_end_of_the_supervisor_stops_the_arm() {
    let arm = arm();
    let mut config = config(&arm);
    config.supervisor = Some(SupervisorCommand {
        program: "sh".into(),
        arguments: vec![
            "-c".to_owned(),
            "echo ready; read go; read on; read end; sleep 1".to_owned(),
        ],
    });
    let mut omega = armed_with(config);
    let error = poll_until(&mut omega, |_| false).expect_err("a fault");
    assert!(
        error.to_string().contains("supervisor process ended"),
        "{error}"
    );
    arm.wait_until(TIMEOUT, |s| s.mode == Mode::Brake)
        .expect("arm is braked");
}

#[test]
fn the_supervisor_brakes_the_arm_of_a_killed_program() {
    let arm = arm();
    // The supervisor's process has no regulation; it is not documented what the vendor's drdStop does then.
    arm.inject(When::Now, Fault::StopNeedsRegulation)
        .expect("fault injected");
    let child = victim(&arm, 0.0, true);
    assert_eq!(arm.state().expect("arm state").mode, Mode::Force);
    kill(child);
    let state = arm
        .wait_until(TIMEOUT, |s| s.mode == Mode::Brake)
        .expect("arm is braked");
    assert_eq!(state.watchdog_trips, 0, "it was the supervisor");
    let journal = arm.journal().expect("journal");
    let pids: Vec<u32> = journal.owners().iter().map(|(pid, ..)| *pid).collect();
    assert_eq!(pids.len(), 2, "driver and supervisor: {pids:?}");
}

#[test]
fn without_watchdog_and_supervisor_the_emulated_arm_keeps_its_force() {
    // Shows that nothing else braked the arm in the two tests above.
    let arm = arm();
    let child = victim(&arm, 0.0, true);
    let supervisor = Command::new("pgrep")
        .args(["-P", &child.id().to_string()])
        .output();
    let Ok(found) = supervisor else {
        kill(child);
        return; // without pgrep the supervisor cannot be found
    };
    for pid in String::from_utf8_lossy(&found.stdout).split_whitespace() {
        let killed = Command::new("kill").args(["-9", pid]).status();
        assert!(killed.is_ok_and(|s| s.success()));
    }
    kill(child);
    arm.wait_until(TIMEOUT, |s| !s.held)
        .expect("device released");
    std::thread::sleep(Duration::from_millis(100));
    assert_eq!(arm.state().expect("arm state").mode, Mode::Force);
    // The next program to open it brakes it first.
    let omega = open(&arm);
    assert!(omega.remarks().contains(&Remark::MotorsWereLive));
    assert_eq!(arm.state().expect("arm state").mode, Mode::Brake);
}

#[test]
fn a_supervisor_that_ends_stops_the_arm_and_a_goodbye_dismisses_it() {
    let arm = arm();
    let mut config = config(&arm);
    config.supervisor = Some(supervisor());
    let mut omega = armed_with(config.clone());
    go(&mut omega, [12.5, 0.0, 18.0], 20.0);
    drop(omega);
    let journal = arm.journal().expect("journal");
    assert_eq!(journal.owners().len(), 1, "the supervisor did not open it");

    config.supervisor = Some(SupervisorCommand {
        program: "false".into(),
        arguments: Vec::new(),
    });
    let refused = skinrig_omega3::Omega::open(config, skinrig_device::RealClock::start());
    let text = refused.err().expect("open is rejected").to_string();
    assert!(text.contains("supervisor"), "{text}");
    assert!(!arm.state().expect("arm state").held, "closed again");
}

#[test]
fn a_robot_held_by_another_program_is_busy() {
    let arm = arm();
    let child = victim(&arm, 20.0, false);
    let loaded = load(Some(&arm.library())).expect("library loads");
    let all = enumerate::list(&loaded.library).expect("device list");
    assert!(all[0].to_string().contains("busy"), "{}", all[0]);
    let error = skinrig_omega3::Omega::open(config(&arm), skinrig_device::RealClock::start())
        .err()
        .expect("open is rejected");
    assert!(
        error.to_string().contains("end the other program"),
        "{error}"
    );
    kill(child);
}
