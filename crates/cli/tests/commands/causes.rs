//! Programs find warnings, violations and evidence by their kind, and results of earlier versions, whose causes are texts, are replaced.

use std::path::Path;

use serde_json::{Value, json};
use skinrig_analysis::{Analysis, results_hash};

use crate::dataset::Dataset;
use crate::support::{Lab, only, read_json, show, skinrig, text, write_results};

fn of_kind<'a>(causes: &'a Value, kind: &str) -> &'a Value {
    let mut causes = causes.as_array().unwrap().iter();
    let found = causes.find(|cause| cause["kind"] == kind);
    found.unwrap_or_else(|| panic!("no {kind}"))
}

#[test]
fn programs_find_warnings_and_violations_by_kind() {
    let lab = Lab::new();
    let data = Dataset::new(&lab);
    let mut arguments = vec!["--json".to_owned()];
    arguments.extend(data.arguments(&lab.path("s")));
    let printed = skinrig(&arguments).code(0).json();
    let stored = read_json(&only(&lab.path("s"), ".results.json"));
    for document in [&printed, &stored] {
        let warning = of_kind(&document["analysis"]["warnings"], "scheduled");
        let text = "press times and positions come from a schedule, not from a measurement";
        assert_eq!(warning["text"], text);
    }

    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    let limit = "analysis.alignment.min_log_odds=1000";
    let invalid = skinrig(&["--json", "analyze", &session, "--set", limit])
        .code(4)
        .json();
    let violations = &invalid["analysis"]["alignment"]["violations"];
    let violation = of_kind(violations, "uncertain_rates");
    assert_eq!(violation["least_log_odds"], 1e3);
    assert!(violation["log_odds"].as_f64().unwrap() < 1e3, "{violation}");
    assert!(
        violation["text"]
            .as_str()
            .unwrap()
            .contains("expected log-odds of at least 1000")
    );
}

#[test]
fn programs_find_the_evidence_of_a_finding_by_kind() {
    let lab = Lab::new();
    let mut data = Dataset::new(&lab);
    data.cameras.reverse();
    skinrig(&data.arguments(&lab.path("s"))).code(4);
    let results = read_json(&only(&lab.path("s"), ".results.json"));
    let finding = &results["analysis"]["findings"][0];
    assert_eq!(finding["fault"], "cameras_swapped");
    let evidence = &finding["evidence"];
    assert_eq!(evidence["kind"], "other_reading");
    assert_eq!(evidence["reading"]["kind"], "cameras_exchanged");
    assert!(evidence["log_odds"].as_f64().unwrap() > 10.0, "{evidence}");
}

/// Replaces the violations in stored results, and their hash if this version reads them.
fn set_violations(results: &Path, version: u64, violations: Value) {
    let mut document = read_json(results);
    document["analysis"]["version"] = version.into();
    document["summary"]["analysis_version"] = version.into();
    document["analysis"]["alignment"]["status"] = "invalid".into();
    document["analysis"]["alignment"]["violations"] = violations;
    if let Ok(analysis) = serde_json::from_value::<Analysis>(document["analysis"].clone()) {
        document["provenance"]["results_hash"] = results_hash(&analysis).into();
    }
    write_results(results, document);
}

#[test]
fn results_of_an_earlier_version_are_listed_and_replaced_but_not_used() {
    let lab = Lab::new();
    let more = ["--set", "analysis.bootstrap_resamples=50", "--seed"];
    let [a, b] = ["1", "2"].map(|seed| text(&lab.record(seed, &[&more[..], &[seed]].concat())));
    skinrig(&["analyze", &a]).code(0);
    let results = only(&lab.path("1"), ".results.json");
    let compare = ["compare", &a, &b, "--out", &lab.text("c.html")];

    // Results of this version are read back, with their causes.
    let version = read_json(&results)["analysis"]["version"].as_u64().unwrap();
    set_violations(&results, version, json!([{ "kind": "no_exchanges" }]));
    let refused = skinrig(&compare).code(2);
    let words = refused.out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        words.contains("INVALID: host from box: expected time exchanges, found none"),
        "{words}"
    );

    // Before version 10 a cause was its text. Those that parse are not used either.
    let texts = json!(["host from box: expected time exchanges, found none"]);
    for violations in [json!([{ "kind": "no_exchanges" }]), texts] {
        set_violations(&results, 9, violations);
        let listed = &show(a.as_ref())["analyses"][0];
        assert_eq!(listed["analysis_version"], 9);
        skinrig(&compare).code(0);
    }
    let analyzed = skinrig(&["analyze", &a]).code(0);
    analyzed.expect_stderr(&["results of analysis version 9 are replaced by those of version"]);
    let listed = &show(a.as_ref())["analyses"][0];
    assert_eq!(listed["analysis_version"], version);
}
