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
    // The seed also numbers the simulated cameras, and makes the same noise at the same presses.
    let elsewhere = [
        "--seed",
        "1",
        "--set",
        "path.points=[[8 mm, 4 mm], [-8 mm, 16 mm], [2 mm, -16 mm], [22 mm, 15 mm], [12 mm, 12 mm], [-4 mm, 2 mm]]",
        "--set",
        "sync.at=[14 mm, 6 mm]",
    ];
    let earlier = record("a", &elsewhere);
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
    // The tip and the cameras' settings are those of the earlier session.
    let changed = |folder: &str, set: &str| {
        let session = record(folder, &[&elsewhere[..], &["--set", set]].concat());
        analyze(&later, &session).code(2)
    };
    let tip = changed("e", "prototype.tip=sphere 5 mm");
    assert!(
        tip.err.contains("the tip `cube`, found `sphere 5 mm`"),
        "{tip:#?}"
    );
    // Other rigs have other events.
    let level = record("g", &[&elsewhere[..], &["--level", "optical"]].concat());
    let level = analyze(&later, &level).code(2);
    assert!(
        level
            .err
            .contains("(simulated, level geometric), found simulated, level optical"),
        "{level:#?}"
    );
    let faulty = record(
        "h",
        &[&elsewhere[..], &["--fault", "trigger-lost@press:3"]].concat(),
    );
    let faulty = analyze(&later, &faulty).code(2);
    assert!(
        faulty
            .err
            .contains("expected the same planted faults as here (none), found"),
        "{faulty:#?}"
    );
    let biases = changed("f", "cameras.camera1.biases.bias_fo=1600");
    assert!(
        biases.err.contains("bias_fo 1477, found 1600"),
        "{biases:#?}"
    );
}

/// Scored presses of a session do not calibrate it under another name.
#[test]
fn a_session_is_not_calibrated_by_its_own_events() {
    let lab = Lab::new();
    let calibrates = [
        "--set",
        "evaluation.calibrate=[1]",
        "--set",
        "evaluation.score=[2]",
        "--set",
        "analysis.calibration=positions",
    ];
    let session = text(&lab.record("a", &calibrates));
    let replays = lab.text("replays");
    skinrig(&[
        "run",
        "--replay",
        &session,
        "--sessions",
        &replays,
        "--no-analysis",
    ])
    .code(0);
    let replay = text(&only(&lab.path("replays"), ".session.sqlite"));
    // The same presses, recorded once more with the same noise, and more of them.
    let again = text(&lab.record("b", &calibrates));
    let longer = [
        "--set",
        "repetitions.count=3",
        "--set",
        "evaluation.score=[2, 3]",
    ];
    let longer = text(&lab.record("c", &[&calibrates[..2], &longer, &calibrates[4..]].concat()));
    for other in [&replay, &again, &longer] {
        skinrig(&["analyze", &session, "--calibration-from", other])
            .code(2)
            .expect_stderr(&["of the same events", "next:"]);
    }
}
