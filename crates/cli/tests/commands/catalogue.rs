//! Contents of a sessions folder: prototypes, tags, remarks.

use serde_json::Value;

use crate::support::{Lab, SMALL, files, only, skinrig, text};

#[test]
fn sessions_are_found_by_prototype_and_by_tag_and_their_trend_is_shown() {
    let lab = Lab::new();
    let s = lab.text("s");
    // Two sessions of one skin, one of another without results.
    for seed in ["1", "2"] {
        skinrig(&["run", SMALL, "--sessions", &s, "--seed", seed]).code(0);
    }
    let [a, b] = ["--no-analysis", "prototype.id=skin B"];
    skinrig(&["run", SMALL, "--sessions", &s, a, "--set", b]).code(0);
    let other = only(&lab.path("s"), "-skin-b.session.sqlite");
    let first = &files(&lab.path("s"), "-test-skin.session.sqlite")[0];

    let before = std::fs::read(first).unwrap();
    let tags = ["tag", &text(first), "good-skin", "wet", "--by", "Ann"];
    skinrig(&tags).code(0);
    let more = ["tag", &text(first), "-wet", "--note", "the lamp was new"];
    let output = skinrig(&more).code(0).out;
    assert!(
        output.contains("tags  good-skin\n") && output.contains("the lamp was new"),
        "{output}"
    );
    skinrig(&["tag", &text(first), "Good Skin"]).code(2);
    // The session file is unchanged.
    assert!(before == std::fs::read(first).unwrap());
    skinrig(&["verify", &text(first)]).code(0);

    let list = |more: &[&str]| -> Value {
        skinrig(&[&["sessions", &s, "--json"], more].concat())
            .code(0)
            .json()
    };
    assert_eq!(list(&[]).as_array().unwrap().len(), 3);
    let tagged = list(&["--tag", "good-skin"]);
    assert_eq!(tagged[0]["path"], text(first).as_str());
    assert_eq!(tagged[0]["state"]["notes"][0]["text"], "the lamp was new");
    assert_eq!(tagged.as_array().unwrap().len(), 1);
    assert_eq!(
        list(&["--tag", "good-skin", "--tag", "wet"]),
        Value::Array(vec![])
    );
    let of_b = list(&["--prototype", "skin B"]);
    assert_eq!(of_b[0]["path"], text(&other).as_str());
    let words = skinrig(&["sessions", &s]).code(0).out;
    assert!(words.contains("[good-skin]  1 note(s)"), "{words}");

    let prototypes = skinrig(&["prototypes", &s, "--json"]).code(0).json();
    let [b, small] = [0, 1].map(|i| prototypes[i].clone());
    assert_eq!(
        (&b["prototype"], &b["sessions"]),
        (&"skin B".into(), &1.into())
    );
    assert_eq!(b["series"][0]["points"][0]["without"], "not analysed");
    assert_eq!(
        (&small["prototype"], &small["sessions"]),
        (&"test skin".into(), &2.into())
    );
    let series = &small["series"][0];
    let rmse = |point: &Value| point["value"].as_f64().unwrap();
    for (i, point) in series["points"].as_array().unwrap().iter().enumerate() {
        let results = point["session"].as_str().unwrap();
        let results = results.replace(".session.sqlite", ".results.json");
        let results = crate::support::read_json(results.as_ref());
        assert_eq!(
            point["rmse_mm"], results["analysis"]["scored"]["rmse_mm"],
            "{i}"
        );
        assert!(rmse(&series["best"]) <= rmse(&point["rmse_mm"]), "{series}");
    }
    assert_eq!(series["last"], series["points"][1]["rmse_mm"]);
    let words = skinrig(&["prototypes", &s, "--prototype", "test skin"])
        .code(0)
        .out;
    for word in ["test skin", "small.yaml", " to ", "[good-skin]"] {
        assert!(words.contains(word), "{word} in {words}");
    }
    skinrig(&["prototypes", &s, "--prototype", "skin C"])
        .code(2)
        .expect_stderr(&["skin C", "skin B, test skin"]);

    // A broken tag log is reported; its session is still listed.
    let log = only(&lab.path("s"), ".tags.jsonl");
    std::fs::write(&log, "good-skin\n").unwrap();
    let words = skinrig(&["sessions", &s]).code(0).out;
    assert!(
        words.contains("tags unreadable") && words.contains("line 1"),
        "{words}"
    );
    skinrig(&["tag", &text(first), "more"])
        .code(2)
        .expect_stderr(&["line 1"]);
}
