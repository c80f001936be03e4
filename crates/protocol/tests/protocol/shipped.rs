//! The shipped protocols and schedules: they parse, their plans are safe and unchanged, their schema is current.

use serde_json::Value;

use crate::common::{folder, no_file, parse, shipped};
use crate::validate::validate;
use skinrig_protocol::{Protocol, Schedule, check, path_svg, schedule_schema_json, schema_json};

const PROTOCOLS: [&str; 10] = [
    "comparison",
    "other-skin",
    "own-cameras",
    "own-outline",
    "demo",
    "paper",
    "paper-meander",
    "circles",
    "depth-sweep",
    "quick-check",
];

#[test]
fn every_shipped_file_is_listed() {
    let mut names: Vec<String> = std::fs::read_dir(folder())
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .filter(|n| {
            n.ends_with(".yaml")
                && ![".schedule.yaml", ".limits.yaml"]
                    .iter()
                    .any(|e| n.ends_with(e))
        })
        .map(|n| n.trim_end_matches(".yaml").to_owned())
        .collect();
    names.sort();
    let mut known = PROTOCOLS.map(str::to_owned);
    known.sort();
    assert_eq!(names, known);
}

#[test]
fn plans_are_safe_and_unchanged() {
    for name in PROTOCOLS {
        let text = shipped(&format!("{name}.yaml"));
        assert!(
            text.starts_with("# yaml-language-server: $schema=./skinrig.schema.json\n"),
            "{name}"
        );
        let protocol = parse(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(protocol.name, name);
        let plan = protocol.compile();
        let violations = check(&plan, &protocol.surroundings, Some(protocol.motion.home));
        assert_eq!(violations, [], "{name}");
        let mut golden = format!("{}\ndigest    {}\n", plan.summary(), plan.digest());
        for step in plan.steps.iter().take(5) {
            golden.push_str(&serde_json::to_string(step).unwrap());
            golden.push('\n');
        }
        insta::assert_snapshot!(name, golden);
    }
}

#[test]
fn the_paper_campaign_matches_the_paper() {
    let protocol = parse(&shipped("paper-meander.yaml"), &[]).unwrap();
    let plan = protocol.compile();
    assert_eq!(plan.presses.len(), 2503);
    // 14 full lines of 17 and 12 more: the last location is the 12th of a line that runs up from y = ... backwards.
    let last = protocol.locations[249];
    assert_eq!((last.x_mm, last.y_mm), (34.0, 14.0 - 0.0));
    assert!((protocol.motion.period_s.unwrap() - 868.0 / 289.0).abs() < 1e-15);
    // 289 periods are exactly 868 s.
    let start = plan
        .steps
        .iter()
        .filter_map(|s| match s {
            skinrig_protocol::Step::Press(p) => p.start_after_begin,
            _ => None,
        })
        .nth(3 + 17)
        .unwrap();
    assert_eq!(start.0, 51_058_823_529); // 17 * 868 / 289 = 868 / 17 s
}

#[test]
fn the_schemas_on_disk_are_current() {
    let advice = "run `cargo run -p skinrig-protocol --example write_schema`";
    assert_eq!(shipped("skinrig.schema.json"), schema_json(), "{advice}");
    assert_eq!(
        shipped("skinrig-schedule.schema.json"),
        schedule_schema_json(),
        "{advice}"
    );
}

#[test]
fn schedules_parse() {
    for (name, presses, positions) in [
        ("paper-recording", 2893, 289),
        ("single-repetition", 292, 289),
        ("ten-presses", 13, 10),
    ] {
        let text = shipped(&format!("{name}.schedule.yaml"));
        assert!(
            text.starts_with("# yaml-language-server: $schema=./skinrig-schedule.schema.json\n")
        );
        let schedule =
            Schedule::parse(name, text.as_bytes(), &[]).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(schedule.name, name);
        let at = skinrig_model::Point2::new(0.0, 0.0);
        let (planned, times) = schedule.planned(&vec![at; positions]).unwrap();
        assert_eq!((planned.len(), times.len()), (presses, presses));
    }
}

#[test]
fn pictures_show_every_location() {
    let protocol = parse(&shipped("demo.yaml"), &[]).unwrap();
    let svg = path_svg(&protocol.compile(), &protocol.surroundings);
    for number in 1..=81 {
        assert!(svg.contains(&format!(">{number}</text>")), "{number}");
    }
    assert!(svg.contains("prefers-color-scheme: dark"));
}

#[test]
fn texts_and_hashes_are_kept_byte_for_byte() {
    let text = format!(
        "\u{feff}{}",
        shipped("quick-check.yaml").replace('\n', "\r\n")
    );
    let protocol = Protocol::parse("q.yaml", text.as_bytes(), &[], &no_file).unwrap();
    assert_eq!(protocol.text, text);
    let plain = parse(&shipped("quick-check.yaml"), &[]).unwrap();
    assert_ne!(protocol.sha256, plain.sha256);
    assert_eq!(protocol.compile(), plain.compile());
    assert_eq!(plain.sha256.len(), 64);
}

#[test]
fn shipped_files_fit_their_schemas() {
    for (schema, files) in [
        (
            schema_json(),
            PROTOCOLS.map(|n| format!("{n}.yaml")).to_vec(),
        ),
        (
            schedule_schema_json(),
            ["paper-recording", "single-repetition", "ten-presses"]
                .map(|n| format!("{n}.schedule.yaml"))
                .to_vec(),
        ),
    ] {
        let schema: Value = serde_json::from_str(&schema).unwrap();
        for file in files {
            let mut value: Value = {
                let options = serde_yaml::options! { strict_booleans: true };
                serde_yaml::from_str_with_options(&shipped(&file), options).unwrap()
            };
            validate(&schema, &value, &schema, &file).unwrap();
            value["prototype"]["colour"] = "grey".into();
            let error = validate(&schema, &value, &schema, &file).unwrap_err();
            assert!(error.ends_with("prototype.colour: unknown key"), "{error}");
        }
    }
}

/// The reader accepts every key of the schema and requires those that the schema requires.
#[test]
fn schema_and_reader_have_the_same_keys() {
    let schema: Value = serde_json::from_str(&schema_json()).unwrap();
    let expected = |text: &str| {
        let error = parse(text, &[]).unwrap_err();
        let unknown = error
            .list()
            .iter()
            .find(|d| d.message == "unknown key")
            .unwrap();
        unknown.expected.clone().unwrap()
    };
    for (table, text) in [
        ("", "nonsense: 1\n"),
        ("motion", "motion: {nonsense: 1}\n"),
        ("analysis", "analysis: {nonsense: 1}\n"),
        ("meander", "path: {meander: {nonsense: 1}}\n"),
        ("keep_out", "frame: {keep_outs: [{nonsense: 1}]}\n"),
        ("roi", "cameras: {camera1: {roi: {nonsense: 1}}}\n"),
    ] {
        let object = match table {
            "" => &schema,
            name => &schema["$defs"][name],
        };
        let message = expected(text);
        for key in object["properties"].as_object().unwrap().keys() {
            assert!(message.contains(&format!("`{key}`")), "{key}: {message}");
        }
        let count = object["properties"].as_object().unwrap().len();
        assert_eq!(message.matches('`').count(), 2 * count, "{message}");
    }
    let missing = parse("x: 1\n", &[]).unwrap_err();
    for key in schema["required"].as_array().unwrap() {
        let path = key.as_str().unwrap();
        assert!(missing.list().iter().any(|d| d.path == path), "{path}");
    }
}
