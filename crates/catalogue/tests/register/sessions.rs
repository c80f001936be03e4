//! Registering sessions: the same rows as in the files, once, and what is stale.

use std::path::Path;

use skinrig_catalogue::results_digest::with_digest;
use skinrig_catalogue::{Access, Address, Catalogue, Registration, Staleness};
use skinrig_recorder::{Annotation, SessionReader, annotate, salvage};

use crate::common;
use crate::support::{Lab, WAIT, column, rows};

/// What is stale, as `file why`.
fn stale(lab: &Lab) -> Vec<String> {
    let status = lab.open().status(lab.path()).unwrap();
    let all = status.stale.iter();
    all.map(|s| format!("{} {}", s.file, s.why.words()))
        .collect()
}

fn refresh(lab: &Lab) -> Registration {
    lab.open().refresh(lab.path(), false).unwrap()
}

/// Presses of an analysis, as far as the catalogue reads them.
const PRESSES: &str = r#"[
    {"press": 1, "role": "sync", "repetition": 1, "location": 1, "planned": {"x_mm": 10.0, "y_mm": 2.0}, "depth_mm": 2.0,
     "truth": null, "verdict": "missed", "cause": {"missed": "never_attempted"}, "location_outcome": {"status": "missing"}},
    {"press": 2, "role": "score", "repetition": 1, "location": 2, "planned": {"x_mm": -5.0, "y_mm": 2.0}, "depth_mm": 1.5,
     "truth": {"x_mm": -5.25, "y_mm": 2.5}, "verdict": "valid", "cause": null,
     "location_outcome": {"status": "located", "at": {"x_mm": -2.25, "y_mm": 6.5}, "sine": 0.9},
     "region": {"semi_axes_mm": [3.0, 2.0], "angle_deg": -45.0}},
    {"press": 4, "role": "calibrate", "repetition": 2, "location": 3, "planned": {"x_mm": 0.0, "y_mm": 0.0}, "depth_mm": 2.0,
     "truth": {"x_mm": 0.0, "y_mm": 0.0}, "verdict": "excluded",
     "cause": {"no_response": {"camera": "camera2", "found": 1, "expected": 2.0, "standard_error": 1.0}},
     "location_outcome": {"status": "missing"}, "region": null}]"#;

/// Results of an analysis with an RMSE, as far as the catalogue reads them.
fn results(of: &SessionReader, rmse_mm: f64, variant: Option<&str>) -> String {
    let session_id = of.session_id().unwrap();
    let content = of.seal().unwrap().unwrap().content_sha256();
    let variant = match variant {
        None => "null".to_owned(),
        Some(name) => format!(r#"{{"name": "{name}", "changed": ["analysis.bin=2px"]}}"#),
    };
    format!(
        r#"{{"format": "skinrig-report", "analysis": {{"version": 14, "latency": {{"x": [1, 2]}},
            "alignment": {{"maps": [{{"map": "camera1_from_box", "drift_ppm": -3.5, "residual_rms_us": 0.3,
                "residual_max_us": 0.7, "n": 38, "pieces": 1}}]}},
            "calibration": {{"model": "yaw", "names": ["yaw_1", "yaw_2"], "values": [0.5, 0.25],
                "standard_errors": [null, 0.1], "rmse_before_mm": 4.0, "rmse_after_mm": 2.0, "n": 9}},
            "presses": {PRESSES},
            "scored": {{"rmse_mm": {{"value": {rmse_mm}, "low": 1.0, "high": 2.0, "n": 8}}}}}},
          "provenance": {{"session_id": "{session_id}", "content_sha256": "{content}", "results_hash": "abc", "variant": {variant}}},
          "summary": {{"session_id": "{session_id}", "content_sha256": "{content}", "analysis_version": 14, "results_hash": "abc",
            "valid": true, "counts": {{}}, "rmse_mm": {{"value": {rmse_mm}, "low": 1.0, "high": 2.0, "n": 8}},
            "repeat_std_mm": {{"n": 0}}, "located_rate": {{"n": 0}}}}, "valid": true
}}"#
    )
}

/// Writes a results file with its digest.
fn write(file: impl AsRef<Path>, results: &str) {
    std::fs::write(file, with_digest(results)).unwrap();
}

/// Writes official results of the session `n`.
pub(crate) fn write_results(lab: &Lab, n: u32) {
    let reader = SessionReader::open(lab.session(n)).unwrap();
    let file = lab.path().join(format!("{n}.results.json"));
    write(file, &results(&reader, 1.5, None));
}

/// Adds a tag and a note to the session `n`.
pub(crate) fn add_tag(lab: &Lab, n: u32) {
    let reader = SessionReader::open(lab.session(n)).unwrap();
    let added = Annotation {
        session_id: reader.session_id().unwrap(),
        at: "2026-11-21T00:00:00Z".into(),
        by: "Ann".into(),
        add: vec!["wet".into()],
        remove: Vec::new(),
        note: Some("lamp".into()),
    };
    annotate(&lab.session(n), &added).unwrap();
}

#[test]
fn a_session_is_registered_as_it_is_in_its_file_and_once() {
    let lab = Lab::with_sessions(2);
    let reader = SessionReader::open(lab.session(1)).unwrap();
    let id = reader.session_id().unwrap();
    write_results(&lab, 1);
    let variant = lab.path().join("1.analysis-bin=2px.results.json");
    write(variant, &results(&reader, 1.25, Some("bin=2px")));
    add_tag(&lab, 1);

    let done = lab.open().register(&[lab.session(1)]).unwrap();
    assert_eq!(done.registered, ["1.session.sqlite"]);
    let seal = reader.seal().unwrap().unwrap();
    let sha256: String = seal
        .tree_sha256
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect();
    let totals = seal.totals;
    let found = rows(
        &lab.file(),
        "SELECT session_id, content_sha256, started_s, prototype, operator, seed, ended, planned, valid, missed, invalid,
             sync_valid, cd_events, lost_bytes, duration_s FROM session",
    );
    let tally = totals.presses;
    let expected = format!(
        "session_id={id}|content_sha256={sha256}|started_s=1767323045|prototype=P1|operator=tester|seed={}|ended=stopped|\
         planned={}|valid={}|missed={}|invalid={}|sync_valid=1|cd_events={}|lost_bytes={}|duration_s={}",
        u64::MAX,
        tally.planned,
        tally.valid,
        tally.missed,
        tally.invalid,
        totals.cd_events,
        totals.lost_bytes,
        reader.end().unwrap().unwrap().0.0 as f64 / 1e9,
    );
    assert_eq!(found, [expected]);
    for (sql, expected) in [
        ("SELECT count(*) FROM device", "2"),
        ("SELECT group_concat(tag) FROM tag", "wet"),
        ("SELECT group_concat(text) FROM note", "tip cleaned,lamp"),
        (
            "SELECT group_concat(name) FROM analysis",
            "bin=2px,official",
        ),
        ("SELECT min(rmse_mm) FROM analysis", "1.25"),
        (
            "SELECT drift_ppm FROM clock_fit WHERE analysis = 'official'",
            "-3.5",
        ),
        (
            "SELECT sum(value) FROM calibration_value WHERE analysis = 'official'",
            "0.75",
        ),
        (
            "SELECT changed_json FROM analysis WHERE name = 'bin=2px'",
            r#"["analysis.bin=2px"]"#,
        ),
    ] {
        assert_eq!(column(&lab.file(), sql), [expected], "{sql}");
    }

    // Presses of the official analysis alone.
    let expected = [
        "press=1|role=sync|location=1|repetition=1|planned_x_mm=10|planned_y_mm=2|planned_depth_mm=2|measured_x_mm=null|\
         measured_y_mm=null|verdict=missed|cause=missed|camera=null|estimate_x_mm=null|estimate_y_mm=null|error_mm=null|\
         region_major_mm=null|region_minor_mm=null|region_angle_deg=null",
        "press=2|role=score|location=2|repetition=1|planned_x_mm=-5|planned_y_mm=2|planned_depth_mm=1.5|measured_x_mm=-5.25|\
         measured_y_mm=2.5|verdict=valid|cause=null|camera=null|estimate_x_mm=-2.25|estimate_y_mm=6.5|error_mm=5|\
         region_major_mm=3|region_minor_mm=2|region_angle_deg=-45",
        "press=4|role=calibrate|location=3|repetition=2|planned_x_mm=0|planned_y_mm=0|planned_depth_mm=2|measured_x_mm=0|\
         measured_y_mm=0|verdict=excluded|cause=no_response|camera=camera2|estimate_x_mm=null|estimate_y_mm=null|error_mm=null|\
         region_major_mm=null|region_minor_mm=null|region_angle_deg=null",
    ];
    let found = rows(
        &lab.file(),
        "SELECT press, role, location, repetition, planned_x_mm, planned_y_mm, planned_depth_mm, measured_x_mm, measured_y_mm,
             verdict, cause, camera, estimate_x_mm, estimate_y_mm, error_mm, region_major_mm, region_minor_mm, region_angle_deg
         FROM press ORDER BY press",
    );
    assert_eq!(found, expected);

    // Again, by another program, and as part of the folder: the same rows.
    let before = lab.dump();
    let again = lab.open().register(&[lab.session(1)]).unwrap();
    assert_eq!((again.registered.len(), again.unchanged), (0, 1));
    assert_eq!(lab.dump(), before);
    let done = refresh(&lab);
    assert_eq!(
        (done.registered, done.unchanged),
        (vec!["0.session.sqlite".to_owned()], 1)
    );
    let both = lab.dump();
    assert!(
        lab.open()
            .refresh(lab.path(), true)
            .unwrap()
            .registered
            .len()
            == 2
    );
    assert_eq!(lab.dump(), both);
}

/// A session that was resumed since has other presses.
#[test]
fn results_of_an_earlier_content_are_a_problem() {
    let lab = Lab::with_sessions(1);
    let reader = SessionReader::open(lab.session(0)).unwrap();
    let content = reader.seal().unwrap().unwrap().content_sha256();
    let older = results(&reader, 1.5, None).replace(&content, &"0".repeat(64));
    write(lab.path().join("0.results.json"), &older);
    lab.open().register(&[lab.session(0)]).unwrap();
    let sql = "SELECT rmse_mm, problem FROM analysis";
    let expected =
        "rmse_mm=null|problem=the results beside it are older than the session: analyze it again";
    assert_eq!(rows(&lab.file(), sql), [expected]);
    assert_eq!(column(&lab.file(), "SELECT count(*) FROM press"), ["0"]);
    // Once it is analyzed, they are those of the new content; once they are stale again, none.
    for (text, count) in [
        (results(&reader, 1.5, None), "3"),
        (
            results(&reader, 1.5, None).replace(&content, &"1".repeat(64)),
            "0",
        ),
    ] {
        write(lab.path().join("0.results.json"), &text);
        assert_eq!(refresh(&lab).registered.len(), 1);
        assert_eq!(column(&lab.file(), "SELECT count(*) FROM press"), [count]);
    }
}

/// An RMSE that was edited by hand is no result.
#[test]
fn results_that_were_changed_are_a_problem() {
    let lab = Lab::with_sessions(1);
    write_results(&lab, 0);
    let file = lab.path().join("0.results.json");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("\"value\": 1.5", "\"value\": 0.5")).unwrap();
    lab.open().register(&[lab.session(0)]).unwrap();
    let expected = "rmse_mm=null|problem=the results were changed after they were written: analyze the session again";
    let found = rows(&lab.file(), "SELECT rmse_mm, problem FROM analysis");
    assert_eq!(found, [expected]);
}

/// Results that contradict themselves are a problem of their session alone: the others are registered.
#[test]
fn results_with_rows_twice_are_a_problem() {
    let lab = Lab::with_sessions(2);
    let reader = SessionReader::open(lab.session(0)).unwrap();
    let good = results(&reader, 1.5, None);
    let problem = "SELECT problem FROM analysis WHERE name = 'official'";
    for (one, other) in [
        (r#""press": 4"#, r#""press": 2"#),
        (r#""press": 4"#, r#""press": 1"#),
        (r#""no_response": {"#, r#""No response": {"#),
        (
            r#""names": ["yaw_1", "yaw_2"]"#,
            r#""names": ["yaw_1", "yaw_1"]"#,
        ),
        (
            r#""pieces": 1}"#,
            r#""pieces": 1}, {"map": "camera1_from_box", "n": 2}"#,
        ),
    ] {
        let bad = good.replace(one, other);
        assert_ne!(bad, good);
        write(lab.path().join("0.results.json"), &bad);
        let done = lab.open().refresh(lab.path(), true).unwrap();
        assert_eq!(
            (done.registered.len(), done.unreadable.len()),
            (2, 0),
            "{other}"
        );
        assert_eq!(column(&lab.file(), problem).len(), 1, "{other}");
        assert_ne!(column(&lab.file(), problem), ["null"], "{other}");
        assert_eq!(column(&lab.file(), "SELECT count(*) FROM press"), ["0"]);
    }
    // A file whose name pretends to be a variant called `official`.
    write(lab.path().join("0.results.json"), &good);
    write(lab.path().join("0.analysis-official.results.json"), &good);
    let done = lab.open().refresh(lab.path(), false).unwrap();
    assert_eq!(done.registered.len(), 1);
    assert_eq!(column(&lab.file(), problem), ["null"]);
}

#[test]
fn what_changes_is_stale_until_it_is_registered() {
    let lab = Lab::with_sessions(3);
    assert_eq!(stale(&lab).len(), 3);
    refresh(&lab);
    assert_eq!(stale(&lab), [""; 0]);
    let reader = SessionReader::open(lab.session(0)).unwrap();
    std::fs::write(
        lab.path().join("0.results.json"),
        results(&reader, 1.5, None),
    )
    .unwrap();
    drop(reader);
    std::fs::remove_file(lab.session(1)).unwrap();
    std::fs::write(lab.session(2), "no session").unwrap();
    common::sealed(&lab.session(3), 3);
    let expected = [
        "0.session.sqlite changed since it was read",
        "2.session.sqlite changed since it was read",
        "3.session.sqlite not in the catalogue",
        "1.session.sqlite no longer in the folder",
    ];
    assert_eq!(stale(&lab), expected);
    let done = refresh(&lab);
    assert_eq!(done.registered, ["0.session.sqlite", "3.session.sqlite"]);
    assert_eq!(done.forgotten, ["1.session.sqlite"]);
    assert_eq!(done.unreadable.len(), 1);
    assert!(
        done.unreadable[0]
            .reason
            .contains("expected a skinrig session")
    );
    let status = lab.open().status(lab.path()).unwrap();
    assert_eq!((status.current, status.stale.len()), (3, 0));
    assert_eq!(status.unreadable, done.unreadable);
    assert_eq!(column(&lab.file(), "SELECT count(*) FROM session"), ["2"]);
    // The file becomes readable again, with another session.
    std::fs::remove_file(lab.session(2)).unwrap();
    common::sealed(&lab.session(2), 3);
    assert_eq!(refresh(&lab).registered, ["2.session.sqlite"]);
    assert_eq!(
        column(&lab.file(), "SELECT count(*) FROM unreadable_file"),
        ["0"]
    );
    // Another session under the name of one that is registered.
    std::fs::rename(lab.session(3), lab.session(2)).unwrap();
    refresh(&lab);
    assert_eq!(column(&lab.file(), "SELECT count(*) FROM session"), ["2"]);
    assert_eq!(stale(&lab), [""; 0]);
}

#[test]
fn copies_of_a_session_are_one_session() {
    let lab = Lab::with_sessions(1);
    // `salvage` copies without the seal; its name sorts first.
    salvage(&lab.session(0), &lab.path().join("-.session.sqlite")).unwrap();
    let both = |source: &str| {
        assert_eq!(column(&lab.file(), "SELECT count(*) FROM session"), ["1"]);
        let sql = "SELECT name FROM session_file ORDER BY is_source DESC";
        let names = column(&lab.file(), sql);
        assert_eq!((names.len(), names[0].as_str()), (2, source));
        assert_eq!(stale(&lab), [""; 0]);
    };
    let sealed = || {
        column(
            &lab.file(),
            "SELECT content_sha256 IS NOT NULL FROM session",
        )
    };
    refresh(&lab);
    both("0.session.sqlite");
    assert_eq!(sealed(), ["1"]);
    // In either order.
    std::fs::remove_file(lab.file()).unwrap();
    let mut catalogue = lab.open();
    for name in ["-.session.sqlite", "0.session.sqlite"] {
        catalogue.register(&[lab.path().join(name)]).unwrap();
    }
    both("0.session.sqlite");
    assert_eq!(sealed(), ["1"]);
    // The source goes: the copy is read instead.
    std::fs::remove_file(lab.session(0)).unwrap();
    refresh(&lab);
    assert_eq!(sealed(), ["0"]);
    assert_eq!(stale(&lab), [""; 0]);
    assert_eq!(
        column(&lab.file(), "SELECT is_source FROM session_file"),
        ["1"]
    );
}

/// A plain copy without results, whose name sorts first, hides no results.
#[test]
fn a_copy_without_results_does_not_replace_the_analysed_session() {
    let lab = Lab::with_sessions(1);
    write_results(&lab, 0);
    let copy = lab.path().join("-.session.sqlite");
    std::fs::copy(lab.session(0), &copy).unwrap();
    for order in [[lab.session(0), copy.clone()], [copy, lab.session(0)]] {
        let mut catalogue = lab.open();
        for file in order {
            catalogue.register(&[file]).unwrap();
        }
        let sql = "SELECT name FROM session_file WHERE is_source = 1";
        assert_eq!(column(&lab.file(), sql), ["0.session.sqlite"]);
        assert_eq!(column(&lab.file(), "SELECT count(*) FROM analysis"), ["1"]);
        assert_eq!(stale(&lab), [""; 0]);
        drop(catalogue);
        std::fs::remove_file(lab.file()).unwrap();
    }
}

#[test]
fn a_catalogue_of_several_folders_keeps_them_apart() {
    let (one, two) = (Lab::with_sessions(2), Lab::with_sessions(1));
    let mut all = Catalogue::open(Address::File(one.file()), Access::Write, WAIT).unwrap();
    for lab in [&one, &two] {
        all.refresh(lab.path(), false).unwrap();
    }
    assert_eq!(column(&one.file(), "SELECT count(*) FROM session"), ["3"]);
    std::fs::remove_file(two.session(0)).unwrap();
    assert!(all.status(one.path()).unwrap().stale.is_empty());
    let gone = all.status(two.path()).unwrap().stale;
    assert_eq!(
        gone.iter().map(|s| s.why).collect::<Vec<_>>(),
        [Staleness::Gone]
    );
}

#[test]
fn a_session_that_is_being_recorded_is_left_out() {
    let lab = Lab::with_sessions(1);
    let mut writer = skinrig_recorder::SessionWriter::create(lab.session(1)).unwrap();
    for record in common::records(3) {
        writer.accept(record).unwrap();
    }
    let done = refresh(&lab);
    assert_eq!(done.registered, ["0.session.sqlite"]);
    assert_eq!(done.under_way, ["1.session.sqlite"]);
    let status = lab.open().status(lab.path()).unwrap();
    assert_eq!((status.stale.len(), status.under_way.len()), (0, 1));
    writer.finish().unwrap();
    assert_eq!(refresh(&lab).registered, ["1.session.sqlite"]);
}

#[test]
fn prototypes_of_the_folder_are_read() {
    let lab = Lab::with_sessions(0);
    let file = lab.path().join("prototypes.yaml");
    let text = "skinrig_prototypes: 1\nprototypes:\n  - {name: a}\n  - {name: b, relation: repaired, parent: a}\n";
    std::fs::write(&file, text).unwrap();
    assert_eq!(refresh(&lab).prototypes, Some(2));
    let found = column(
        &lab.file(),
        "SELECT parent FROM prototype WHERE relation = 'repaired'",
    );
    assert_eq!(found, ["a"]);
    std::fs::write(&file, text.replace("parent: a", "parent: c")).unwrap();
    // A mistake in it stops nothing else.
    common::sealed(&lab.session(0), 3);
    let done = refresh(&lab);
    let problem = done.prototypes_problem.unwrap();
    assert!(problem.contains("not declared"), "{problem}");
    assert_eq!(done.registered.len(), 1);
    let kept = column(&lab.file(), "SELECT count(*) FROM prototype");
    assert_eq!(kept, ["2"]);
    std::fs::remove_file(&file).unwrap();
    refresh(&lab);
    assert_eq!(column(&lab.file(), "SELECT count(*) FROM prototype"), ["0"]);
}
