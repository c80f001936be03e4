//! `skinrig scene check`: sessions and RAW files side by side, and what it refuses.

use crate::support::{Lab, SMALL, only, skinrig, text};

#[test]
fn recordings_stand_side_by_side() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    // The stream of the first camera as a RAW file is the same recording.
    let folder = lab.text("raw");
    skinrig(&["export", &session, "--to", "raw", "--out", &folder]).code(0);
    let raw = text(&only(&lab.path("raw"), ".camera1.raw"));
    let page = lab.text("check.html");
    let arguments = ["scene", "check", &session, &raw, "--out", &page];
    let found = skinrig(&[&["--json"], &arguments[..]].concat())
        .code(0)
        .json();
    let rows = found["recordings"].as_array().unwrap();
    let (camera, alone) = (&rows[0]["cameras"][0], &rows[1]["cameras"][0]);
    for key in [
        "events",
        "on_share",
        "intervals",
        "pixels",
        "correlation",
        "dispersion",
    ] {
        assert_eq!(camera[key], alone[key], "{key}");
        assert!(!camera[key].is_null(), "{key}");
    }
    // Only a session knows its presses. In this scene a dent darkens the skin, and a lift brightens it again.
    assert!(alone["polarity"].is_null());
    let polarity = &camera["polarity"];
    let share = |key: &str| polarity[key].as_f64().unwrap();
    assert!(share("on_at_press") < 0.4, "{polarity}");
    assert!(share("on_at_lift") > 0.6, "{polarity}");
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(html.contains("Events around an event") && html.contains("simulated"));

    let told = skinrig(&arguments).code(0).out;
    assert!(
        told.contains("A camera 1") && told.contains("check.html"),
        "{told}"
    );
}

#[test]
fn too_many_and_other_files_are_refused() {
    let lab = Lab::new();
    let other = lab.text("notes.txt");
    std::fs::write(&other, "notes").unwrap();
    skinrig(&["scene", "check", &other])
        .code(2)
        .expect_stderr(&[
            "expected a session or a Prophesee RAW file",
            "next: `skinrig import`",
        ]);
    // Bytes that are no events.
    let raw = lab.path("noise.raw");
    let mut bytes = b"% evt 2.0\n% end\n".to_vec();
    let mut state = 1u64;
    for _ in 0..100_000 {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        bytes.extend(((state >> 32) as u32).to_le_bytes());
    }
    std::fs::write(&raw, &bytes).unwrap();
    skinrig(&["scene", "check", &text(&raw)])
        .code(2)
        .expect_stderr(&["expected a stream of events", "next: `skinrig inspect`"]);
    // A file that ends within a word, and has lost words: its statistics say so.
    let word = |kind: u32, rest: u32| ((kind << 28) | rest).to_le_bytes();
    let mut bytes = b"% evt 2.0\n% end\n".to_vec();
    for time in 0..200 {
        bytes.extend(word(8, if time < 100 { time + 100 } else { time }));
        for at in 0..20 {
            bytes.extend(word(1, ((at % 60) << 22) | ((at * 7) << 11) | (at * 5)));
        }
    }
    bytes.extend([1, 2]);
    std::fs::write(&raw, &bytes).unwrap();
    let told = skinrig(&["scene", "check", &text(&raw)]).code(0).out;
    assert!(
        told.contains("the stream has jumps of the time base (1), bytes of an unfinished word (2)"),
        "{told}"
    );
    let page = lab.text("check.html");
    let five = vec![other.as_str(); 5];
    skinrig(&[&["scene", "check", "--out", &page][..], &five].concat())
        .code(2)
        .expect_stderr(&["expected at most 4 recordings for a page, found 5"]);
}

#[test]
fn a_session_is_like_its_scene_and_unlike_another_one() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &["--level", "optical"]));
    let own = [
        "scene",
        "predict",
        &session,
        "--replicates",
        "8",
        "--seed",
        "100",
    ];
    let out = skinrig(&own).code(0).out;
    assert!(out.contains("as predicted"), "{out}");
    assert!(out.lines().count() <= 12, "{out}");
    let out = skinrig(&[&own[..], &["-v"]].concat()).code(0).out;
    assert!(out.contains("events of a press (kev/s)"), "{out}");

    // A skin that returns three times the light is another one; the report of the session then says so.
    let change = "scene.skin.flank_brightness=6";
    let found = skinrig(&[&["--json"], &own[..], &["--set", change]].concat())
        .code(0)
        .json();
    let figures = found["prediction"]["figures"].as_array().unwrap();
    let p = |name: &str| {
        let row = figures.iter().find(|row| row["figure"] == name).unwrap();
        row["predicted"]["p"].as_f64().unwrap()
    };
    assert!(p("press_rate") < 0.05, "{found}");
    assert_eq!(found["prediction"]["seeds"].as_array().unwrap().len(), 8);
    skinrig(&["analyze", &session]).code(0);
    let page = std::fs::read_to_string(only(&lab.path("s"), ".report.html")).unwrap();
    assert!(page.contains("Fewer events at presses than modelled"));
    assert!(page.contains(change));

    // Results of another session, or changed ones, are told and not shown.
    let results = only(&lab.path("s"), ".scene.json");
    let changed = std::fs::read_to_string(&results).unwrap();
    std::fs::write(&results, changed.replace("press_rate", "idle_rate")).unwrap();
    skinrig(&["analyze", &session]).code(0);
    let page = std::fs::read_to_string(only(&lab.path("s"), ".report.html")).unwrap();
    assert!(page.contains("skinrig scene predict` rewrites it"));
}

#[test]
fn what_cannot_be_predicted_is_refused() {
    let lab = Lab::new();
    let session = text(&lab.record("s", &[]));
    let predict = |more: &[&str]| skinrig(&[&["scene", "predict", &session], more].concat());
    predict(&["--replicates", "7"])
        .code(2)
        .expect_stderr(&["--replicates"]);
    predict(&["--set", "scene.skin.creep=soft"])
        .code(2)
        .expect_stderr(&["scene.skin.creep"]);
    predict(&["--sessions", "no/such/folder"])
        .code(2)
        .expect_stderr(&["no/such/folder", "--sessions names another folder"]);
    predict(&["--level", "kinematic", "--replicates", "8"])
        .code(2)
        .expect_stderr(&["expected at least 8 simulated sessions that can be analysed"]);

    // The first press after a break follows sync presses, not the one before it in the plan.
    let folder = lab.text("broken");
    let fault = ["--fault", "disk-full@press:5", "--sessions", &folder];
    skinrig(&[&["run", SMALL], &fault[..]].concat()).code(3);
    let broken = text(&only(&lab.path("broken"), ".session.sqlite"));
    let predicted = || skinrig(&["scene", "predict", &broken]).code(2);
    predicted().expect_stderr(&["ran through", "without an end"]);
    skinrig(&["resume", &broken]).code(0);
    predicted().expect_stderr(&["ran through", "2 legs: it was resumed"]);
}
