//! Lists of sessions are the same with a catalogue, without one, and with one that cannot be used.

use std::path::Path;

use serde_json::Value;
use skinrig::library::Program;
use skinrig_recorder::salvage;
use skinrig_view::Lab as _;
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Executor};

use crate::support::{Lab, SMALL, files, only, skinrig, text};

/// A folder with sessions of every kind; returns the name of a variant.
fn fill(lab: &Lab) -> &'static str {
    let s = lab.text("s");
    for seed in ["1", "2"] {
        skinrig(&["run", SMALL, "--sessions", &s, "--seed", seed]).code(0);
    }
    let other = ["--set", "prototype.id=skin B", "--seed", "3"];
    skinrig(&[&["run", SMALL, "--sessions", &s][..], &other].concat()).code(0);
    let none = ["--no-analysis", "--set", "prototype.id=skin C"];
    skinrig(&[&["run", SMALL, "--sessions", &s][..], &none].concat()).code(0);
    let [first, second] = of_test_skin(lab);
    let variant = ["--set", "analysis.min_samples=6", "--name", "six"];
    skinrig(&[&["analyze", &first][..], &variant].concat()).code(0);
    skinrig(&["tag", &first, "--note", "two\nlines"])
        .code(2)
        .expect_stderr(&["no control characters", "nothing was written"]);
    skinrig(&["tag", &first, "wet", "--note", "lamp", "--by", "Ann"]).code(0);
    // Results that cannot be used: those of another session.
    let results = |session: &str| session.replace(".session.sqlite", ".results.json");
    let third = text(&only(&lab.path("s"), "-skin-b.session.sqlite"));
    std::fs::copy(
        results(&third),
        results(&second).replace(".results", ".analysis-x.results"),
    )
    .unwrap();
    // A copy, a broken file and an empty one.
    salvage(first.as_ref(), &lab.path("s/copy-of-one.session.sqlite")).unwrap();
    std::fs::write(lab.path("s/broken.session.sqlite"), "no session").unwrap();
    std::fs::write(lab.path("s/empty.session.sqlite"), "").unwrap();
    "six"
}

/// The two sessions of the test skin. If they began in the same second, their names differ by a number at the end.
fn of_test_skin(lab: &Lab) -> [String; 2] {
    let mut own = files(&lab.path("s"), ".session.sqlite");
    own.retain(|file| text(file).contains("-test-skin"));
    [0, 1].map(|at| text(&own[at]))
}

/// The answers of every command that lists a folder, as JSON, and what they say on standard error.
fn answers(lab: &Lab, variant: &str) -> (Vec<Value>, String) {
    let s = lab.text("s");
    let page = lab.text("comparison.html");
    let lists: [&[&str]; 8] = [
        &["sessions", &s],
        &["sessions", &s, "--prototype", "test skin"],
        &["sessions", &s, "--tag", "wet"],
        &["prototypes", &s],
        &["prototypes", &s, "--prototype", "skin C"],
        &["prototypes", &s, "--analysis", variant],
        &[
            "compare",
            "test skin",
            "skin B",
            "--sessions",
            &s,
            "--out",
            &page,
        ],
        &[
            "compare",
            "skin B",
            "test skin",
            "--sessions",
            &s,
            "--out",
            &page,
        ],
    ];
    let mut errors = String::new();
    let all = lists.map(|words| {
        let output = skinrig(&[words, &["--json"]].concat()).code(0);
        errors += &output.err;
        output.json()
    });
    (all.to_vec(), errors)
}

fn remove_catalogue(file: &Path) {
    for ending in ["", "-wal", "-shm"] {
        let _ = std::fs::remove_file(format!("{}{ending}", file.display()));
    }
}

#[test]
fn a_catalogue_changes_no_answer() {
    let lab = Lab::new();
    let variant = fill(&lab);
    let (s, file) = (lab.text("s"), lab.path("s/catalogue.sqlite"));
    remove_catalogue(&file);
    let (expected, errors) = answers(&lab, variant);
    let shelf = || Program.shelf(&lab.path("s")).unwrap();
    let shelf_of_files = shelf();
    assert!(!errors.contains("catalogue"), "{errors}");
    assert_eq!(expected[0].as_array().unwrap().len(), 7);
    assert_eq!(expected[1].as_array().unwrap().len(), 3);

    skinrig(&["catalogue", "rebuild", &s]).code(0);
    let (found, errors) = answers(&lab, variant);
    assert!(found == expected, "{found:#?} {expected:#?}");
    assert!(!errors.contains("catalogue"), "{errors}");
    assert_eq!(shelf(), shelf_of_files);
    assert!(shelf_of_files.iter().any(|s| s.analyses.len() == 2));

    // Stale entries: a tag and results that came since, beside the catalogue's back.
    let before = std::fs::read(&file).unwrap();
    let [_, second] = of_test_skin(&lab);
    skinrig(&["tag", &second, "wet"]).code(0);
    let third = only(&lab.path("s"), "-skin-c.session.sqlite");
    skinrig(&["analyze", &text(&third)]).code(0);
    remove_catalogue(&file);
    let (expected, _) = answers(&lab, variant);
    std::fs::write(&file, before).unwrap();
    let (found, errors) = answers(&lab, variant);
    assert!(found == expected, "{found:#?} {expected:#?}");
    assert!(!errors.contains("catalogue"), "{errors}");
    assert_eq!(expected[2].as_array().unwrap().len(), 2, "the new tag");

    // Deleted files are not listed, and named.
    std::fs::remove_file(&third).unwrap();
    let (found, errors) = answers_without_c(&lab);
    assert_eq!(found[0].as_array().unwrap().len(), 6);
    let next = format!("`skinrig catalogue register {s}` forgets them");
    let name = third.file_name().unwrap().to_string_lossy().into_owned();
    assert!(errors.contains(&name) && errors.contains(&next), "{errors}");
    skinrig(&["catalogue", "register", &s]).code(0);
    let (again, errors) = answers_without_c(&lab);
    assert!(again == found && !errors.contains("catalogue"), "{errors}");

    cannot_be_used(&lab, &file, &found);
}

/// A copy of a sealed session that was edited does not take the place of the sound one, and one without a seal is not ranked.
#[test]
fn sessions_that_may_have_been_edited_are_not_ranked() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    skinrig(&["analyze", &session]).code(0);
    let best = || {
        let output = skinrig(&["prototypes", &lab.text("s"), "--json"]).code(0);
        (output.json()[0]["series"][0].clone(), output.err)
    };
    let (sound, _) = best();
    assert!(sound["best"]["value"].is_number(), "{sound}");
    let bytes = std::fs::read(&session).unwrap();
    let edited = |path: &str, statement: &'static str| {
        std::fs::write(path, &bytes).unwrap();
        crate::catalogue::change(path.as_ref(), statement);
    };
    let copy = lab.text("s/a.session.sqlite");
    edited(
        &copy,
        "UPDATE attempt SET measured_x_mm = measured_x_mm + 1",
    );
    let (found, told) = best();
    assert_eq!(found["best"], sound["best"], "{found}");
    assert!(told.contains("that was changed"), "{told}");

    std::fs::remove_file(&copy).unwrap();
    std::fs::remove_file(&session).unwrap();
    edited(&session, "DELETE FROM seal");
    skinrig(&["analyze", &session]).code(0);
    let (found, _) = best();
    assert!(found["best"].is_null(), "{found}");
    assert_eq!(found["points"][0]["without"], "not sealed");
}

#[test]
fn the_error_of_the_few_easy_presses_ranks_no_prototype() {
    let lab = Lab::new();
    let lost = [
        "analysis.min_cluster_events=5500",
        "analysis.cluster_threshold=fixed",
    ];
    let lost = [
        "--set",
        lost[0],
        "--set",
        lost[1],
        "--set",
        "repetitions.count=4",
    ];
    let scored = ["--set", "evaluation.score=[1-4]"];
    let session = lab.record("s", &[&lost[..], &scored].concat());
    skinrig(&["analyze", &text(&session)]).code(0);
    let series = || {
        skinrig(&["prototypes", &lab.text("s"), "--json"])
            .code(0)
            .json()[0]["series"][0]
            .clone()
    };
    let with_catalogue = series();
    let without = with_catalogue["points"][0]["without"].as_str().unwrap();
    assert!(
        without.starts_with("only ") && without.ends_with("of presses located"),
        "{without}"
    );
    assert!(with_catalogue["best"].is_null());
    skinrig(&["prototypes", &lab.text("s")])
        .code(0)
        .expect_stderr(&["1 of 1 sessions are in no RMSE", "--prototype 'test skin'"]);
    std::fs::remove_file(lab.path("s/catalogue.sqlite")).unwrap();
    assert_eq!(series(), with_catalogue);
}

/// The lists that need no session of `skin C`.
fn answers_without_c(lab: &Lab) -> (Vec<Value>, String) {
    let s = lab.text("s");
    let lists: [&[&str]; 2] = [&["sessions", &s], &["prototypes", &s]];
    let mut errors = String::new();
    let all = lists.map(|words| {
        let output = skinrig(&[words, &["--json"]].concat()).code(0);
        errors += &output.err;
        output.json()
    });
    (all.to_vec(), errors)
}

/// Broken, foreign, of another schema, without a table, in use: the same answers, what is wrong, and a next step that works.
fn cannot_be_used(lab: &Lab, file: &Path, expected: &[Value]) {
    let s = lab.text("s");
    let good = std::fs::read(file).unwrap();
    let damaged = [&good[..108], &vec![0x55; good.len() - 108]].concat();
    for (bytes, statement, parts) in [
        (
            b"not a catalogue".to_vec(),
            None,
            ["not SQLite", "move it away"],
        ),
        (damaged, None, ["damaged", "delete it"]),
        (
            good.clone(),
            Some("DROP TABLE tag"),
            ["no such table", "next: delete "],
        ),
        (
            good.clone(),
            Some("UPDATE _sqlx_migrations SET version = version - 1"),
            ["expected schema", "skinrig catalogue rebuild"],
        ),
    ] {
        remove_catalogue(file);
        std::fs::write(file, bytes).unwrap();
        if let Some(sql) = statement {
            crate::catalogue::change(file, sql);
        }
        let (found, errors) = answers_without_c(lab);
        assert!(found == expected, "{parts:?}: {found:#?}");
        for part in parts
            .iter()
            .chain(&["read from their files", "skinrig catalogue rebuild"])
        {
            assert!(errors.contains(part), "{part}: {errors}");
        }
    }
    remove_catalogue(file);
    skinrig(&["catalogue", "rebuild", &s]).code(0);
    // In use by a program that keeps it for itself.
    let runtime = tokio::runtime::Builder::new_current_thread()
        .build()
        .unwrap();
    let options = SqliteConnectOptions::new().filename(file);
    let mut other = runtime.block_on(options.connect()).unwrap();
    for sql in [
        "PRAGMA locking_mode = EXCLUSIVE",
        "BEGIN EXCLUSIVE",
        "UPDATE tag SET tag = tag",
    ] {
        runtime.block_on(other.execute(sql)).unwrap();
    }
    let (found, errors) = answers_without_c(lab);
    assert!(found == expected, "{found:#?}");
    assert!(errors.contains("read from their files"), "{errors}");
}

/// Files whose entries are current are not opened: what is in them by now does not matter while size and time are the same.
#[test]
fn files_with_current_entries_are_not_opened() {
    let lab = Lab::new();
    let s = lab.text("s");
    for seed in ["1", "2"] {
        skinrig(&["run", SMALL, "--sessions", &s, "--seed", seed]).code(0);
    }
    let (expected, errors) = answers_without_c(&lab);
    assert_eq!(errors, "");
    let all = [
        files(&lab.path("s"), ".session.sqlite"),
        files(&lab.path("s"), ".results.json"),
    ]
    .concat();
    for path in &all {
        let size = std::fs::metadata(path).unwrap();
        std::fs::write(path, vec![0; size.len() as usize]).unwrap();
        let file = std::fs::File::options().write(true).open(path).unwrap();
        file.set_modified(size.modified().unwrap()).unwrap();
    }
    assert_eq!(all.len(), 4);
    let (found, errors) = answers_without_c(&lab);
    assert!(
        found == expected && errors.is_empty(),
        "{found:#?} {errors}"
    );
    // One nanosecond later it is another file.
    let file = std::fs::File::options().write(true).open(&all[0]).unwrap();
    let seen = file.metadata().unwrap().modified().unwrap();
    file.set_modified(seen + std::time::Duration::from_nanos(1))
        .unwrap();
    let (found, _) = answers_without_c(&lab);
    assert_eq!(found[0][1]["state"]["state"], "broken", "{found:#?}");
}
