//! Suites: the shipped one parses, and all faults of an invalid one are reported at once, each with its location.
#![expect(clippy::unwrap_used, reason = "a test")]

use skinrig_model::Limit;
use skinrig_protocol::Suite;
use skinrig_protocol::suite::Measure;

const NIGHTLY: &str = include_str!("../../../../hil/nightly.yaml");

fn findings(text: &str) -> String {
    Suite::parse("suite.yaml", text.as_bytes())
        .unwrap_err()
        .to_string()
}

#[test]
fn the_shipped_suite_states_a_limit_for_every_check() {
    let suite = Suite::parse("hil/nightly.yaml", NIGHTLY.as_bytes()).unwrap();
    assert_eq!(suite.budget.as_secs_f64(), 1200.0);
    assert_eq!(suite.checks.len(), 18);
    assert_eq!(suite.repeats.at_most, 2);
    let loopback = suite
        .checks
        .iter()
        .find(|c| c.name == "trigger_loopback")
        .unwrap();
    assert_eq!(loopback.measure, Measure::TriggerLoopback { trains: 20 });
    let jitter = loopback.limits["jitter"];
    assert!(
        (jitter.at_most.unwrap() - 20e-6).abs() < 1e-18,
        "{jitter:?}"
    );
    assert_eq!(loopback.limits["lost_pulses"], Limit::at_most(0.0));
    let golden = suite.checks.iter().find(|c| c.name == "golden").unwrap();
    let Measure::Golden { protocol } = &golden.measure else {
        panic!("{golden:?}")
    };
    assert_eq!(protocol, std::path::Path::new("hil/golden.yaml"));
}

#[test]
fn every_fault_of_a_suite_is_reported_with_its_location() {
    let text = "\
skinrig_suite: 1
name: bad
budget: 0 s
checks:
  identity: {}
  trigger_lopback: {lost_pulses: {at_most: 0}}
  disk: {write_rate: {at_most: 3 mm}}
  clocks:
    drift: {at_least: 5 ppm, at_most: 1 ppm}
    residual: {margin: 1 us}
";
    let message = findings(text);
    for part in [
        "suite.yaml:3:9",
        "add `differences: {at_most: 0}`",
        "`trigger_loopback`",
        "suite.yaml:7:",
        "no value is within the limits",
        "suite.yaml:10:",
        "at least one of `at_most` or `at_least`",
    ] {
        assert!(message.contains(part), "no {part} in:\n{message}");
    }
}

#[test]
fn a_skipped_check_has_a_reason() {
    let suite = |skip: &str| {
        format!(
            "skinrig_suite: 1\nname: s\nbudget: 1 min\nchecks: {{identity: {{differences: {{at_most: 0}}, skip: {skip}}}}}\n"
        )
    };
    for skip in ["false", "no", "Off", "'no'", "true", "0", "null", "~"] {
        let message = findings(&suite(skip));
        assert!(message.contains("suite.yaml:4:"), "{skip}: {message}");
        assert!(message.contains("skip"), "{skip}: {message}");
    }
    let suite = Suite::parse("suite.yaml", suite("no lamp today").as_bytes()).unwrap();
    assert_eq!(suite.checks[0].skip.as_deref(), Some("no lamp today"));
}

#[test]
fn limits_that_find_no_fault_or_that_nothing_meets_are_refused() {
    let all = [
        (
            "disk: {write_rate: {at_most: 20 MB/s}}",
            "`at_least`: large values are good",
        ),
        (
            "disk: {free: {at_least: 0 B}}",
            "every value is within the limits",
        ),
        (
            "idle: {lost: {at_least: 0 B}}",
            "`at_most`: small values are good",
        ),
        (
            "idle: {lost: {at_most: -1 B}}",
            "no value is within the limits",
        ),
        (
            "idle: {data_rate: {at_least: 0 B/s}}",
            "every value is within the limits",
        ),
        (
            "clocks: {drift: {at_most: 1 ppm}}",
            "`at_least` and `at_most`",
        ),
        (
            "clocks: {offset: {at_least: 1 ms}}",
            "`at_least` and `at_most`",
        ),
        (
            "test_pattern: {received: {at_least: 0 %}}",
            "every value is within the limits",
        ),
        (
            "golden: {protocol: g.yaml, located: {at_least: 101 %}}",
            "at_least of at most 100",
        ),
    ];
    for (check, expected) in all {
        let text = format!("skinrig_suite: 1\nname: s\nbudget: 1 min\nchecks:\n  {check}\n");
        let message = findings(&text);
        assert!(message.contains(expected), "{check}: {message}");
        // The limit that it proposes is accepted.
        let from = message.find("for example `").expect("a proposal") + 13;
        let proposed = &message[from..from + message[from..].find('`').unwrap()];
        let limit = &check[check.rfind('{').unwrap()..=check.find('}').unwrap()];
        let mended = text.replace(limit, proposed);
        assert!(
            Suite::parse("suite.yaml", mended.as_bytes()).is_ok(),
            "{mended}"
        );
    }
    let text = "skinrig_suite: 1\nname: s\nbudget: 1 min\nrepeats: {at_most: 1, must_pass: 5}\nchecks: {identity: {differences: {at_most: 0}}}\n";
    assert!(findings(text).contains("no repeated check can pass"));
}

#[test]
fn a_file_in_another_language_is_recognised() {
    let message = findings("skinrig_rig: 1\nname: x\n");
    assert!(
        message.contains("a rig file, which belongs to `--rig`"),
        "{message}"
    );
}
