//! Limits of a comparison: the shipped file, its schema, single margins, and diagnostics.

use skinrig_protocol::limits::{Limits, Margin};
use skinrig_protocol::limits_schema_json;

use crate::common::shipped;
use crate::validate::validate;

#[test]
fn the_shipped_limits_show_every_key_with_its_value() {
    let text = shipped("comparison.limits.yaml");
    let limits = Limits::parse("comparison.limits.yaml", text.as_bytes()).unwrap();
    assert_eq!(
        (limits.name.as_str(), limits.within_mm),
        ("example", Some(5.0))
    );
    let value = |name: &str| {
        limits
            .margins
            .iter()
            .find(|m| m.metric == name)
            .unwrap()
            .value
    };
    assert_eq!(value("rmse"), 0.5);
    assert_eq!(value("located_rate"), 5.0);
    assert_eq!(value("latency"), 2e-3);
    assert_eq!(value("press_bytes"), 25e3);
    assert_eq!(value("taxels"), 50.0);
    let schema: serde_json::Value = serde_json::from_str(&limits_schema_json()).unwrap();
    let keys = schema["$defs"]["margins"]["properties"]
        .as_object()
        .unwrap();
    assert_eq!(limits.margins.len(), keys.len());
    let advice = "run `cargo run -p skinrig-protocol --example write_schema`";
    assert_eq!(
        shipped("skinrig-limits.schema.json"),
        limits_schema_json(),
        "{advice}"
    );
    let options = serde_yaml::options! { strict_booleans: true };
    let read: serde_json::Value = serde_yaml::from_str_with_options(&text, options).unwrap();
    validate(&schema, &read, &schema, "comparison.limits.yaml").unwrap();
}

#[test]
fn all_findings_of_a_file_at_once() {
    let text = "skinrig_limits: 1\nname: mine\nwithin: 5\nmargins:\n  rsme: 1 mm\n  bias_x: 1 ms\n  located_rate: 120 %\n  taxels: -3\n";
    let error = Limits::parse("limits.yaml", text.as_bytes()).unwrap_err();
    insta::assert_snapshot!("wrong-limits", error.render(false));
    let error = Limits::parse("limits.yaml", b"skinrig: 1\nname: x\n").unwrap_err();
    assert!(error.to_string().contains("a protocol"), "{error}");
}

#[test]
fn a_margin_on_the_command_line_replaces_that_of_the_file() {
    let text = "skinrig_limits: 1\nname: mine\nmargins: {rmse: 1 mm}\n";
    let mut limits = Limits::parse("limits.yaml", text.as_bytes()).unwrap();
    limits.set(Margin::parse("rmse = 0.05 cm").unwrap());
    limits.set(Margin::parse("taxels=20").unwrap());
    let margins: Vec<_> = limits.margins.iter().map(|m| (m.metric, m.value)).collect();
    assert_eq!(margins, [("rmse", 0.5), ("taxels", 20.0)]);
    for (text, message) in [
        ("rmse", "METRIC=MARGIN"),
        ("rsme=1mm", "did you mean `rmse`?"),
        ("rmse=1", "the bare number `1`"),
        ("rmse=1 ms", "a time"),
        ("rmse=0 mm", "more than 0 mm"),
        ("taxels=many", "`many`"),
        ("taxels=NaN", "more than 0"),
    ] {
        let error = Margin::parse(text).unwrap_err();
        assert!(error.to_string().contains(message), "{text}: {error}");
    }
}
