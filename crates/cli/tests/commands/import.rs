//! Recordings made without skinrig become sessions.

use std::path::Path;

use skinrig_formats::Decoder;
use skinrig_formats::hdf5::EventWriter;
use skinrig_model::{CameraId, CdEvent, Point2, PressVerdict, StreamFormat};
use skinrig_recorder::SessionReader;

use crate::dataset::{DRIFT_PPM, Dataset, OFFSET_US, PRESSES, csv, events, positions};
use crate::replay::assert_replays;
/// Tolerance of aligned times, µs: event rates have bins of 10 ms.
const WITHIN_US: f64 = 25_000.0;

use crate::support::{Lab, ROOT, chunks, only, read_json, show, skinrig, text};

#[test]
fn a_dataset_is_imported_its_clocks_aligned_and_its_presses_located() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    let output = skinrig(&data.arguments(&lab.path("s"))).code(0);
    assert!(output.err.contains("blank line(s) [14]"), "{output:?}");

    let session = only(&lab.path("s"), ".session.sqlite");
    let results = read_json(&only(&lab.path("s"), ".results.json"));
    let analysis = &results["analysis"];
    // In the middle of the recording errors of offset and drift cannot cancel.
    let middle_us = 12e6;
    for (k, clock) in analysis["clocks"].as_array().unwrap().iter().enumerate() {
        assert_eq!(clock["method"], "event_rates");
        let at = |offset: f64, drift: f64| offset + middle_us * drift * 1e-6;
        let found = at(
            clock["offset_us"].as_f64().unwrap(),
            clock["drift_ppm"].as_f64().unwrap(),
        );
        let planted = at(OFFSET_US[k], DRIFT_PPM[k]);
        assert!(
            (found - planted).abs() < WITHIN_US,
            "clock {}: {found} {planted} µs",
            k + 1
        );
    }
    assert_eq!(analysis["counts"]["planned"], PRESSES);
    assert_eq!(analysis["counts"]["valid"], PRESSES);
    let presses = analysis["presses"].as_array().unwrap();
    let located: Vec<_> = presses
        .iter()
        .filter(|p| p["role"] == "score")
        .map(|p| &p["location_outcome"])
        .collect();
    for (outcome, at) in located.iter().zip(positions()) {
        assert_eq!(outcome["status"], "located", "{at:?}");
        let off = [("x_mm", at.x_mm), ("y_mm", at.y_mm)]
            .map(|(key, expected)| (outcome["at"][key].as_f64().unwrap() - expected).abs());
        assert!(off.iter().all(|d| *d < 1.0), "{at:?}: {outcome}");
    }
    assert_eq!(located.len(), PRESSES);

    // All outputs state that nothing was measured.
    let shown = show(&session);
    assert_eq!(shown["rig_kind"], "imported");
    assert_eq!(shown["end"], "completed");
    assert!(output.out.contains("not from a measurement"), "{output:?}");
    // Every event of the files is in the session, in order.
    for camera in CameraId::ALL {
        let mut decoder = Decoder::new(StreamFormat::Evt2);
        let mut stored = Vec::new();
        for chunk in chunks(&session, camera) {
            decoder.for_each_slice(&chunk, |e| stored.extend_from_slice(e));
        }
        assert!(stored == events(camera), "{camera}");
    }
    skinrig(&["verify", &text(&session)]).code(0);

    // The same files once more are no second measurement.
    skinrig(&data.arguments(&lab.path("again"))).code(0);
    let again = text(&only(&lab.path("again"), ".session.sqlite"));
    skinrig(&["compare", &text(&session), &again])
        .code(2)
        .expect_stderr(&[
            "the same recording",
            "on both sides",
            "--despite same-session",
        ]);

    // Nor is it with another origin of time, which changes every byte.
    for (camera, path) in CameraId::ALL.into_iter().zip(&data.cameras) {
        let late = |e: CdEvent| CdEvent {
            t_us: e.t_us + 5_000_000,
            ..e
        };
        std::fs::remove_file(path).unwrap();
        let mut writer = EventWriter::create(path, 0).unwrap();
        let later: Vec<CdEvent> = events(camera).into_iter().map(late).collect();
        writer.append(&later).unwrap();
        writer.finish().unwrap();
    }
    skinrig(&data.arguments(&lab.path("later"))).code(0);
    let later = text(&only(&lab.path("later"), ".session.sqlite"));
    skinrig(&["compare", &text(&session), &later])
        .code(2)
        .expect_stderr(&["the same recording", "on both sides"]);
}

/// Imports the dataset with changed positions or swapped cameras; returns output and results.
fn import_wrong(
    change: impl Fn(Point2) -> Point2,
    swapped: bool,
) -> (crate::support::ProgramOutput, serde_json::Value) {
    let lab = Lab::new();
    let mut data = Dataset::new(&lab);
    let wrong: Vec<Point2> = positions().into_iter().map(change).collect();
    std::fs::write(&data.presses, csv(&wrong)).unwrap();
    if swapped {
        data.cameras.swap(0, 1);
    }
    let output = skinrig(&data.arguments(&lab.path("s")));
    let results = read_json(&only(&lab.path("s"), ".results.json"));
    (output, results)
}

#[test]
fn positions_and_cameras_that_are_taken_for_others_make_the_session_invalid() {
    type PositionMap = fn(Point2) -> Point2;
    let cases: [(&str, PositionMap, bool); 4] = [
        ("axes exchanged", |p| Point2::new(p.y_mm, p.x_mm), false),
        ("axis mirrored", |p| Point2::new(p.x_mm, -p.y_mm), false),
        (
            "positions displaced",
            |p| Point2::new(p.x_mm - 10.0, p.y_mm - 2.0),
            false,
        ),
        ("cameras swapped", |p| p, true),
    ];
    for (fault, change, swapped) in cases {
        let (output, results) = import_wrong(change, swapped);
        let output = output
            .code(4)
            .expect_stderr(&["the session is INVALID", fault]);
        assert_eq!(results["valid"], false, "{fault}");
        let rmse = results["analysis"]["scored"]["rmse_mm"]["value"].as_f64();
        let headline = rmse.map(|mm| format!("{mm:.2} mm"));
        assert!(
            headline.is_none_or(|mm| !output.out.contains(&mm)),
            "{output:?}"
        );
    }
}

#[test]
fn extra_presses_are_identified_by_the_sync_presses_or_the_session_is_invalid() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    std::fs::write(&data.presses, csv(&positions()[..PRESSES - 3])).unwrap();
    let import = |folder: &str, set: &[&str]| {
        let mut arguments = data.arguments(&lab.path(folder));
        for key in [&["presses_per_repetition=9"], set].concat() {
            arguments.extend(["--set".to_owned(), key.to_owned()]);
        }
        skinrig(&arguments)
    };
    import("s", &[]).code(0);
    let results = read_json(&only(&lab.path("s"), ".results.json"));
    assert_eq!(results["valid"], true);
    let evidence = &results["analysis"]["alignment"]["rates"];
    assert!(evidence["log_odds"].as_f64().unwrap() > 7.0, "{evidence:#}");
    for (k, planted_us) in OFFSET_US.into_iter().enumerate() {
        assert_eq!(evidence["cameras"][k]["unexplained"], 3, "{evidence:#}");
        let found_us = results["analysis"]["clocks"][k]["offset_us"]
            .as_f64()
            .unwrap();
        assert!(
            (found_us - planted_us).abs() < 2.0 * WITHIN_US,
            "{found_us}"
        );
    }

    // A single sync press in rhythm with the path: the planned presses cannot be identified.
    let output = import("t", &["sync.count=1", "sync.pause_after=1.5 s"]).code(4);
    let output = output.expect_stderr(&["INVALID", "log-odds", "all other alignments", "next:"]);
    let results = read_json(&only(&lab.path("t"), ".results.json"));
    assert_eq!(results["valid"], false);
    assert!(output.out.contains("INVALID   use no number"), "{output:?}");
    let page = std::fs::read_to_string(only(&lab.path("t"), ".report.html")).unwrap();
    assert!(page.contains("data-testid=\"invalid\""));
    skinrig(&["analyze", &text(&only(&lab.path("t"), ".session.sqlite"))]).code(4);
}

#[test]
fn an_imported_session_replays_and_reads_like_any_other() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    let mut arguments = data.arguments(&lab.path("s"));
    arguments.push("--no-analysis".into());
    skinrig(&arguments).code(0);
    let session = only(&lab.path("s"), ".session.sqlite");
    assert_replays(&lab, &session, "r");
    skinrig(&[
        "export",
        &text(&session),
        "--to",
        "all",
        "--out",
        &lab.text("e"),
    ])
    .code(0);
    skinrig(&["inspect", &text(&session)]).code(0);
    skinrig(&[
        "analyze",
        &text(&session),
        "--set",
        "analysis.centroid=all_clusters",
    ])
    .code(0);
}

#[test]
fn recordings_as_raw_files_are_imported_byte_for_byte() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    let mut arguments = data.arguments(&lab.path("s"));
    arguments.push("--no-analysis".into());
    skinrig(&arguments).code(0);
    let first = only(&lab.path("s"), ".session.sqlite");
    skinrig(&[
        "export",
        &text(&first),
        "--to",
        "raw",
        "--out",
        &lab.text("e"),
    ])
    .code(0);
    let raw = Dataset {
        cameras: [1, 2].map(|n| only(&lab.path("e"), &format!(".camera{n}.raw"))),
        ..data
    };
    skinrig(&raw.arguments(&lab.path("t"))).code(0);
    let second = only(&lab.path("t"), ".session.sqlite");
    for camera in CameraId::ALL {
        assert!(
            chunks(&first, camera).concat() == chunks(&second, camera).concat(),
            "{camera}"
        );
    }
    // The same presses, too: bytes of a quiet camera arrive during each of them.
    let verdicts = |session: &Path| {
        let presses = SessionReader::open(session).unwrap().presses().unwrap();
        let attempts = presses.into_iter().flat_map(|(_, attempts)| attempts);
        attempts
            .map(|a| a.outcome.map(|o| o.verdict))
            .collect::<Vec<Option<PressVerdict>>>()
    };
    assert_eq!(verdicts(&first), verdicts(&second));
}

/// Imports a sample in the published layout from beside the workspace; `None` if absent.
fn sample(name: &str, schedule: &str) -> Option<(Lab, serde_json::Value)> {
    let folder = format!("{ROOT}/../shared/data/{name}");
    if !Path::new(&folder).exists() {
        eprintln!("skipped: {folder} is not there");
        return None;
    }
    let lab = Lab::new();
    let file = |name: &str| format!("{folder}/{name}");
    let output = skinrig(&[
        "import",
        "--camera1",
        &file("grid_path2_v2_camera1.hdf5"),
        "--camera2",
        &file("grid_path2_v2_camera2.hdf5"),
        "--presses",
        &file("snake_grid_press_positions.csv"),
        "--schedule",
        &format!("protocols/{schedule}"),
        "--sessions",
        &lab.text("s"),
    ]);
    assert!(output.out.contains("RMSE"), "{output:?}");
    let results = read_json(&only(&lab.path("s"), ".results.json"));
    skinrig(&["verify", &text(&only(&lab.path("s"), ".session.sqlite"))]).code(0);
    Some((lab, results))
}

#[test]
fn the_short_sample_is_imported() {
    if let Some((_lab, results)) = sample("sample-dense", "ten-presses.schedule.yaml") {
        assert_eq!(results["analysis"]["counts"]["planned"], 10);
        // Another skin than the schedule describes, and too few presses to calibrate: the number is unusable.
        assert_eq!(results["valid"], false);
    }
}

#[test]
fn the_sample_of_one_repetition_is_imported() {
    if let Some((_lab, results)) = sample("sample-grid", "single-repetition.schedule.yaml") {
        let counts = &results["analysis"]["counts"];
        assert_eq!(results["valid"], true);
        assert_eq!(counts["planned"], 289);
        // The last 39 presses are recorded but unused.
        assert!(counts["excluded"].as_u64().unwrap() >= 39, "{counts}");
        assert_eq!(results["analysis"]["clocks"][0]["method"], "event_rates");
    }
}

#[test]
fn progress_and_summary_of_an_import_count_the_same() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    let mut arguments = data.arguments(&lab.path("s"));
    arguments.extend(["--set".to_owned(), "presses_used=10".to_owned()]);
    let output = skinrig(&arguments).code(0);
    let last = output
        .err
        .lines()
        .rfind(|l| l.starts_with("press "))
        .unwrap();
    assert!(
        last.starts_with("press 15/15") && last.ends_with("  2 excluded"),
        "{output:?}"
    );
    assert!(!output.err.contains("invalid"), "{output:?}");
    let summary = "12 planned = 10 valid + 0 missed + 0 invalid + 2 excluded";
    assert!(output.out.contains(summary), "{output:?}");
}
