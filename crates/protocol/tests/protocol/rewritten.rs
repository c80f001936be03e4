//! A protocol written again with its overrides.

use serde_json::Value;
use skinrig_protocol::{Protocol, protocol_with};

use crate::common::{parse, shipped};

/// Changes of several shapes: a number, a list, a text that looks like YAML, a key that the file lacks.
const CHANGES: [&str; 5] = [
    "depth=1.5 mm",
    "repetitions.count=2",
    "prototype.id=K7: \"left\" # 3, [old]",
    "evaluation.score=[2]",
    "scene.noise=2",
];

/// Everything but the text itself.
fn values(protocol: &Protocol) -> Value {
    let mut found = serde_json::to_value(protocol).unwrap();
    let map = found.as_object_mut().unwrap();
    assert!(map.remove("text").is_some() && map.remove("sha256").is_some());
    found
}

#[test]
fn every_shipped_protocol_written_again_is_the_same_protocol() {
    for name in [
        "demo.yaml",
        "paper.yaml",
        "circles.yaml",
        "depth-sweep.yaml",
        "other-skin.yaml",
        "own-outline.yaml",
        "own-cameras.yaml",
        "quick-check.yaml",
        "comparison.yaml",
        "paper-meander.yaml",
    ] {
        let text = shipped(name);
        let again = protocol_with(name, &text, &[]).unwrap();
        let (first, second) = (parse(&text, &[]).unwrap(), parse(&again, &[]).unwrap());
        assert_eq!(values(&first), values(&second), "{name}");
        assert_eq!(protocol_with(name, &again, &[]).unwrap(), again, "{name}");
    }
}

#[test]
fn overrides_become_lines_of_the_file() {
    let text = shipped("demo.yaml");
    let changes = CHANGES.map(str::to_owned);
    let again = protocol_with("demo.yaml", &text, &changes).unwrap();
    let mut set = parse(&text, &CHANGES).unwrap();
    set.overrides.clear();
    let written = parse(&again, &[]).unwrap();
    assert_eq!(values(&set), values(&written), "{again}");
    assert_eq!(written.prototype.id, "K7: \"left\" # 3, [old]");
}

#[test]
fn unknown_keys_and_broken_files_are_refused() {
    let unknown = protocol_with(
        "demo.yaml",
        &shipped("demo.yaml"),
        &["scene.nois=2".to_owned()],
    );
    assert!(unknown.unwrap_err().to_string().contains("did you mean"));
    assert!(protocol_with("demo.yaml", "a: [1,", &[]).is_err());
}
