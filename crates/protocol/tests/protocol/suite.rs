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
fn a_file_in_another_language_is_recognised() {
    let message = findings("skinrig_rig: 1\nname: x\n");
    assert!(
        message.contains("a rig file, which belongs to `--rig`"),
        "{message}"
    );
}
