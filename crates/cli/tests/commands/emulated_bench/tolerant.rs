//! A camera with unexpected behaviour, end to end on the emulated bench: rejected, tolerated once and reported, then accepted by the
//! proposed rig file lines. Whether a healthy camera behaves like this is unknown.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;
use skinrig_emulated_bench::{CAMERA_SERIALS, DeviceCommand, EmulatedBench};
use skinrig_model::{PressOutcome, PressVerdict, Setting};
use skinrig_recorder::SessionReader;

use super::{all_output, in_real_time, only_file, start, workspace_root};

const SKINRIG: &str = env!("CARGO_BIN_EXE_skinrig");
/// The register of `bias_diff_on`.
const BIAS: u32 = 0x0350;

/// Rig file of the emulated bench with a bias that camera 2 rejects, and `more` lines for that camera.
fn rig(folder: &Path, more: &str) -> PathBuf {
    let text = fs::read_to_string(workspace_root().join("hil/rigs/emulated.yaml")).unwrap();
    let serial = format!("    serial: \"{}\"\n", CAMERA_SERIALS[1]);
    let text = text.replace(
        &serial,
        &format!("{serial}    biases: {{bias_diff_on: 400}}\n{more}"),
    );
    let path = folder.join("first.yaml");
    fs::write(&path, text).unwrap();
    path
}

/// The quick check with one press.
fn protocol(folder: &Path) -> PathBuf {
    let text = fs::read_to_string(workspace_root().join("protocols/quick-check.yaml")).unwrap();
    let is_compared =
        |line: &&str| !line.trim_start().starts_with("- [") || line.contains("the centre");
    let text: Vec<&str> = text.lines().filter(is_compared).collect();
    let path = folder.join("one-press.yaml");
    fs::write(&path, text.join("\n")).unwrap();
    path
}

fn skinrig(bench: &EmulatedBench, arguments: &[&str]) -> Output {
    let mut command = bench.command(SKINRIG).unwrap();
    command.current_dir(workspace_root()).args(arguments);
    command.output().unwrap()
}

/// True once a press of the session being recorded in `sessions` has an outcome.
fn has_an_outcome(sessions: &Path) -> bool {
    let files = fs::read_dir(sessions).into_iter().flatten().flatten();
    let named = files.map(|file| file.path());
    let mut session = named.filter(|path| path.to_string_lossy().ends_with(".session.sqlite"));
    let outcomes = session
        .next()
        .and_then(|path| SessionReader::open(path).ok()?.last_outcomes().ok());
    outcomes.is_some_and(|outcomes| outcomes.iter().any(Option::is_some))
}

#[test]
fn what_was_let_pass_once_is_accepted_by_the_lines_that_were_proposed() {
    in_real_time(tolerate_then_accept);
}

fn tolerate_then_accept() {
    let Some(bench) = start() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let order = |order: DeviceCommand| {
        bench
            .bus()
            .remote()
            .unwrap()
            .order(CAMERA_SERIALS[1], order)
            .unwrap();
    };
    let misbehave = || {
        order(DeviceCommand::FailReads(true));
        order(DeviceCommand::FailResets(true));
        order(DeviceCommand::IgnoreWrites(BIAS));
    };
    misbehave();
    let (one_press, strict) = (protocol(folder), rig(folder, ""));
    let run = |rig: &Path, name: &str, more: &[&str]| {
        let sessions = folder.join(name);
        let mut arguments = vec!["run", one_press.to_str().unwrap(), "--no-analysis"];
        arguments.extend(["--rig", rig.to_str().unwrap()]);
        arguments.extend(["--sessions", sessions.to_str().unwrap()]);
        arguments.extend(more);
        (skinrig(&bench, &arguments), sessions)
    };

    // Default: rejected before any motion, with the next step.
    let (refused, _) = run(&strict, "refused", &[]);
    assert_eq!(refused.status.code(), Some(3), "{}", all_output(&refused));
    assert!(
        all_output(&refused).contains("--tolerant"),
        "{}",
        all_output(&refused)
    );

    // Tolerated once; a transfer fails during the run.
    order(DeviceCommand::BreakTransfer(60));
    let (tolerant, sessions) = run(&strict, "tolerant", &["--tolerant"]);
    let printed = all_output(&tolerant);
    assert!(tolerant.status.success(), "{printed}");
    let (_, proposed) = printed
        .split_once("cameras:\n  camera2:\n")
        .unwrap_or_else(|| panic!("{printed}"));
    let lines: String = proposed
        .lines()
        .take_while(|l| l.starts_with("    "))
        .map(|l| format!("{l}\n"))
        .collect();
    // No snapshot: this may be an attempt of several.
    let expected = [
        "    read_status: [\"0x00\"]\n",
        "    read_back_exceptions: [\"0x0350\"]\n",
        "    failed_reset: accepted\n",
        "    failed_transfers: loss\n",
    ];
    assert_eq!(lines, expected.concat());

    // The session states it in its header, with the device, in a note and in the preflight.
    let session = only_file(&sessions, ".session.sqlite");
    let reader = SessionReader::open(&session).unwrap();
    let name = reader.header().unwrap().rig_name;
    assert!(name.ends_with("mismatches tolerated"), "{name}");
    let devices = reader.devices().unwrap();
    let settings = devices.iter().flat_map(|d| &d.settings);
    let let_pass: Vec<&str> = settings
        .filter(|s| s.requested == Setting::TOLERATED)
        .map(|s| s.name.as_str())
        .collect();
    assert_eq!(let_pass.len(), 3, "{let_pass:?}");
    let notes = reader.notes().unwrap();
    let noted = |words: &str| notes.iter().any(|n| n.text.contains(words));
    assert!(noted("failed_transfers: loss"), "{notes:?}");
    let checks = reader.preflight().unwrap();
    assert!(checks.iter().any(|c| c.check == "mismatches"), "{checks:?}");
    drop(reader);
    let shown = skinrig(&bench, &["show", session.to_str().unwrap()]);
    assert!(
        all_output(&shown).contains("mismatches tolerated"),
        "{}",
        all_output(&shown)
    );

    // A further leg needs its own `--tolerant`: without it resuming is rejected, with it the open presses are taken.
    let sessions = folder.join("killed");
    let mut command = bench.command(SKINRIG).unwrap();
    command
        .current_dir(workspace_root())
        .args(["run", "--tolerant", "--no-analysis"]);
    command.args([one_press.as_os_str(), "--rig".as_ref(), strict.as_os_str()]);
    let mut killed = command.arg("--sessions").arg(&sessions).spawn().unwrap();
    while !has_an_outcome(&sessions) {
        assert!(killed.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::yield_now();
    }
    killed.kill().unwrap();
    killed.wait().unwrap();
    // It goes on streaming with nobody reading and cannot be reset: on a slow computer its overflow counter fills, so reconnect it.
    order(DeviceCommand::Unplug);
    order(DeviceCommand::Plug);
    misbehave();
    let session = only_file(&sessions, ".session.sqlite");
    let resume = |more: &[&str]| {
        let mut arguments = vec!["resume", session.to_str().unwrap(), "--no-analysis"];
        arguments.extend(more);
        skinrig(&bench, &arguments)
    };
    let refused = resume(&[]);
    assert_eq!(refused.status.code(), Some(3), "{}", all_output(&refused));
    assert!(
        all_output(&refused).contains("--tolerant"),
        "{}",
        all_output(&refused)
    );
    let resumed = resume(&["--tolerant"]);
    assert!(resumed.status.success(), "{}", all_output(&resumed));
    let verified = skinrig(&bench, &["verify", session.to_str().unwrap()]);
    assert!(verified.status.success(), "{}", all_output(&verified));
    let outcomes = SessionReader::open(&session)
        .unwrap()
        .last_outcomes()
        .unwrap();
    let valid =
        |o: &Option<PressOutcome>| o.as_ref().is_some_and(|o| o.verdict == PressVerdict::Valid);
    assert!(outcomes.iter().all(valid), "{outcomes:?}");

    // In a night every check opens the cameras; `settings` counts accepted mismatches as differences, so the night is never good.
    let nights = folder.join("nights");
    let mut arguments = vec![
        "hil",
        "run",
        "--json",
        "hil/nightly.yaml",
        "--only",
        "settings",
    ];
    arguments.extend(["--rig", strict.to_str().unwrap()]);
    arguments.extend(["--out", nights.to_str().unwrap(), "--tolerant"]);
    let night = skinrig(&bench, &arguments);
    let result: Value = serde_json::from_slice(&night.stdout).unwrap_or_default();
    let checks = result["checks"].as_array().cloned().unwrap_or_default();
    let settings = checks.iter().find(|c| c["name"] == "settings").unwrap();
    assert_eq!(settings["verdict"], "INVALID", "{settings:#}");
    assert_eq!(settings["cause"], "rig", "{settings:#}");
    let camera2 = &settings["attempts"][0]["parts"][1]["measurements"][0];
    assert_eq!(camera2["value"], 3.0, "{settings:#}");
    assert_ne!(night.status.code(), Some(0), "{}", all_output(&night));

    // With the lines in the rig file: opened without a warning, failing transfers included.
    let accepting = rig(folder, &lines);
    order(DeviceCommand::BreakTransfer(60));
    let (accepted, sessions) = run(&accepting, "accepted", &[]);
    let printed = all_output(&accepted);
    assert!(accepted.status.success(), "{printed}");
    assert!(
        !printed.contains("tolerated") && !printed.contains("--tolerant"),
        "{printed}"
    );
    let reader = SessionReader::open(only_file(&sessions, ".session.sqlite")).unwrap();
    let name = reader.header().unwrap().rig_name;
    assert!(!name.contains("tolerated"), "{name}");
}
