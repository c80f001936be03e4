//! A session that takes its calibration from an earlier one.

use crate::support::{Lab, only, read_json, skinrig, text};

#[test]
fn a_session_is_analysed_with_an_earlier_calibration_or_the_reason_is_given() {
    let lab = Lab::new();
    let record = |folder: &str, more: &[&str]| {
        let calibrates = [
            "--set",
            "evaluation.calibrate=[1]",
            "--set",
            "evaluation.score=[2]",
            "--set",
            "analysis.calibration=positions",
        ];
        text(&lab.record(folder, &[&calibrates, more].concat()))
    };
    let earlier = record("a", &["--seed", "1"]);
    // The seed also numbers the simulated cameras.
    let later = record("b", &["--seed", "1"]);
    let replaced = record("d", &["--seed", "2"]);
    let other = record("c", &["--set", "prototype.id=skin 9"]);
    let analyze = |session: &str, from: &str| {
        skinrig(&[
            "analyze",
            session,
            "--calibration-from",
            from,
            "--name",
            "moved",
        ])
    };
    analyze(&later, &earlier).code(0);
    let folder = &lab.path("b");
    let results = read_json(&only(folder, ".analysis-moved.results.json"));
    let about = &results["analysis"]["recalibration"];
    let sealed = about["from"]["content_sha256"].as_str().map(str::len);
    assert_eq!(sealed, Some(64), "{about}");
    assert!(about["from"]["session_id"].as_str().unwrap().len() == 32);
    assert!(about["presses"].as_u64().unwrap() >= 3, "{about}");
    // Nothing moved in between.
    for shift in about["shift_mm"].as_array().unwrap() {
        let (value, error) = (&shift["value"], &shift["standard_error"]);
        let off = value.as_f64().unwrap().abs() / error.as_f64().unwrap();
        assert!(off < 4.0, "{about}");
    }
    let text = skinrig(&["report", &later, "--analysis", "moved"]).code(0);
    assert!(
        text.err.is_empty() || !text.err.contains("error"),
        "{text:#?}"
    );
    let report = std::fs::read_to_string(only(folder, ".analysis-moved.report.html")).unwrap();
    assert!(report.contains("skin and cameras shifted by"));
    let same = analyze(&later, &later).code(2);
    assert!(same.err.contains("found this one"), "{same:#?}");
    let cameras = analyze(&later, &replaced).code(2);
    assert!(cameras.err.contains("sim-00000002-c1"), "{cameras:#?}");
    let other = analyze(&later, &other).code(2);
    assert!(other.err.contains("found `skin 9`"), "{other:#?}");
}
