//! Rig files: the shipped ones, their schema, their frame, and diagnostics.

use std::path::{Path, PathBuf};

use proptest::prelude::*;
use skinrig_protocol::rig::{RigFile, RigKind, SyncRole};
use skinrig_protocol::{Diagnostics, Protocol, Surface, rig_schema_json};

use crate::common::no_file;
use crate::validate::validate;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../hil/rigs")
}

fn shipped(name: &str) -> String {
    std::fs::read_to_string(folder().join(name)).unwrap()
}

fn parse(text: &str) -> Result<RigFile, Diagnostics> {
    RigFile::parse("bench/rig.yaml", text.as_bytes(), &|name| {
        (name.starts_with("SKINRIG_EMULATED")).then(|| format!("/run/{}", name.to_lowercase()))
    })
}

fn example() -> String {
    shipped("bench.example.yaml")
}

#[test]
fn the_shipped_files_parse_to_their_values() {
    let rig = parse(&example()).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(rig.kind, RigKind::Bench);
    assert_eq!(rig.robot.watchdog_steps, 80);
    assert_eq!(rig.robot.effector_mass_kg, Some(0.14));
    assert_eq!(rig.tip.size_mm, 10.0);
    assert_eq!(rig.cameras[1].sync, SyncRole::Standalone);
    assert_eq!(rig.cameras[0].noise_filter_ev_s, Some(10_000));
    assert_eq!(
        rig.cameras[0].bias_file.as_deref(),
        Some(Path::new("bench/camera1.bias"))
    );
    let touched = rig.frame.touch_off.as_ref().unwrap();
    assert!(
        touched.rms_mm > 0.0 && touched.worst_mm < 0.05,
        "{touched:?}"
    );
    let Some(Surface::Touch(search)) = rig.surface else {
        panic!("{:?}", rig.surface)
    };
    assert_eq!((search.threshold_n, search.samples), (0.2, 5));

    let emulated = parse(&shipped("emulated.yaml")).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(emulated.kind.name(), "emulated");
    assert_eq!(
        emulated.robot.library.as_deref(),
        Some(Path::new("/run/skinrig_emulated_libdrd"))
    );
    assert_eq!(emulated.surface, None);
    for name in std::fs::read_dir(folder()).unwrap() {
        let name = name.unwrap().file_name().into_string().unwrap();
        if name.ends_with(".yaml") {
            let text = shipped(&name);
            let first = "# yaml-language-server: $schema=./skinrig-rig.schema.json\n";
            assert!(text.starts_with(first), "{name}");
            parse(&text).unwrap_or_else(|e| panic!("{name}\n{e}"));
        }
    }
}

#[test]
fn the_example_shows_every_key() {
    let schema: serde_json::Value = serde_json::from_str(&rig_schema_json()).unwrap();
    let text = example();
    let mut missing = Vec::new();
    let tables = schema["$defs"].as_object().unwrap().values();
    for table in tables.chain([&schema]) {
        for key in table["properties"].as_object().unwrap().keys() {
            if !text.contains(&format!("{key}:")) && key != "diameter" {
                missing.push(key.clone());
            }
        }
    }
    assert_eq!(missing, Vec::<String>::new());
}

#[test]
fn the_schema_on_disk_is_current_and_accepts_what_ships() {
    let advice = "run `cargo run -p skinrig-protocol --example write_schema`";
    assert_eq!(
        shipped("skinrig-rig.schema.json"),
        rig_schema_json(),
        "{advice}"
    );
    let schema = serde_json::from_str(&rig_schema_json()).unwrap();
    for name in ["bench.example.yaml", "emulated.yaml"] {
        let value: serde_json::Value = {
            let options = serde_yaml::options! { strict_booleans: true };
            serde_yaml::from_str_with_options(&shipped(name), options).unwrap()
        };
        validate(&schema, &value, &schema, name).unwrap();
    }
}

#[test]
fn all_findings_of_a_file_at_once() {
    let text = include_str!("inputs/wrong-rig.yaml");
    let error = RigFile::parse("wrong-rig.yaml", text.as_bytes(), &|_| None).unwrap_err();
    insta::assert_snapshot!("wrong-rig", error.render(false));
}

/// Checks the diagnostic of the example with one text replaced.
fn finding(from: &str, to: &str, path: &str, message: &str, rest: &str) {
    let text = example();
    assert_eq!(text.matches(from).count(), 1, "{from}");
    let error = parse(&text.replacen(from, to, 1)).expect_err(to);
    let found: Vec<_> = error
        .list()
        .iter()
        .filter(|d| d.path == path && d.message == message)
        .collect();
    assert_eq!(found.len(), 1, "{to}\n{error}");
    assert_eq!(error.list().len(), 1, "more than one finding\n{error}");
    assert!(
        error.to_string().contains(rest),
        "{rest} is missing\n{error}"
    );
}

#[test]
fn a_camera_without_trigger_input_stands_alone() {
    let all = example();
    let (before, rest) = all.split_once("\ntrigger_box:").unwrap();
    let without_box = format!("{before}\n{}", &rest[rest.find("\npreflight:").unwrap()..]);
    let second = "serial: \"00001754\"";
    let other = without_box.replace(second, &format!("{second}\n    model: evk3_hd"));
    let rig = parse(&other).unwrap_or_else(|e| panic!("{e}"));
    let triggers = rig.cameras.each_ref().map(|c| c.has_trigger());
    assert_eq!(triggers, [true, false]);
    let shared = other
        .replace("sync: standalone", "sync: slave")
        .replace("model: evk3_hd", "model: evk3_hd\n    sync: master");
    let error = parse(&shared).unwrap_err();
    let [only] = error.list() else {
        panic!("{error}")
    };
    assert_eq!(only.message, "the camera's driver shares no time base");
    assert_eq!(only.path, "cameras.camera2.sync");
}

#[test]
fn invalid_values_are_reported() {
    let south_east = "skin: [50 mm, -35 mm, 0 mm], robot: [44.010 mm, -48.020 mm, -20.010 mm]";
    finding(
        south_east,
        "skin: [50 mm, -35 mm, 0 mm], robot: [47 mm, -48 mm, -20 mm]",
        "frame.touch_off.points",
        "the points do not fit a rigid motion",
        "`south-east`",
    );
    finding(
        "date: 2026-11-20\n    max",
        "date: 2026-02-30\n    max",
        "frame.touch_off.date",
        "not a date",
        "2026-11-20",
    );
    finding(
        "side: 10 mm",
        "diameter: 10 mm",
        "tip.diameter",
        "the size does not fit the shape",
        "`side` for a cube",
    );
    finding(
        "auto_init: false ",
        "auto_init: true ",
        "robot.auto_init",
        "the arm could hit the sample",
        "sample_is_off: true",
    );
    finding(
        "watchdog: 10 ms",
        "watchdog: 10.05 ms",
        "robot.watchdog",
        "between two steps of the watchdog",
        "10000 us",
    );
    finding(
        "watchdog: 10 ms",
        "watchdog: 32 ms",
        "robot.watchdog",
        "the value is out of range",
        "0.031875",
    );
    finding(
        "axes: [+x, +y, +z]",
        "axes: [+y, +x, +z]",
        "robot.axes",
        "the axes are not right-handed",
        "z = x cross y",
    );
    finding(
        "gravity_ratio: 0",
        "gravity_ratio: 0.4",
        "robot.motor_force",
        "the force limit cannot be set",
        "7.200 N",
    );
    finding(
        "max_force: 8 N",
        "max_force: 0.5 N",
        "robot.motor_force",
        "the force limit cannot be set",
        "the arm sinks",
    );
    finding(
        "serial: \"00001754\"",
        "serial: \"00001753\"",
        "cameras.camera2.serial",
        "both cameras are the same",
        "twice",
    );
    finding(
        "sync: standalone",
        "sync: master",
        "cameras.camera2.sync",
        "the sync modes do not fit",
        "master and standalone",
    );
    finding(
        "trigger_channel: 0",
        "trigger_channel: 3",
        "cameras.camera1.trigger_channel",
        "the EVK1 has no such trigger input",
        "loop-back",
    );
    finding(
        "trigger_channel: 0",
        "trigger_channel: 7",
        "cameras.camera2.trigger_channel",
        "the trigger channels differ",
        "7 and 0",
    );
    finding(
        "trigger_delay: 0 us",
        "trigger_delay: 2.5 us",
        "cameras.camera1.trigger_delay",
        "not a whole number of its unit",
        "2.5 us",
    );
    finding(
        "serial: \"00001754\"",
        "serial: \"00001754\"\n    model: evk4\n    max_time_high_gap: 1 ms",
        "cameras.camera2.max_time_high_gap",
        "this camera's time base is not monitored",
        "`model: evk4`",
    );
    finding(
        "serial: \"00001754\"",
        "serial: \"00001754\"\n    model: silky_vga",
        "trigger_box",
        "a camera has no input for the trigger box",
        "`model: silky_vga`",
    );
    finding(
        "read_back_exceptions: []",
        "read_back_exceptions: [0x02G4]",
        "cameras.camera1.read_back_exceptions[0]",
        "not an address",
        "`0x0204`",
    );
    finding(
        "output2: camera2",
        "output2: camera1",
        "trigger_box.wiring",
        "a camera needs exactly one trigger line",
        "exactly one output",
    );
    finding(
        "max: [60 mm, 60 mm, 30 mm]",
        "max: [40 mm, 60 mm, 30 mm]",
        "limits.workspace",
        "the skin lies outside the workspace",
        "south-east",
    );
    finding(
        "library: /opt",
        "library: ${HOME_OF_DRD}/opt",
        "robot.library",
        "the environment variable is not set",
        "export HOME_OF_DRD",
    );
}

#[test]
fn touched_points_must_span_the_skin_and_not_its_mirror_image() {
    let three = |rows: [&str; 3]| {
        let text = example();
        let start = text.find("      - {name: south-west").unwrap();
        let end = text.find("  # given:").unwrap();
        let rows: String = rows.iter().map(|r| format!("      - {{{r}}}\n")).collect();
        parse(&format!("{}{rows}{}", &text[..start], &text[end..]))
    };
    let line = three([
        "skin: [0 mm, 0 mm, 0 mm], robot: [0 mm, 0 mm, -20 mm]",
        "skin: [20 mm, 1 mm, 0 mm], robot: [20 mm, 1 mm, -20 mm]",
        "skin: [40 mm, 0 mm, 0 mm], robot: [40 mm, 0 mm, -20 mm]",
    ])
    .unwrap_err();
    assert_eq!(
        line.list()[0].message,
        "the points lie on one line, or nearly"
    );
    // x and y swapped in the skin's column: a rigid motion fits, but turns the skin upside down.
    let mirrored = three([
        "skin: [0 mm, 0 mm, 0 mm], robot: [0 mm, 0 mm, -20 mm]",
        "skin: [0 mm, 40 mm, 0 mm], robot: [40 mm, 0 mm, -20 mm]",
        "skin: [30 mm, 0 mm, 0 mm], robot: [0 mm, 30 mm, -20 mm]",
    ])
    .unwrap_err();
    assert_eq!(mirrored.list()[0].message, "the skin does not face up");
    let right = three([
        "skin: [0 mm, 0 mm, 0 mm], robot: [5 mm, 0 mm, -20 mm]",
        "skin: [40 mm, 0 mm, 0 mm], robot: [45 mm, 0 mm, -20 mm]",
        "skin: [0 mm, 30 mm, 0 mm], robot: [5 mm, 30 mm, -20 mm]",
    ])
    .unwrap();
    let frame = right.frame;
    let t = frame.robot_from_skin.translation_mm;
    assert!(
        (t[0] - 5.0).abs() < 1e-9 && (t[2] + 20.0).abs() < 1e-9,
        "{t:?}"
    );
    assert!(frame.touch_off.unwrap().worst_mm < 1e-9);
}

#[test]
fn languages_are_distinguished() {
    let error = Protocol::parse("rig.yaml", example().as_bytes(), &[], &no_file).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("a rig file, which belongs to `--rig`"),
        "{error}"
    );
    let error = parse(&crate::common::shipped("demo.yaml")).unwrap_err();
    assert_eq!(error.list()[0].message, "this is not a rig");
    assert_eq!(error.list()[0].found.as_deref(), Some("a protocol"));
    let error = parse("").unwrap_err();
    assert!(error.to_string().contains("skinrig_rig: 1"), "{error}");
}

proptest! {
    #[test]
    fn a_damaged_file_is_an_error_or_a_rig_and_never_a_panic(
        at in 0.0f64..1.0, length in 0usize..40, junk in "[ -~\n]{0,12}",
    ) {
        let text = example();
        let start = (at * text.len() as f64) as usize;
        let end = (start + length).min(text.len());
        let damaged = format!("{}{junk}{}", &text[..start], &text[end..]);
        if let Err(e) = parse(&damaged) {
            prop_assert!(!e.list().is_empty());
        }
    }
}
