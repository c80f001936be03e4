//! Steps 14 to 21 of docs/how-to/bench.md on the emulated bench. Never run on hardware.

use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use emulated_libdrd::{ArmState, Contact, Mode};
use skinrig_emulated_bench::{ArmFault, EmulatedBench, When};

use super::{in_real_time, start, workspace_root};

const SKINRIG: &str = env!("CARGO_BIN_EXE_skinrig");
/// Upper limit for waiting on an answer; waits end as soon as it arrives.
const PATIENCE: Duration = Duration::from_secs(60);
/// Maximum distance of the emulated tip from its target, mm.
const NEAR_MM: f64 = 0.15;

/// A running `skinrig jog` with a pipe as standard input.
struct Jog {
    child: Child,
    orders: Option<ChildStdin>,
    lines: Receiver<String>,
    printed: String,
}

impl Jog {
    /// Starts `skinrig jog --rig FILE`.
    fn start(bench: &EmulatedBench, rig: &Path, log: &Path) -> Self {
        let mut command = bench.command(SKINRIG).unwrap();
        command
            .args(["jog", "--rig"])
            .arg(rig)
            .arg("--log")
            .arg(log);
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        let (sender, lines) = channel();
        std::thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        Self {
            orders: child.stdin.take(),
            child,
            lines,
            printed: String::new(),
        }
    }

    fn send(&mut self, order: &str) {
        writeln!(self.orders.as_mut().unwrap(), "{order}").unwrap();
    }

    /// Waits for the next line that starts with `beginning`.
    fn wait_for_line(&mut self, beginning: &str) -> String {
        loop {
            let line = self.lines.recv_timeout(PATIENCE);
            let line =
                line.unwrap_or_else(|e| panic!("{beginning}: {e}: {}", self.close_and_read()));
            self.printed += &format!("{line}\n");
            if line.starts_with(beginning) {
                return line;
            }
        }
    }

    fn close_and_read(&mut self) -> String {
        self.orders = None;
        let mut errors = String::new();
        if let Some(mut stderr) = self.child.stderr.take() {
            stderr.read_to_string(&mut errors).unwrap();
        }
        format!("{}{errors}", self.printed)
    }

    /// Sends an order and returns the tip position that the robot then reports, mm.
    fn position_after(&mut self, order: &str) -> [f64; 3] {
        self.send(order);
        let line = self.wait_for_line("at ");
        let (_, inside) = line.split_once('(').unwrap();
        let numbers = inside.split_once(')').unwrap().0.split(", ");
        let numbers: Vec<f64> = numbers.map(|n| n.parse().unwrap()).collect();
        numbers.try_into().unwrap()
    }

    /// Waits for the exit; returns exit code and all output.
    fn end(mut self) -> (Option<i32>, String) {
        let rest = self.close_and_read();
        let code = self.child.wait().unwrap().code();
        let more: Vec<String> = self.lines.iter().collect();
        (code, format!("{rest}{}", more.join("\n")))
    }
}

/// The bench and the copy of its rig file that the steps edit.
struct Steps {
    bench: EmulatedBench,
    folder: tempfile::TempDir,
    jogs: usize,
}

impl Steps {
    fn rig(&self) -> PathBuf {
        self.folder.path().join("NAME.yaml")
    }

    /// Step 14: limits around the arm's position in the middle of its reach.
    fn write_rig(&self, max_force: &str, gravity_ratio: &str) {
        let text = fs::read_to_string(workspace_root().join("hil/rigs/emulated.yaml")).unwrap();
        let workspace = "workspace: {min: [-70 mm, -70 mm, -30 mm], max: [70 mm, 70 mm, 40 mm]}";
        let lines = [
            (
                workspace,
                "workspace: {min: [-10 mm, -20 mm, -25 mm], max: [30 mm, 20 mm, 40 mm]}",
            ),
            ("max_speed: 100 mm/s", "max_speed: 10 mm/s"),
            ("max_force: 8 N", &format!("max_force: {max_force}")),
            (
                "gravity_ratio: 0.1",
                &format!("gravity_ratio: {gravity_ratio}"),
            ),
        ];
        let text = lines.into_iter().fold(text, |text, (from, to)| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        });
        fs::write(self.rig(), text).unwrap();
    }

    fn jog(&mut self) -> Jog {
        self.jogs += 1;
        let log = self.folder.path().join(format!("{}.log", self.jogs));
        Jog::start(&self.bench, &self.rig(), &log)
    }

    /// Places the arm in the middle of its reach, as if by hand, without faults.
    fn center_arm(&self) {
        self.bench.arm().clear_faults().unwrap();
        self.bench.arm().place([0.01, 0.0, 0.01]).unwrap();
    }

    /// Waits until the arm goes soft.
    fn wait_until_soft(&self) {
        let soft = self
            .bench
            .arm()
            .wait_until(PATIENCE, |s| s.mode != Mode::Force);
        soft.unwrap();
    }

    fn tip_mm(&self) -> [f64; 3] {
        self.bench
            .arm()
            .state()
            .unwrap()
            .position_m
            .map(|m| 1e3 * m)
    }

    /// Starts a jog and returns while it rises slowly.
    fn start_slow_rise(&mut self) -> Jog {
        self.center_arm();
        let mut jog = self.jog();
        jog.send("speed 2mm/s");
        jog.wait_for_line("speed");
        let from_m = self.tip_mm()[2] * 1e-3;
        jog.send("z +20mm");
        let rises = |s: &ArmState| s.position_m[2] > from_m + 0.001;
        self.bench.arm().wait_until(PATIENCE, rises).unwrap();
        jog
    }
}

#[test]
fn the_steps_of_a_first_contact_show_what_they_must() {
    in_real_time(take_the_steps);
}

fn take_the_steps() {
    let Some(bench) = start() else {
        return;
    };
    let mut steps = Steps {
        bench,
        folder: tempfile::tempdir().unwrap(),
        jogs: 0,
    };
    the_share_of_gravity(&mut steps);
    axes_and_rest(&mut steps);
    button_and_cable(&mut steps);
    a_program_that_dies_or_hangs(&mut steps);
    a_hand(&mut steps);
}

/// Step 14: this arm cannot hold itself with 1 N; following jog's advice fixes it.
fn the_share_of_gravity(steps: &mut Steps) {
    steps.center_arm();
    steps.write_rig("1 N", "0");
    let (code, output) = steps.jog().end();
    assert_eq!(code, Some(3), "{output}");
    for word in ["limits.max_force", "motor_force.gravity_ratio"] {
        assert!(output.contains(word), "{word}: {output}");
    }
    steps.wait_until_soft();
    steps.center_arm();
    steps.write_rig("3 N", "0");
    let mut jog = steps.jog();
    let note = jog.wait_for_line("note ");
    let (_, ratio) = note.split_once("gravity_ratio ").unwrap();
    let ratio: f64 = ratio.split_once(' ').unwrap().0.parse().unwrap();
    // The emulated arm compensates 0.115 kg of its 0.12 kg.
    assert!((0.08..0.11).contains(&ratio), "{note}");
    let (code, output) = jog.end();
    assert_eq!(code, Some(0), "{output}");
    steps.write_rig("1 N", &ratio.to_string());
}

/// Steps 14 to 16.
fn axes_and_rest(steps: &mut Steps) {
    steps.center_arm();
    let mut jog = steps.jog();
    let reported = jog.position_after("where");
    let near = |a: [f64; 3], b: [f64; 3]| (0..3).all(|i| (a[i] - b[i]).abs() < NEAR_MM);
    assert!(
        near(reported, steps.tip_mm()),
        "{reported:?} {:?}",
        steps.tip_mm()
    );
    jog.send("speed 2mm/s");
    jog.wait_for_line("speed");
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        for by_mm in [2.0, -2.0] {
            let mut expected = jog.position_after("where");
            expected[axis] += by_mm;
            jog.position_after(&format!("{name} {by_mm:+}mm"));
            assert!(
                near(expected, steps.tip_mm()),
                "{name} {by_mm:+}: {expected:?} {:?}",
                steps.tip_mm()
            );
        }
    }
    let before = jog.position_after("where");
    let mut after = before;
    for _ in 0..100 {
        after = jog.position_after("where");
    }
    let drift = (0..3)
        .map(|i| (after[i] - before[i]).powi(2))
        .sum::<f64>()
        .sqrt();
    assert!(drift < 0.05, "{before:?} {after:?}");
    let (code, output) = jog.end();
    assert_eq!(code, Some(0), "{output}");
    assert!(output.contains("disarmed"), "{output}");
}

/// Steps 17 and 18.
fn button_and_cable(steps: &mut Steps) {
    for (fault, words) in [(ArmFault::Button, "button"), (ArmFault::Lost, "USB")] {
        let jog = steps.start_slow_rise();
        steps.bench.arm().inject(When::Now, fault).unwrap();
        steps.wait_until_soft();
        let (code, output) = jog.end();
        assert_eq!(code, Some(3), "{output}");
        assert!(output.contains(words), "{words}: {output}");
        if fault == ArmFault::Button {
            // Pressing the button again re-enables forces.
            steps
                .bench
                .arm()
                .inject(When::Now, ArmFault::Button)
                .unwrap();
        }
    }
}

/// Steps 19 and 20.
fn a_program_that_dies_or_hangs(steps: &mut Steps) {
    let mut jog = steps.start_slow_rise();
    jog.child.kill().unwrap();
    steps.wait_until_soft();
    drop(jog.end());
    let jog = steps.start_slow_rise();
    signal(&jog, "-STOP");
    steps.wait_until_soft();
    signal(&jog, "-CONT");
    let (code, output) = jog.end();
    assert_eq!(code, Some(3), "{output}");
}

fn signal(jog: &Jog, signal: &str) {
    let pid = jog.child.id().to_string();
    let sent = std::process::Command::new("kill")
        .args([signal, &pid])
        .status();
    assert!(sent.unwrap().success());
}

/// Step 21: a hand 2 mm beside the tip.
fn a_hand(steps: &mut Steps) {
    steps.center_arm();
    let mut jog = steps.jog();
    jog.send("speed 2mm/s");
    jog.wait_for_line("speed");
    let [x, y, z] = steps.tip_mm().map(|mm| 1e-3 * mm);
    let hand = Contact {
        point_m: [x + 0.002, y, z],
        normal: [-1.0, 0.0, 0.0],
        stiffness_n_m: 500.0,
        damping_n_s_m: 5.0,
    };
    steps.bench.arm().set_contact(Some(hand)).unwrap();
    jog.send("x +10mm");
    let arm = steps.bench.arm();
    let pushes = |s: &ArmState| -s.contact_force_n[0] > 0.5;
    arm.wait_until(PATIENCE, pushes).unwrap();
    let mut most_n: f64 = 0.0;
    let ended = arm.wait_until(PATIENCE, |s| s.mode != Mode::Force);
    ended.unwrap();
    most_n = most_n.max(-arm.state().unwrap().contact_force_n[0]);
    let (code, output) = jog.end();
    assert_eq!(code, Some(3), "{output}");
    assert!(most_n < 1.3, "{most_n} N");
    assert!(output.contains("force"), "{output}");
}
