//! Benches: rig files, connected devices, preflight in sessions, jogging, and presses from touch.

use std::io::{Read, Write};
use std::process::Stdio;

use serde_json::Value;
use skinrig_protocol::rig::RigFile;

use crate::replay::assert_replays;
use crate::support::{Lab, ProgramOutput, ROOT, files, program, run_to_end, show, skinrig};

const EMULATED: &str = "hil/rigs/emulated.yaml";
const QUICK: &str = "protocols/quick-check.yaml";

/// Runs the program with the devices of an absent emulated bench.
fn without_devices(arguments: &[&str]) -> ProgramOutput {
    let mut command = program(arguments);
    command
        .env("SKINRIG_EMULATED_LIBDRD", "/nowhere/libdrd.so")
        .env("SKINRIG_EMULATED_TRIGGER_BOX", "/nowhere/box")
        .env("SKINRIG_EMULATED_LAMPS_OFF", "/nowhere/lamps-off")
        .env("SKINRIG_LIBDRD", "/nowhere/libdrd.so");
    run_to_end(command)
}

#[test]
fn nothing_connected_is_no_error_and_every_line_has_a_next_step() {
    let plain = without_devices(&["devices"]).code(0);
    assert!(plain.out.contains("libdrd not found"), "{plain:?}");
    assert!(plain.out.contains("no device is ready"), "{plain:?}");
    let json = without_devices(&["devices", "--rig", EMULATED, "--json"])
        .code(0)
        .json();
    assert_eq!(json["kind"], "emulated");
    let lines = json["devices"].as_array().unwrap();
    let role = |role: &str| lines.iter().find(|l| l["role"] == role);
    for name in ["camera1", "camera2", "trigger_box"] {
        let line = role(name).unwrap_or_else(|| panic!("{name} is not listed: {lines:?}"));
        // Without USB it is unknown whether a camera is connected.
        let no_bus = name != "trigger_box" && line["state"] == "not asked";
        assert!(no_bus || line["state"] == "absent", "{line}");
        assert!(
            line["next_step"].as_str().is_some_and(|s| !s.is_empty()),
            "{line}"
        );
    }
}

#[test]
fn doctor_lists_the_missing_devices_of_an_absent_bench() {
    let lab = Lab::new();
    let sessions = lab.text("s");
    let doctor = |more: &[&str]| {
        let mut arguments = vec!["doctor", "--sessions", &sessions];
        arguments.extend_from_slice(more);
        without_devices(&arguments)
    };
    let verdict = |json: &Value, area: &str, check: &str| {
        let all = json["findings"].as_array().unwrap();
        let found = all
            .iter()
            .find(|f| f["area"] == area && f["check"] == check);
        found.map_or(Value::Null, |f| f["verdict"].clone())
    };
    // Without a rig file no device is missing; problems of this computer do not matter here.
    let alone = doctor(&["--json"]).json();
    assert_eq!(alone["kind"], Value::Null);
    for (area, check) in [("cables", "devices"), ("versions", "robot library")] {
        assert_eq!(verdict(&alone, area, check), "not checked", "{alone}");
    }
    let bench = doctor(&["--rig", EMULATED, "--json"]).code(3).json();
    assert_eq!(bench["kind"], "emulated");
    for (area, check) in [("cables", "trigger_box"), ("versions", "robot library")] {
        assert_eq!(verdict(&bench, area, check), "problem", "{bench}");
    }
    assert!(bench["problems"].as_u64() >= Some(2), "{bench}");
    let plain = doctor(&["--rig", EMULATED]).code(3);
    assert!(plain.out.starts_with("rig       emulated\n"), "{plain:?}");
    assert!(plain.out.contains("problem") && plain.out.contains("next: "));
    doctor(&["--rig", QUICK])
        .code(2)
        .expect_stderr(&["this is not a rig"]);
}

#[test]
fn a_rig_file_is_read_with_the_same_care_as_a_protocol() {
    let lab = Lab::new();
    let run =
        |rig: &str| without_devices(&["run", QUICK, "--rig", rig, "--sessions", &lab.text("s")]);
    run("hil/rigs/nowhere.yaml")
        .code(2)
        .expect_stderr(&["cannot read hil/rigs/nowhere.yaml"]);
    run(QUICK)
        .code(2)
        .expect_stderr(&["this is not a rig", "found: a protocol"]);
    let corrupted = std::fs::read_to_string(format!("{ROOT}/{EMULATED}")).unwrap();
    let corrupted = corrupted.replace("max_force: 8 N", "max_force: 8");
    std::fs::write(lab.path("rig.yaml"), corrupted).unwrap();
    run(&lab.text("rig.yaml")).code(2).expect_stderr(&[
        "limits.max_force",
        "the unit is missing",
        "write `8 N`",
    ]);
    // A run presses the sample that the file declares removed; initialisation might sweep the arm through it.
    let bare = std::fs::read_to_string(format!("{ROOT}/{EMULATED}")).unwrap();
    let bare = bare.replace("\nrobot:\n", "\nrobot:\n  sample_is_off: true\n");
    std::fs::write(lab.path("bare.yaml"), bare).unwrap();
    run(&lab.text("bare.yaml"))
        .code(2)
        .expect_stderr(&["robot.sample_is_off: expected false", "skinrig jog"]);
    skinrig(&["run", QUICK, "--rig", EMULATED, "--level", "optical"]).code(2);
    assert_eq!(files(&lab.path("s"), "").len(), 0, "nothing was recorded");
}

#[test]
fn a_missing_bench_is_reported_with_the_next_step() {
    let lab = Lab::new();
    let sessions = lab.text("s");
    without_devices(&["run", QUICK, "--rig", EMULATED, "--sessions", &sessions])
        .code(3)
        .expect_stderr(&["/nowhere/libdrd.so", "install the SDK"]);
    without_devices(&["jog", "--rig", EMULATED, "--log", &lab.text("jog.log")])
        .code(3)
        .expect_stderr(&["/nowhere/libdrd.so"]);
}

#[test]
fn the_tighter_limit_of_bench_and_protocol_holds() {
    let lab = Lab::new();
    let text = std::fs::read_to_string(format!("{ROOT}/{EMULATED}")).unwrap();
    let text = text.replace("max_speed: 100 mm/s", "max_speed: 30 mm/s");
    std::fs::write(lab.path("slow.yaml"), text).unwrap();
    without_devices(&[
        "run",
        QUICK,
        "--rig",
        &lab.text("slow.yaml"),
        "--sessions",
        &lab.text("s"),
    ])
    .code(2)
    .expect_stderr(&[
        "the speed is outside its limit",
        "at most 30 mm/s",
        "slow.yaml allows",
    ]);
}

#[test]
fn the_preflight_is_in_the_session() {
    let lab = Lab::new();
    let session = lab.record("s", &[]);
    let shown = show(&session);
    let checks = shown["preflight"].as_array().unwrap();
    let verdict = |name: &str| {
        let check = checks.iter().find(|c| c["check"] == name);
        check.map_or(Value::Null, |c| c["verdict"].clone())
    };
    for name in [
        "recorder",
        "disk",
        "camera 1: clock",
        "camera 2: trigger loop-back",
    ] {
        assert_eq!(verdict(name), "passed", "{name}: {checks:?}");
    }
    assert!(checks.iter().all(|c| c["verdict"] != "failed"));
    let plain = skinrig(&["show", session.to_str().unwrap()]).code(0);
    assert!(
        plain.out.contains("camera 2: trigger loop-back"),
        "{plain:?}"
    );
}

#[test]
fn presses_that_touch_are_recorded_and_replayed() {
    let lab = Lab::new();
    let touch = [
        "press={surface: touch, threshold: 0.15 N, speed: 6 mm/s, band: 0.6 mm, tare: 100 ms}",
        "sync={count: 2, interval: 2.5 s, at: [10 mm, 2 mm], pause_after: 1 s}",
        "motion.period=2.5 s",
    ];
    let more: Vec<&str> = touch.iter().flat_map(|set| ["--set", set]).collect();
    let session = lab.record("s", &more);
    let presses = show(&session)["presses"].as_array().unwrap().clone();
    assert_eq!(presses.len(), 10);
    for press in &presses {
        assert_eq!(press["verdict"], "valid", "{press}");
        let touched = press["touched_mm"].as_f64().unwrap();
        assert!((-0.4..0.0).contains(&touched), "{press}");
        let depth = press["measured_depth_mm"].as_f64().unwrap();
        assert!((depth - 1.5).abs() < 0.05, "{press}");
    }
    assert_replays(&lab, &session, "r");
}

/// Jogs the simulated rig with these input lines, logging to `log`.
fn jog(lines: impl AsRef<[u8]>, log: &str) -> ProgramOutput {
    let mut child = program(&["jog", "--log", log])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The program may exit before reading all input.
    let _ = child.stdin.take().unwrap().write_all(lines.as_ref());
    let output = child.wait_with_output().unwrap();
    ProgramOutput {
        code: output.status.code(),
        out: String::from_utf8(output.stdout).unwrap(),
        err: String::from_utf8(output.stderr).unwrap(),
    }
}

#[test]
fn touched_points_become_the_frame_of_a_rig_file() {
    let lab = Lab::new();
    // The simulated skin is rotated by the angle of the 7-24-25 triangle; robot = R skin + (-6, -3, -15) mm.
    let robot = |x: f64, y: f64| (0.96 * x - 0.28 * y - 6.0, 0.28 * x + 0.96 * y - 3.0);
    let mut lines = "speed 40 mm/s\nwhere\n".to_owned();
    for (name, x, y) in [
        ("sw", -20.0, -30.0),
        ("se", 45.0, -25.0),
        ("ne", 45.0, 30.0),
        ("nw", -25.0, 35.0),
    ] {
        let (rx, ry) = robot(x, y);
        lines += &format!("to {rx} {ry} -8 mm\ntouch 10mm\npoint {name} at {x} {y} 0 mm\nz +5mm\n");
    }
    lines += "points\nquit\n";
    let log = lab.text("jog.log");
    let jog_output = jog(&lines, &log).code(0);
    let block = jog_output.out.split("frame:\n").nth(1).unwrap();
    let end = block
        .find("\n\n")
        .or_else(|| block.find("disarmed"))
        .unwrap_or(block.len());
    let emulated = std::fs::read_to_string(format!("{ROOT}/{EMULATED}")).unwrap();
    let (start, rest) = emulated.split_once("frame:\n").unwrap();
    let rest = rest.split_once("\n\n").unwrap().1;
    let text = format!("{start}frame:\n{}\n\n{rest}", &block[..end]);
    let rig = RigFile::parse("rig.yaml", text.as_bytes(), &|_| Some("/dev/null".into()))
        .unwrap_or_else(|e| panic!("{e}\n{text}"));
    let found = rig.frame.robot_from_skin;
    for (i, (r, t)) in [([0.96, -0.28], -6.0), ([0.28, 0.96], -3.0)]
        .into_iter()
        .enumerate()
    {
        assert!((found.rotation[i][0] - r[0]).abs() < 2e-3, "{found:?}");
        assert!((found.rotation[i][1] - r[1]).abs() < 2e-3, "{found:?}");
        assert!((found.translation_mm[i] - t).abs() < 0.1, "{found:?}");
    }
    // The touch is 0.33 mm late: threshold over stiffness of the skin.
    assert!((found.translation_mm[2] + 15.4).abs() < 0.15, "{found:?}");
    let log = std::fs::read_to_string(log).unwrap();
    for kind in [
        "start",
        "order\ttouch 10mm",
        "answer\ttouched at",
        "tip",
        "end\tdisarmed",
    ] {
        assert!(log.contains(&format!("\t{kind}")), "{kind}\n{log}");
    }
}

#[test]
fn a_wrong_line_of_a_file_ends_the_jog_with_the_robot_disarmed() {
    let lab = Lab::new();
    for (i, (line, words)) in [
        ("jump 3mm", "found `jump`"),
        ("x 3", "the bare number"),
        ("to 200 0 0 mm", "expected a target with x"),
        ("speed 500 mm/s", "expected at most"),
        ("point a", "`touch` first"),
        // Sideways after a touch: the tip is at most 2 mm up.
        (
            "touch 15mm\nz -1.5mm\nx +5mm",
            "expected lateral motion only at",
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let log = lab.text(&format!("{i}.log"));
        let jog_output = jog(format!("{line}\nz +1mm\n"), &log)
            .code(2)
            .expect_stderr(&[words]);
        assert!(jog_output.out.contains("disarmed at"), "{jog_output:?}");
        let log = std::fs::read_to_string(log).unwrap();
        assert!(
            log.contains("\trefused\t") && !log.contains("z +1mm"),
            "{log}"
        );
    }
    // A line that is no text is not the end of the input.
    jog(b"z +1mm\n\xff\nz +1mm\n", &lab.text("bytes.log"))
        .code(2)
        .expect_stderr(&["expected x, y, z"]);
}

#[test]
fn jog_stays_within_the_frame_depth_by_default() {
    let lab = Lab::new();
    // From z = -5 mm: the simulated skin is at -15 mm, and 6 mm of it may be pressed.
    let log = lab.text("within.log");
    jog("touch 16.5mm\n", &log)
        .code(2)
        .expect_stderr(&["at most 6 mm below the frame's surface", "--beyond-frame"]);
    let log = std::fs::read_to_string(log).unwrap();
    assert!(log.contains("\tlimit\t6 mm below"), "{log}");
    let log = lab.text("beyond.log");
    let mut child = program(&["jog", "--beyond-frame", "--log", &log])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    input.write_all(b"touch 16.5mm\n").unwrap();
    drop(input);
    let output = child.wait_with_output().unwrap();
    let out = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0), "{out}");
    assert!(
        out.contains("touched at") && out.contains("limit     --beyond-frame"),
        "{out}"
    );
    let log = std::fs::read_to_string(log).unwrap();
    assert!(log.contains("\tlimit\t--beyond-frame"), "{log}");
}

#[test]
fn the_logs_of_jogs_are_never_written_over() {
    let lab = Lab::new();
    let log = lab.text("jog.log");
    jog("where\n", &log).code(0);
    jog("where\n", &log)
        .code(1)
        .expect_stderr(&["jog.log", "--log"]);
}

#[test]
fn ctrl_c_holds_rises_and_disarms() {
    let lab = Lab::new();
    let mut child = program(&["jog", "--log", &lab.text("jog.log")])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    stdin.write_all(b"where\n").unwrap();
    // Wait until the log shows the order executed; an earlier signal would find no armed robot.
    let log = lab.path("jog.log");
    let began = std::time::Instant::now();
    while !std::fs::read_to_string(&log).is_ok_and(|t| t.contains("\tanswer\t")) {
        assert!(began.elapsed().as_secs() < 120, "no answer");
        std::thread::yield_now();
    }
    let killed = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(killed.success());
    let output = child.wait_with_output().unwrap();
    drop(stdin);
    let out = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(5), "{out}");
    assert!(out.contains("disarmed at"), "{out}");
    // From (3.0, 1.7, -5) mm up by 10 mm.
    let z: f64 = out
        .rsplit("disarmed at")
        .next()
        .unwrap()
        .split([',', ')'])
        .nth(2)
        .unwrap()
        .trim()
        .parse()
        .unwrap();
    assert!((z - 5.0).abs() < 0.2, "{out}");
}

#[test]
fn an_idle_jog_disarms() {
    let lab = Lab::new();
    let log = lab.text("jog.log");
    let mut child = program(&["jog", "--idle", "200 ms", "--log", &log])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Standard input stays open, like an abandoned terminal.
    let mut input = child.stdin.take().unwrap();
    input.write_all(b"where\n").unwrap();
    let mut jog_output = String::new();
    child
        .stdout
        .take()
        .unwrap()
        .read_to_string(&mut jog_output)
        .unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0), "{jog_output}");
    drop(input);
    for words in ["0.2 s without input", "no input for 0.2 s", "disarmed at"] {
        assert!(jog_output.contains(words), "{words}: {jog_output}");
    }
    let logged = std::fs::read_to_string(&log).unwrap();
    assert!(
        logged.contains("idle") && logged.contains("disarmed at"),
        "{logged}"
    );
}
