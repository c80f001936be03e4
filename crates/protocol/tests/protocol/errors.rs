//! Diagnostics of invalid protocols and schedules.

use crate::common::{parse, shipped};
use proptest::prelude::*;
use skinrig_protocol::{Protocol, Schedule};

#[test]
fn all_findings_of_a_file_at_once() {
    let text = include_str!("inputs/wrong.yaml");
    let error =
        Protocol::parse("wrong.yaml", text.as_bytes(), &[], &crate::common::no_file).unwrap_err();
    insta::assert_snapshot!("wrong", error.render(false));
}

/// Checks the diagnostic of the demo with one line replaced: location, message, and part of the rest.
fn finding(from: &str, to: &str, path: &str, message: &str, rest: &str) {
    let text = shipped("demo.yaml");
    assert!(text.contains(from), "{from}");
    let text = text.replacen(from, to, 1);
    let error = parse(&text, &[]).expect_err(&format!("{to} was accepted"));
    let found: Vec<_> = error
        .list()
        .iter()
        .filter(|d| d.path == path && d.message == message)
        .collect();
    assert_eq!(found.len(), 1, "{to}\n{error}");
    assert!(
        error
            .list()
            .iter()
            .all(|d| d.expected.is_some() && d.found.is_some()),
        "{error}"
    );
    assert!(
        error.to_string().contains(rest),
        "{rest} is missing\n{error}"
    );
    let line = 1 + text[..text.find(to.split('\n').next().unwrap()).unwrap()]
        .matches('\n')
        .count();
    let shown = &found[0].location;
    assert!(
        shown.line >= line && shown.line <= line + to.matches('\n').count() + 8,
        "{error}"
    );
    assert_eq!(text.lines().nth(shown.line - 1).unwrap(), shown.text);
}

#[test]
fn impossible_values_across_keys() {
    finding(
        "hold: 150 ms",
        "hold: 4 s",
        "motion.hold",
        "the hold is longer than the period",
        "`motion.period`, 3 s",
    );
    finding(
        "depth: 2 mm",
        "depth: 4 mm",
        "depth",
        "deeper than the limit allows",
        "at most 3 mm",
    );
    finding(
        "travel: 80 mm/s",
        "travel: 0.8 m/s",
        "motion.travel",
        "faster than the limit allows",
        "800 mm/s",
    );
    finding(
        "indent: 20 mm/s",
        "indent: 10 ms",
        "motion.indent",
        "faster than the limit allows",
        "200 mm/s",
    );
    finding(
        "period: 3 s",
        "period: 600 ms",
        "motion.period",
        "the presses do not fit into their time",
        "at least",
    );
    finding(
        "interval: 1 s",
        "interval: 500 ms",
        "sync.interval",
        "the presses do not fit into their time",
        "at least",
    );
    finding(
        "score: [2, 3]",
        "score: [2-4]",
        "evaluation.score",
        "there is no such repetition",
        "there are 3 repetitions",
    );
    finding(
        "score: [2, 3]",
        "score: [1, 2, 3]",
        "evaluation.score",
        "the repetition is given twice",
        "never score",
    );
    finding(
        "score: [2, 3]",
        "score: [2]",
        "evaluation",
        "repetitions without a purpose",
        "repetition 3",
    );
    finding(
        "calibrate: [1]\n  score: [2, 3]",
        "calibrate: [1-3]\n  score: []",
        "evaluation.score",
        "nothing is scored",
        "at least one",
    );
    finding(
        "calibrate: [1]\n  score: [2, 3]",
        "calibrate: []\n  score: [1-3]",
        "evaluation.calibrate",
        "nothing to calibrate with",
        "calibration: none",
    );
    finding(
        "score: [2, 3]",
        "score: [3-2]",
        "evaluation.score[0]",
        "not a number or span of numbers",
        "`3-2`",
    );
    finding(
        "needs: [event_rates, localisation, optical_error]",
        "needs: [latency]\n  level: geometric",
        "scene.level",
        "the level does not meet the needs of the scene",
        "`optical`",
    );
    finding(
        "needs: [event_rates, localisation, optical_error]",
        "tolerances: {event_rate: 1 %}\n  level: geometric",
        "scene.level",
        "the level does not meet the tolerances of the scene",
        "`event_rate: 1 %` of the optical one",
    );
    finding(
        "needs: [event_rates, localisation, optical_error]",
        "tolerances: {latency: 10 s}\n  level: kinematic",
        "scene.level",
        "the level does not meet the tolerances of the scene",
        "which has no events",
    );
    finding(
        "needs: [event_rates, localisation, optical_error]",
        "tolerances: {latency: 10 s}\n  level: geometric\n  cameras:\n    camera1: {position: [45 mm, -38 mm], half_field_of_view: 60 deg}\n    camera2: {position: [45 mm, 42 mm], half_field_of_view: 60 deg}",
        "scene.level",
        "the level does not meet the tolerances of the scene",
        "is not measured for other cameras",
    );
    finding(
        "needs: [event_rates, localisation, optical_error]",
        "tolerances: {}",
        "scene.tolerances",
        "a required key is missing",
        "at least one of `localisation_rmse`",
    );
    finding(
        "max: [60 mm, 52 mm, 30 mm]",
        "max: [60 mm, -52 mm, 30 mm]",
        "limits.workspace",
        "the workspace is empty",
        "in y",
    );
    finding(
        "marks: [contact, retract]",
        "marks: [contact, contact]",
        "triggers.marks[1]",
        "the mark is given twice",
        "contact",
    );
    finding(
        "hold: 150 ms",
        "hold: 150 ms\n  settle: {tolerance: 2 mm}",
        "motion.settle.tolerance",
        "the tolerance hides the press",
        "2 mm",
    );
    finding(
        "hold: 150 ms",
        "hold: 150 ms\n  home: [0 mm, 0 mm, 1 mm]",
        "motion.home",
        "home is below clearance height",
        "5 mm",
    );
    finding(
        "margin: 3 mm",
        "outline: {centre: [0 mm, 0 mm], width: 10 mm, height: 20 mm, radius: 6 mm}",
        "frame.outline",
        "the key is given twice",
        "line",
    );
}

/// A help that is another number than the author's would be worse than none.
#[test]
fn other_ways_to_write_a_number_get_no_wrong_help() {
    for (seed, help) in [
        ("0x10", None),
        ("1_000", None),
        ("1,000", None),
        ("3 presses", Some("write `3`")),
    ] {
        let text = shipped("demo.yaml").replacen("seed: 1\n", &format!("seed: {seed}\n"), 1);
        let error = parse(&text, &[]).unwrap_err();
        let found = &error.list()[0];
        assert_eq!(found.path, "seed", "{error}");
        match help {
            None => assert_eq!(found.help, None, "{error}"),
            Some(help) => assert!(found.help.as_ref().unwrap().contains(help), "{error}"),
        }
    }
}

#[test]
fn limits_are_written_as_they_were_set() {
    let set = ["analysis.window_after_contact=0 ms"];
    let error = parse(&shipped("demo.yaml"), &set).unwrap_err().to_string();
    assert!(error.contains("at least 0.000000001 s and"), "{error}");
}

#[test]
fn marks_must_not_overlap() {
    let error = parse(
        &shipped("demo.yaml"),
        &["triggers.marks=[at_depth, retract]", "motion.hold=13ms"],
    )
    .unwrap_err();
    assert!(error.to_string().contains("two marks overlap"), "{error}");
    assert!(
        parse(
            &shipped("demo.yaml"),
            &["triggers.marks=[at_depth, retract]", "motion.hold=15ms"]
        )
        .is_ok()
    );
}

#[test]
fn exactly_one_path() {
    finding(
        "path:\n  meander:",
        "path:\n  points: [[0 mm, 0 mm]]\n  meander:",
        "path.meander",
        "only one of these keys may be given",
        "`meander`, `circles`",
    );
    finding(
        "depth: 2 mm",
        "#",
        "",
        "a required key is missing",
        "exactly one of `depth` or `depths`",
    );
}

#[test]
fn a_misspelt_required_key_is_reported_once() {
    let text = shipped("demo.yaml").replace("operator:", "operater:");
    let error = parse(&text, &[]).unwrap_err();
    assert_eq!(error.list().len(), 1, "{error}");
    assert_eq!(
        error.list()[0].help.as_deref(),
        Some("did you mean `operator`?")
    );
}

#[test]
fn csv_findings_point_into_the_csv() {
    let text = shipped("demo.yaml");
    let from = text.find("  meander:").unwrap();
    let to = text.find("repetitions:").unwrap();
    let with = |csv: &'static [u8]| {
        let text = format!(
            "{}  csv: {{file: points.csv, unit: m}}\n{}",
            &text[..from],
            &text[to..]
        );
        Protocol::parse("lab/test.yaml", text.as_bytes(), &[], &move |path| {
            assert_eq!(path, std::path::Path::new("lab/points.csv"));
            Ok(csv.to_vec())
        })
    };
    let protocol = with(b"x,y,z\n-0.022,0.03,0\r\n0,0.001,0\n").unwrap();
    assert_eq!(protocol.locations.len(), 2);
    assert!((protocol.locations[0].x_mm + 22.0).abs() < 1e-12);
    let error = with(b"x,y,z\n0,abc,0\n,,\n0,NaN,0\n").unwrap_err();
    let found: Vec<_> = error
        .list()
        .iter()
        .map(|d| {
            (
                d.location.file.as_str(),
                d.location.line,
                d.message.as_str(),
            )
        })
        .collect();
    let file = "lab/points.csv";
    assert_eq!(
        found,
        [
            (file, 2, "row 1 is not a location"),
            (file, 3, "row 2 is blank"),
            (file, 4, "row 3 is not a location")
        ]
    );
    assert!(
        with(b"a,b\n1,2\n")
            .unwrap_err()
            .to_string()
            .contains("the column `x` is missing")
    );
    let doubled = with(b"x,y,x\n1,2,3\n").unwrap_err().to_string();
    assert!(doubled.contains("two columns are called `x`"), "{doubled}");
    assert!(with(b"x,y\n").is_err() && with(b"\xff\xfe").is_err());
    let missing = parse(
        &format!(
            "{}  csv: {{file: no.csv, unit: m}}\n{}",
            &text[..from],
            &text[to..]
        ),
        &[],
    );
    assert!(
        missing
            .unwrap_err()
            .to_string()
            .contains("the file cannot be read")
    );
}

#[test]
fn colour_only_when_asked_for() {
    let error = parse("skinrig: 2\n", &[]).unwrap_err();
    assert!(!error.render(false).contains('\u{1b}'));
    assert!(error.render(true).contains("\u{1b}[1m\u{1b}[31m"));
}

#[test]
fn overrides_change_one_value_and_are_kept() {
    let protocol = crate::common::demo(&[
        "path.meander.pitch=6mm",
        "order.shuffled.seed=3",
        "motion.period=3s",
        "operator=A. B: c",
    ]);
    assert_eq!(protocol.locations[1].y_mm - protocol.locations[0].y_mm, 6.0);
    assert_eq!(protocol.shuffle_seed, Some(3));
    assert_eq!(protocol.operator, "A. B: c");
    assert_eq!(protocol.overrides[0], "path.meander.pitch=6mm");
    assert_eq!(protocol.text, shipped("demo.yaml"));
    assert_eq!(protocol.sha256, crate::common::demo(&[]).sha256);
    assert_ne!(
        protocol.compile().digest(),
        crate::common::demo(&[]).compile().digest()
    );
    let error = parse(
        &shipped("demo.yaml"),
        &[
            "path.meander.pich=6mm",
            "motion.clearance=6",
            "sync.at.x=1 mm",
            "depth",
            "limits=[",
            "path.circles.centre=[0 mm, 0 mm]",
        ],
    )
    .unwrap_err();
    insta::assert_snapshot!("overrides", error.render(false));
}

#[test]
fn a_broken_limit_is_one_finding_at_its_key() {
    let protocol = crate::common::demo(&["path.meander.pitch=20mm"]);
    let plan = protocol.compile();
    let error = protocol.check(&plan).unwrap_err();
    let all = skinrig_protocol::check(&plan, &protocol.surroundings, None).len();
    assert!(all > 100 && error.list().len() < 6, "{all}: {error}");
    let mut observed = std::collections::BTreeSet::new();
    for d in error.list() {
        assert!(observed.insert((&d.message, &d.path)), "{error}");
        assert!(d.location.line > 1 && d.path == "path", "{error}");
    }
    assert!(
        crate::common::demo(&[])
            .check(&crate::common::demo(&[]).compile())
            .is_ok()
    );
}

#[test]
fn a_suspension_needs_room_between_its_levels() {
    let with = |levels: &str| {
        let text = shipped("demo.yaml");
        parse(&format!("{text}\nsuspend: {{disk_free: {levels}}}\n"), &[])
    };
    let suspend = with("{below: 5 GB, resume_above: 6 GB}").map(|p| p.suspend);
    let disk = suspend.as_ref().ok().and_then(|s| s.disk_free);
    assert!(
        disk.is_some_and(|d| d.is_beyond(4.9e9) && d.is_calm(6e9) && !d.is_calm(5.9e9)),
        "{suspend:?}"
    );
    let text = shipped("demo.yaml");
    let hot = |levels: &str| {
        parse(
            &format!("{text}\nsuspend: {{temperature: {levels}}}\n"),
            &[],
        )
    };
    let found = hot("{above: 60 °C, resume_below: 50 degC}").map(|p| p.suspend.temperature);
    let limit = found.as_ref().ok().copied().flatten();
    assert!(
        limit.is_some_and(|t| t.is_beyond(60.1) && t.is_calm(50.0) && t.lasting.0 == 2_000_000_000),
        "{found:?}"
    );
    for (levels, part) in [
        ("{above: 60 deg, resume_below: 50 degC}", "an angle"),
        ("{above: 60 degC, resume_below: 60 °C}", "not apart"),
        ("{above: 300 degC, resume_below: 60 °C}", "150"),
    ] {
        let error = hot(levels).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    for turned in [
        "{below: 6 GB, resume_above: 5 GB}",
        "{below: 5 GB, resume_above: 5 GB}",
    ] {
        let error = with(turned).unwrap_err();
        assert_eq!(error.list().len(), 1, "{error}");
        assert_eq!(error.list()[0].path, "suspend.disk_free", "{error}");
    }
}

#[test]
fn the_other_language_and_anchors_are_named_once() {
    let error = parse(&shipped("ten-presses.schedule.yaml"), &[]).unwrap_err();
    assert_eq!(error.list().len(), 1, "{error}");
    let error = Schedule::parse("x", shipped("demo.yaml").as_bytes(), &[]).unwrap_err();
    assert_eq!(error.list().len(), 1, "{error}");
    assert!(error.to_string().contains("this is not a schedule"));
    let anchored = shipped("demo.yaml").replacen("operator: ", "operator: &a ", 1);
    let error = parse(&anchored, &[]).unwrap_err();
    assert_eq!(error.list().len(), 1, "{error}");
    assert_eq!(error.list()[0].message, "anchors are not used here");
}

#[test]
fn schedules_report_the_same_way() {
    let text = shipped("paper-recording.schedule.yaml")
        .replace("presses_used: 250", "presses_used: 300")
        .replace("contact: -275 ms", "contact: -275")
        .replace("retract: 50 ms", "retract: 500 ms")
        .replace("unit: m", "unit: metre")
        .replace("period: 868 s / 289", "period: 868 s / 0");
    let error = Schedule::parse("recording.schedule.yaml", text.as_bytes(), &[]).unwrap_err();
    insta::assert_snapshot!("schedule", error.render(false));
}

#[test]
fn hostile_texts() {
    let deep = format!("a: {}{}", "[".repeat(5000), "]".repeat(5000));
    let deep_block: String = (0..1000)
        .map(|k| format!("{}a:\n", " ".repeat(k)))
        .collect();
    let laughs = "a: &a [x, x]\nb: &b [*a, *a]\nc: &c [*b, *b]\nskinrig: *c\n".to_owned();
    let many_keys: String = (0..100_000).map(|k| format!("k{k}: 1\n")).collect();
    let long_line = format!("name: {}\nskinrig: x", "y".repeat(3 << 20));
    let long_key = format!("{}: 1\n", "k".repeat(900));
    for (text, message) in [
        (String::new(), "the file is empty"),
        ("\u{feff}".to_owned(), "the file is empty"),
        ("# only a comment\r\n".to_owned(), "the file is empty"),
        ("- 1\n- 2\n".to_owned(), "expected a mapping"),
        ("skinrig: 1\n\tname: x\n".to_owned(), "not valid YAML"),
        (
            "skinrig: 1\n---\nskinrig: 1\n".to_owned(),
            "more than one YAML document",
        ),
        ("skinrig: !!int 1\n".to_owned(), "tags are not used here"),
        ("<<: {skinrig: 1}\n".to_owned(), "unknown key"),
        ("? [a, b]\n: 1\n".to_owned(), "a key must be a word"),
        ("name: [a, b\noperator: c\n".to_owned(), "not valid YAML"),
        ("name: \"a\u{0}b\"\n".to_owned(), "not valid YAML"),
        (deep, "not valid YAML"),
        (deep_block, "not valid YAML"),
        (laughs, "aliases are not used here"),
        (many_keys, "too many keys"),
        (long_line, "the value"),
        (long_key, "unknown key"),
    ] {
        let error = parse(&text, &[]).unwrap_err().to_string();
        let start: String = text.chars().take(30).collect();
        let missing = error.contains(message)
            || error.contains("not a whole number") && message == "the value";
        assert!(missing, "{start}: {error}");
        assert_eq!(
            error.matches("= expected").count(),
            error.matches("--> ").count()
        );
        assert_eq!(
            error.matches("= found").count(),
            error.matches("--> ").count()
        );
        assert!(error.len() < 100_000, "{start}: {} bytes", error.len());
    }
    for (bytes, message) in [
        (&b"name: a\noperator: \xff\n"[..], "byte 0xff"),
        (&b"\xff\xfes\0k\0"[..], "UTF-16"),
    ] {
        let error = Protocol::parse("x.yaml", bytes, &[], &crate::common::no_file).unwrap_err();
        assert!(error.to_string().contains(message), "{error}");
    }
    let huge = vec![b'#'; (4 << 20) + 1];
    let error = Protocol::parse("x.yaml", &huge, &[], &crate::common::no_file).unwrap_err();
    assert!(error.to_string().contains("too large"), "{error}");
}

proptest! {
    #[test]
    fn any_bytes_give_an_answer(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let _ = Protocol::parse("x.yaml", &bytes, &[], &crate::common::no_file);
        let _ = Schedule::parse("x.yaml", &bytes, &[]);
    }

    #[test]
    fn any_yaml_like_text_gives_an_answer(text in "([a-z]{1,8}|[-:{}\\[\\],#&*!|>'\"%@\t ]|\n|\r\n| {1,4}|[0-9.]{1,4}|é|mm|skinrig: 1\n|path:\n){0,60}") {
        let _ = parse(&text, &[]);
    }

    /// One damaged character anywhere in the demo: a result, and every finding lies inside the file.
    #[test]
    fn a_damaged_demo_gives_an_answer(at in any::<proptest::sample::Index>(), with in any::<char>()) {
        let text = shipped("demo.yaml");
        let mut letters: Vec<char> = text.chars().collect();
        let at = at.index(letters.len());
        letters[at] = with;
        let text: String = letters.into_iter().collect();
        match parse(&text, &[]) {
            Ok(protocol) => { let _ = protocol.compile(); }
            Err(error) => {
                prop_assert!(!error.list().is_empty());
                for d in error.list() {
                    prop_assert!(d.location.line >= 1 && d.location.line <= text.split('\n').count());
                    prop_assert!(d.location.column >= 1);
                    prop_assert!(d.expected.is_some() && d.found.is_some(), "{}", error);
                }
            }
        }
    }

    #[test]
    fn any_override_gives_an_answer(text in "(path|meander|depth|motion|sync|order)(\\.[a-z]{0,8}){0,3}=?[ -~]{0,12}") {
        let _ = parse(&shipped("demo.yaml"), &[&text]);
    }
}

#[test]
fn a_tab_is_reported_at_its_position() {
    let text = "skinrig: 1\nname: x\n\tpath: 3\n";
    let error = parse(text, &[]).unwrap_err();
    let place = &error.list()[0];
    assert_eq!(
        (place.location.line, place.location.column),
        (3, 1),
        "{error}"
    );
    assert!(
        place
            .help
            .as_deref()
            .unwrap()
            .starts_with("indent with spaces"),
        "{error}"
    );
}

#[test]
fn an_alias_is_reported_once() {
    let text = shipped("demo.yaml");
    let from = "operator:";
    let line = text.lines().find(|l| l.starts_with(from));
    let line = line.unwrap_or_else(|| panic!("the demo has no line `{from}`"));
    let text = text.replacen(line, "operator: *someone", 1);
    let error = parse(&text, &[]).unwrap_err();
    let message: Vec<&str> = error.list().iter().map(|d| d.message.as_str()).collect();
    assert_eq!(message, ["aliases are not used here"]);
}
