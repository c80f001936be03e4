//! Invalid files are rejected by name and row, and leave no session that claims to be complete.

use std::path::Path;

use crate::dataset::{Dataset, csv, events, positions};
use crate::support::{Lab, ProgramOutput, files, only, show, skinrig, text};
use skinrig_model::CameraId;

/// Runs the import; asserts exit code, all `parts` on standard error, and no completed session.
#[track_caller]
fn assert_refused(lab: &Lab, data: &Dataset, code: i32, parts: &[&str]) -> ProgramOutput {
    let folder = lab.path("s");
    let output = skinrig(&data.arguments(&folder))
        .code(code)
        .expect_stderr(parts);
    for session in files(&folder, ".session.sqlite") {
        assert_ne!(show(&session)["end"], "completed", "{output:?}");
    }
    output
}

/// Replaces the only occurrence of `old` in a file by the same number of bytes.
#[track_caller]
fn patch(path: &Path, old: &[u8], new: &[u8]) {
    let mut bytes = std::fs::read(path).unwrap();
    let places: Vec<usize> = (0..=bytes.len() - old.len())
        .filter(|k| bytes[*k..].starts_with(old))
        .collect();
    assert_eq!(
        places.len(),
        1,
        "expected one place to patch in {}",
        path.display()
    );
    bytes[places[0]..places[0] + old.len()].copy_from_slice(new);
    std::fs::write(path, bytes).unwrap();
}

/// Stored time in row `row` of camera 2's file.
fn stored_time(row: usize) -> [u8; 8] {
    (events(CameraId::Two)[row].t_us as f64 / 1e6).to_le_bytes()
}

#[test]
fn files_of_another_kind() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    let text_file = Dataset {
        cameras: [data.presses.clone(), data.cameras[1].clone()],
        ..Dataset::new(&Lab::new())
    };
    let text_file = Dataset {
        presses: data.presses.clone(),
        schedule: data.schedule.clone(),
        ..text_file
    };
    assert_refused(
        &lab,
        &text_file,
        2,
        &["presses.csv", "expected bimvee HDF5 or Prophesee RAW"],
    );
    let absent = Dataset {
        cameras: [lab.path("none.hdf5"), data.cameras[1].clone()],
        presses: data.presses.clone(),
        schedule: data.schedule.clone(),
    };
    assert_refused(&lab, &absent, 2, &["none.hdf5"]);
    assert!(
        files(&lab.path("s"), ".sqlite").is_empty(),
        "nothing was to be made"
    );
}

#[test]
fn columns_that_are_not_used_are_named() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    let import = |name: &str, header: &str, z: &dyn Fn(usize) -> &'static str| {
        let rows = positions().into_iter().enumerate();
        let rows = rows.map(|(i, p)| format!("{},{},{}\n", p.x_mm / 1e3, p.y_mm / 1e3, z(i)));
        let table = header.to_owned() + &rows.collect::<String>();
        std::fs::write(&data.presses, table).unwrap();
        skinrig(&data.arguments(&lab.path(name))).code(0).err
    };
    let told = import("depths", "x,y,z,force\n", &|i| {
        if i == 3 { "-0.003,1" } else { "-0.002,1" }
    });
    for part in [
        "z from -3.000 to -2.000 mm is not used: every press is taken as 2 mm deep",
        "not used: column(s) force",
    ] {
        assert!(told.contains(part), "{part}\n{told}");
    }
    for z in ["-0.002", "0"] {
        let told = import(z, "x,y,z\n", &|_| z);
        assert!(!told.contains("not used"), "{told}");
    }
}

#[test]
fn a_truncated_container() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    let bytes = std::fs::read(&data.cameras[0]).unwrap();
    for share in [1, 40, 70, 99] {
        std::fs::write(&data.cameras[0], &bytes[..bytes.len() * share / 100]).unwrap();
        let output = skinrig(&data.arguments(&lab.path("s"))).expect_stderr(&["camera1.hdf5"]);
        assert!(output.code == Some(2), "{share} %: {output:?}");
    }
    for session in files(&lab.path("s"), ".session.sqlite") {
        assert_ne!(show(&session)["end"], "completed");
    }
}

#[test]
fn a_missing_dataset() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    patch(&data.cameras[0], b"\"pol\"", b"\"pal\"");
    assert_refused(&lab, &data, 2, &["camera1.hdf5", "pol"]);
    assert!(
        files(&lab.path("s"), ".sqlite").is_empty(),
        "nothing was to be made"
    );
}

#[test]
fn nan_times_and_times_that_go_back_are_rejected() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    patch(
        &data.cameras[1],
        &stored_time(9_000),
        &f64::NAN.to_le_bytes(),
    );
    assert_refused(&lab, &data, 2, &["camera2.hdf5", "ts", "row 9000", "NaN"]);

    let lab = Lab::new();
    let data = Dataset::new(&lab);
    patch(
        &data.cameras[1],
        &stored_time(9_000),
        &1.0_f64.to_le_bytes(),
    );
    let output = assert_refused(&lab, &data, 2, &["camera2.hdf5", "ts", "row 9000"]);
    assert!(
        output.err.contains("kept"),
        "says that a part is kept: {output:?}"
    );
    leads_with_damage(&output.out);
    // The events before are kept and reported as partial.
    let sessions = files(&lab.path("s"), ".session.sqlite");
    assert_eq!(sessions.len(), 1);
    let shown = show(&sessions[0]);
    assert_eq!(shown["end"], "faulted");
    assert!(shown["end_reason"].as_str().unwrap().contains("row 9000"));
    skinrig(&["verify", &text(&sessions[0])]).code(0);
}

#[test]
fn a_recording_that_goes_on_for_days_is_not_read_to_its_end() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    let last = events(CameraId::Two).len() - 1;
    patch(&data.cameras[1], &stored_time(last), &1e6_f64.to_le_bytes());
    // All presses are there, but the file is not read to its end.
    let output = skinrig(&data.arguments(&lab.path("s"))).code(2);
    for part in ["camera2.hdf5", "goes on", "unit of the format", "kept"] {
        assert!(output.err.contains(part), "{part}: {output:?}");
    }
    leads_with_damage(&output.out);
}

/// The answer of a damaged file must not lead with numbers.
fn leads_with_damage(out: &str) {
    let at = |text: &str| out.find(text).unwrap_or_else(|| panic!("{text}: {out}"));
    assert!(at("DAMAGED") < at("presses  "), "{out}");
    assert!(
        out.find("RMSE").is_none_or(|rmse| at("DAMAGED") < rmse),
        "{out}"
    );
}

#[test]
fn positions_that_do_not_fit() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    let write = |content: &str| std::fs::write(&data.presses, content).unwrap();
    write(&csv(&positions()[1..]));
    assert_refused(&lab, &data, 2, &["expected 12 press positions", "found 11"]);
    write(&csv(&positions()).replacen("0.0\n", "0.0,7,8,9\n", 1));
    assert_refused(&lab, &data, 2, &["presses.csv:2"]);
    write(&csv(&positions()).replacen("-0.01,", "left,", 1));
    assert_refused(&lab, &data, 2, &["presses.csv:2", "left"]);
    write(&csv(&positions()).replacen("-0.01,", "nan,", 1));
    assert_refused(&lab, &data, 2, &["presses.csv:2", "nan"]);
    write(&csv(&positions()).replacen("x,y", "a,b", 1));
    assert_refused(&lab, &data, 2, &["presses.csv", "`x`"]);
    write("");
    assert_refused(&lab, &data, 2, &["presses.csv"]);
    assert!(
        files(&lab.path("s"), ".sqlite").is_empty(),
        "nothing was to be made"
    );
}

#[test]
fn schedules_that_do_not_hold() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    let good = std::fs::read_to_string(&data.schedule).unwrap();
    for (old, new, parts) in [
        ("period: 1.5 s", "period: 1.5", vec![":6:9", "period"]),
        (
            "period: 1.5 s",
            "periode: 1.5 s",
            vec!["did you mean `period`"],
        ),
        ("depth: 2 mm", "depth: -2 mm", vec![":8:8", "depth"]),
        (
            "skip_blank_rows: true",
            "skip_blank_rows: false",
            vec!["14", "blank"],
        ),
        (
            "at_depth: -100 ms",
            "at_depth: 100 ms",
            vec!["phases.retract"],
        ),
        ("skinrig_schedule: 1", "skinrig_schedule: 9", vec![":1:19"]),
    ] {
        std::fs::write(&data.schedule, good.replacen(old, new, 1)).unwrap();
        assert_refused(&lab, &data, 2, &parts);
    }
    std::fs::write(&data.schedule, "skinrig_schedule: [1").unwrap();
    assert_refused(&lab, &data, 2, &["made.schedule.yaml:1:"]);
    std::fs::write(&data.schedule, &good).unwrap();
    let mut arguments = data.arguments(&lab.path("s"));
    arguments.extend(["--set".into(), "sync.intervall=2 s".into()]);
    skinrig(&arguments)
        .code(2)
        .expect_stderr(&["did you mean `interval`"]);
    arguments.truncate(arguments.len() - 2);
    arguments.extend(["--stream1".into(), "data/left".into()]);
    skinrig(&arguments)
        .code(2)
        .expect_stderr(&["camera1.hdf5", "data/left"]);
    assert!(
        files(&lab.path("s"), ".sqlite").is_empty(),
        "nothing was to be made"
    );
}

#[test]
fn one_file_for_both_cameras() {
    let lab = Lab::new();
    let mut data = Dataset::new(&lab);
    data.cameras[1] = data.cameras[0].clone();
    assert_refused(
        &lab,
        &data,
        2,
        &["camera1.hdf5", "the same one for both", "--stream1"],
    );
    assert!(
        files(&lab.path("s"), ".sqlite").is_empty(),
        "nothing was to be made"
    );
}

#[test]
fn raw_files_of_another_format_than_their_header_says() {
    let lab = Lab::new();
    let mut data = Dataset::new(&lab);
    skinrig(&data.arguments(&lab.path("t"))).code(0);
    let session = text(&only(&lab.path("t"), ".session.sqlite"));
    skinrig(&["export", &session, "--to", "raw", "--out", &lab.text("e")]).code(0);
    let raw = only(&lab.path("e"), ".camera2.raw");
    let bytes = std::fs::read(&raw).unwrap();
    let body = bytes.windows(6).position(|w| w == b"% end\n").unwrap() + 6;
    let mut of_another = b"% evt 2.1\n% geometry 640x480\n% end\n".to_vec();
    of_another.extend(&bytes[body..bytes.len() - (bytes.len() - body) % 8]);
    std::fs::write(&raw, &of_another).unwrap();
    data.cameras[1] = raw;
    assert_refused(
        &lab,
        &data,
        2,
        &[
            ".camera2.raw",
            "expected words of evt21, as its header says",
        ],
    );
}

#[test]
fn raw_files_of_a_sensor_of_another_size() {
    let lab = Lab::new();
    let mut data = Dataset::new(&lab);
    let mut arguments = data.arguments(&lab.path("t"));
    arguments.push("--no-analysis".into());
    skinrig(&arguments).code(0);
    let session = text(&only(&lab.path("t"), ".session.sqlite"));
    skinrig(&["export", &session, "--to", "raw", "--out", &lab.text("e")]).code(0);
    let raw = only(&lab.path("e"), ".camera2.raw");
    patch(&raw, b"height=480;width=640", b"height=240;width=320");
    patch(&raw, b"% geometry 640x480", b"% geometry 320x240");
    data.cameras[1] = raw;
    let found = "expected a recording of 640 x 480 pixels, found 320 x 240 in its header";
    assert_refused(&lab, &data, 2, &[".camera2.raw", found, "next:"]);
}

#[test]
fn raw_files_that_are_cut_off_or_empty() {
    let lab = Lab::new();
    let mut data = Dataset::new(&lab);
    let mut arguments = data.arguments(&lab.path("whole"));
    arguments.push("--no-analysis".into());
    skinrig(&arguments).code(0);
    let session = text(&only(&lab.path("whole"), ".session.sqlite"));
    skinrig(&["export", &session, "--to", "raw", "--out", &lab.text("e")]).code(0);
    let raw = only(&lab.path("e"), ".camera2.raw");
    let bytes = std::fs::read(&raw).unwrap();
    data.cameras[1] = raw.clone();
    let mut named = data.arguments(&lab.path("s"));
    named.extend(["--stream2".into(), "data/left".into()]);
    skinrig(&named)
        .code(2)
        .expect_stderr(&[".camera2.raw", "`data/left`", "leave out --stream2"]);
    std::fs::write(&raw, &bytes[..bytes.len() - 3]).unwrap();
    assert_refused(
        &lab,
        &data,
        2,
        &[".camera2.raw", "found 1 bytes after the last one"],
    );
    let body = bytes.windows(6).position(|w| w == b"% end\n").unwrap() + 6;
    std::fs::write(&raw, &bytes[..body]).unwrap();
    assert_refused(
        &lab,
        &data,
        2,
        &[".camera2.raw", "found nothing after the header"],
    );
}
