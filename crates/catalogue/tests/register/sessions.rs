//! Registering sessions: the same rows as in the files, once, and what is stale.

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
            "scored": {{"rmse_mm": {{"value": {rmse_mm}, "low": 1.0, "high": 2.0, "n": 8}}}}}},
          "provenance": {{"session_id": "{session_id}", "content_sha256": "{content}", "results_hash": "abc", "variant": {variant}}},
          "summary": {{}}, "valid": true}}"#
    )
}

#[test]
fn a_session_is_registered_as_it_is_in_its_file_and_once() {
    let lab = Lab::with_sessions(2);
    let reader = SessionReader::open(lab.session(1)).unwrap();
    let id = reader.session_id().unwrap();
    std::fs::write(
        lab.path().join("1.results.json"),
        results(&reader, 1.5, None),
    )
    .unwrap();
    let variant = lab.path().join("1.analysis-bin=2px.results.json");
    std::fs::write(variant, results(&reader, 1.25, Some("bin=2px"))).unwrap();
    annotate(
        &lab.session(1),
        &Annotation {
            session_id: id.clone(),
            at: "2026-11-21T00:00:00Z".into(),
            by: "Ann".into(),
            add: vec!["wet".into()],
            remove: Vec::new(),
            note: Some("lamp".into()),
        },
    )
    .unwrap();

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
    std::fs::write(lab.path().join("0.results.json"), older).unwrap();
    lab.open().register(&[lab.session(0)]).unwrap();
    let sql = "SELECT rmse_mm, problem FROM analysis";
    let expected = "rmse_mm=null|problem=the results are older than the session: analyze it again";
    assert_eq!(rows(&lab.file(), sql), [expected]);
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
