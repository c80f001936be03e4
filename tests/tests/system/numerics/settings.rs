//! The analysis accepts every `analysis` value that a protocol accepts: every key, over its range and beyond.

use std::sync::OnceLock;

use proptest::prelude::*;
use serde_json::Value;
use skinrig_analysis::check;
use skinrig_protocol::{Protocol, schema_json};

const PROTOCOL: &[u8] = include_bytes!("../../../../protocols/demo.yaml");

/// Numbers around every possible limit of a setting, and far beyond.
const LADDER: [&str; 30] = [
    "-1",
    "0",
    "1e-300",
    "1e-9",
    "1e-6",
    "0.001",
    "0.01",
    "0.1",
    "0.5",
    "0.85",
    "0.999",
    "1",
    "1.01",
    "2",
    "3",
    "8",
    "16",
    "20",
    "50",
    "479",
    "480",
    "1000",
    "1024",
    "100000",
    "1000000",
    "1048576",
    "10000001",
    "4294967296",
    "1e15",
    "1e300",
];

/// A key below `analysis` and candidate values in `--set` syntax.
#[derive(Debug)]
struct Key {
    name: String,
    values: Vec<String>,
}

fn keys() -> Vec<Key> {
    let schema: Value = serde_json::from_str(&schema_json()).unwrap();
    let mut found = Vec::new();
    let analysis = &schema["properties"]["analysis"];
    collect_keys(&schema, analysis, "analysis", &mut found);
    found
}

/// Keys at and below `node`, whose path is `name`.
fn collect_keys(schema: &Value, node: &Value, name: &str, found: &mut Vec<Key>) {
    let node = match node["$ref"].as_str() {
        Some(place) => schema.pointer(place.trim_start_matches('#')).unwrap(),
        None => node,
    };
    if let Some(below) = node["properties"].as_object() {
        for (key, node) in below {
            collect_keys(schema, node, &format!("{name}.{key}"), found);
        }
        return;
    }
    found.push(Key {
        name: name.to_owned(),
        values: values(node),
    });
}

fn values(node: &Value) -> Vec<String> {
    if let Some(words) = node["oneOf"].as_array() {
        let words = words.iter().filter_map(|w| w["const"].as_str());
        return words.map(str::to_owned).collect();
    }
    match node["type"].as_str() {
        Some("boolean") => vec!["true".to_owned(), "false".to_owned()],
        Some("array") => {
            let each = values(&node["items"]);
            let pairs = each
                .iter()
                .zip(each.iter().skip(1))
                .chain(each.iter().zip(&each));
            pairs.map(|(a, b)| format!("[{a}, {b}]")).collect()
        }
        Some("string") => {
            let example = node["examples"][0].as_str().unwrap_or_default();
            let unit = example.trim_start_matches(|c: char| !c.is_alphabetic());
            LADDER.iter().map(|n| format!("{n} {unit}")).collect()
        }
        Some("number" | "integer") => LADDER.map(str::to_owned).to_vec(),
        _ => Vec::new(),
    }
}

/// Parses like the protocol of a recording, which also accepts keys of earlier versions. `Ok(false)` if the protocol is
/// rejected, `Ok(true)` if protocol and analysis accept the settings.
fn is_accepted(overrides: &[String]) -> Result<bool, String> {
    let no_files =
        |_: &std::path::Path| -> std::io::Result<Vec<u8>> { unreachable!("no file is named") };
    let Ok(protocol) = Protocol::parse_recorded("demo.yaml", PROTOCOL, overrides, &no_files) else {
        return Ok(false);
    };
    match check::settings(&protocol.analysis) {
        Ok(()) => Ok(true),
        Err(e) => Err(format!("{overrides:?} is taken, then refused: {e}")),
    }
}

fn single_key(key: &Key, value: &str) -> String {
    format!("{}={value}", key.name)
}

#[test]
fn every_value_that_a_protocol_takes() {
    let (mut takes, mut refuses, mut wrong) = (0, 0, Vec::new());
    let keys = keys();
    for key in &keys {
        let before = takes;
        for value in &key.values {
            match is_accepted(&[single_key(key, value)]) {
                Ok(true) => takes += 1,
                Ok(false) => refuses += 1,
                Err(e) => wrong.push(e),
            }
        }
        assert!(
            takes > before,
            "{}: no value is taken, so nothing was tried",
            key.name
        );
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // All keys are covered, and the values exceed every range.
    assert!(
        keys.len() > 60 && refuses > 500,
        "{} keys, {takes} taken, {refuses} refused",
        keys.len()
    );
}

/// Accepted values of a key, as overrides.
fn valid_values(key: &Key) -> Vec<String> {
    let all = key.values.iter().map(|v| single_key(key, v));
    all.filter(|o| is_accepted(std::slice::from_ref(o)) == Ok(true))
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Two to five settings may contradict each other although each alone is valid.
    #[test]
    fn values_that_a_protocol_takes_together(
        chosen in prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 2..6),
    ) {
        static VALID: OnceLock<Vec<Vec<String>>> = OnceLock::new();
        let values = VALID.get_or_init(|| keys().iter().map(valid_values).collect());
        let overrides: Vec<String> = chosen
            .iter()
            .map(|(key, value)| value.get::<String>(key.get::<Vec<String>>(values)).clone())
            .collect();
        if let Err(wrong) = is_accepted(&overrides) {
            return Err(TestCaseError::fail(wrong));
        }
    }
}
