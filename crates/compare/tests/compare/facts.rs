//! Facts of sessions: their text, and the differences between two sessions.

use serde_json::json;
use skinrig_compare::{SessionFacts, fact_differences, flatten};

#[test]
fn values_are_flattened_to_short_texts() {
    let value = json!({
        "text": "slow", "none": null, "flag": true, "whole": 12, "short": 0.25, "tiny": 0.001_234_567_89,
        "long": 12.345_678_9, "list": [1.0, 2.5, "x"], "rows": [{"a": 1}, {"a": 2}],
    });
    let mut facts = Vec::new();
    flatten("p", &value, &mut facts);
    let facts: Vec<(&str, &str)> = facts.iter().map(|(k, v)| (&**k, &**v)).collect();
    assert_eq!(
        facts,
        [
            ("p.flag", "true"),
            ("p.list", "[1.0, 2.5, x]"),
            ("p.long", "12.3457"),
            ("p.none", "none"),
            ("p.rows.1.a", "1"),
            ("p.rows.2.a", "2"),
            ("p.short", "0.25"),
            ("p.text", "slow"),
            ("p.tiny", "1.2346e-3"),
            ("p.whole", "12"),
        ]
    );
}

#[test]
fn settings_that_differ_are_named_by_their_documentation() {
    let facts = |hold: &str| SessionFacts {
        values: [("protocol.motion.hold", hold), ("protocol.seed", "1")]
            .map(|(k, v)| (k.to_owned(), v.to_owned()))
            .into(),
        docs: [("protocol.motion.hold", "Time at depth.")]
            .map(|(k, v)| (k.to_owned(), v.to_owned()))
            .into(),
        ..SessionFacts::default()
    };
    let (a, b) = (facts("0.3"), facts("0.5"));
    let (found, of) = fact_differences([(&a, None), (&b, None)]);
    assert_eq!(of, 2);
    let found: Vec<_> = found.iter().map(|d| (d.what.as_str(), &d.values)).collect();
    let [(what, values)] = found[..] else {
        panic!("{found:#?}");
    };
    assert_eq!(*values, ["0.3", "0.5"]);
    assert!(what.to_lowercase().contains("time at depth"), "{what}");
}
