//! Evaluation from the command line: the public code's choices, and recordings with wrong documents.

use skinrig_model::Point2;

use crate::dataset::{Dataset, PRESSES, csv, positions};
use crate::support::{Lab, files, only, read_json, skinrig, text};

/// Findings after importing a recording whose files `spoil` has changed.
fn faults(spoil: impl FnOnce(&mut Dataset)) -> (Vec<String>, String) {
    let lab = Lab::new();
    let mut data = Dataset::new(&lab);
    spoil(&mut data);
    let output = skinrig(&data.arguments(&lab.path("s")));
    let results = read_json(&only(&lab.path("s"), ".results.json"));
    let findings = results["analysis"]["findings"].as_array().unwrap();
    let names = findings
        .iter()
        .map(|f| f["fault"].as_str().unwrap().to_owned());
    (names.collect(), output.out)
}

/// A place that a path lists again is the same location: its presses are not independent.
#[test]
fn a_place_that_is_listed_again_is_one_location() {
    let lab = Lab::new();
    let points =
        "path={points: [[10 mm, 2 mm], [-10 mm, 18 mm], [10 mm, 2.01 mm], [-10 mm, 18 mm]]}";
    let session = text(&lab.record("s", &["--set", points]));
    let results = skinrig(&["--json", "analyze", &session]).code(0).json();
    let presses = results["analysis"]["presses"].as_array().unwrap();
    let scored = presses.iter().filter(|p| p["role"] == "score");
    let locations: Vec<u64> = scored.map(|p| p["location"].as_u64().unwrap()).collect();
    assert_eq!(locations, [1, 2, 1, 2, 1, 2, 1, 2]);
}

fn write_positions(data: &Dataset, change: impl Fn(usize, Point2) -> Point2) {
    let moved: Vec<Point2> = positions()
        .into_iter()
        .enumerate()
        .map(|(i, p)| change(i, p))
        .collect();
    std::fs::write(&data.presses, csv(&moved)).unwrap();
}

#[test]
fn a_recording_of_another_format_is_reported() {
    let (names, _) = faults(|_| {});
    assert!(names.is_empty(), "{names:?}");

    let (names, out) = faults(|data| data.cameras.reverse());
    assert_eq!(names[0], "cameras_swapped");
    assert!(out.contains("swapped") && out.contains("camera"), "{out}");

    let (names, _) = faults(|data| write_positions(data, |_, p| Point2::new(p.x_mm, 4.0 - p.y_mm)));
    assert_eq!(names[0], "axis_mirrored");

    let shifted = positions();
    let (names, _) = faults(|data| write_positions(data, |i, _| shifted[(i + 1) % PRESSES]));
    assert_eq!(names[0], "index_shifted");
}

#[test]
fn results_with_the_public_codes_choices_are_shown_beside_the_sessions() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    skinrig(&data.arguments(&lab.path("s"))).code(0);
    let own = only(&lab.path("s"), ".results.json");
    let before = text(&own);
    assert!(read_json(&own)["analysis"]["reference"].is_null());

    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    // The press period is half that of the published recording.
    let arguments = [
        "analyze",
        &session,
        "--reference-code",
        "--set",
        "analysis.window_before=750 ms",
        "--set",
        "analysis.window_after=750 ms",
    ];
    skinrig(&arguments).code(0);
    assert_eq!(text(&own), before);
    let folder = std::path::Path::new(&session).parent().unwrap();
    let variant = files(folder, ".results.json");
    let variant = variant
        .iter()
        .find(|p| text(p).contains(".analysis-reference-code_"));
    let analysis = &read_json(variant.unwrap())["analysis"];
    let settings = &analysis["settings"];
    assert_eq!(settings["window_anchor"], "middle");
    assert_eq!(settings["centroid"], "all_clusters");
    assert_eq!(
        settings["window_before_ms"], 750.0,
        "what the user says wins"
    );
    let reference = &analysis["reference"];
    assert_eq!(reference["presses"], PRESSES);
    assert_eq!(reference["inside"], PRESSES);
    assert!(reference["rmse_mm"].as_f64().unwrap() < 1.0, "{reference}");
    let rows = reference["reduction"].as_array().unwrap();
    assert_eq!(rows.len(), 11);
    // 11 of 12 lie below their own 95th percentile.
    assert!((rows[0]["pass_rate"].as_f64().unwrap() - 11.0 / 12.0).abs() < 1e-12);
}
