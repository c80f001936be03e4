//! Tests of the JUnit document of a night: well-formed XML, required order of elements, correct
//! counts.

use skinrig_model::Limit;
use skinrig_nightly::junit::{Outcome, junit};
use skinrig_nightly::{Cause, Evidence, EvidenceKind, Night, Verdict};

use super::support::{attempts, check, measured, night, part};

/// A night with every verdict and cause, and with text that must be escaped in XML.
fn night_with_every_verdict() -> Night {
    let mut checks = vec![
        check("identity", Verdict::Pass, None),
        check("settings", Verdict::Marginal, None),
        check("disk", Verdict::Fail, Some(Cause::Infrastructure)),
        check("idle", Verdict::Fail, Some(Cause::Software)),
        check("clocks", Verdict::Inconclusive, Some(Cause::Rig)),
        check("trigger_loopback", Verdict::Invalid, Some(Cause::Rig)),
        check("golden", Verdict::Fail, Some(Cause::Skin)),
        check("stop_drill", Verdict::Skipped, None),
    ];
    checks[7].skipped = Some("not \"here\" & <now>".to_owned());
    checks[1].repeats = Some("FAIL at first".to_owned());
    checks[5].rule = Some("device-at-fault".to_owned());
    for c in &mut checks[..7] {
        c.attempts = attempts(&[c.verdict]);
        let value = (c.name != "clocks").then_some(0.000_012);
        c.attempts[0].parts = vec![part(
            "camera1",
            vec![measured("jitter", value, Limit::at_most(1.0))],
        )];
        c.attempts[0].evidence = vec![
            Evidence::new(
                EvidenceKind::ReadBack,
                "camera1",
                "<bias> ]]> \u{1}\u{fffe} & more",
            )
            .next("power-cycle it"),
        ];
    }
    night(checks)
}

/// Start or end of one element.
#[derive(Debug, PartialEq)]
enum Tag {
    Open(String, Vec<(String, String)>),
    Close(String),
}

/// Parses the elements of a document. Panics if it is not well-formed.
fn elements(text: &str) -> Vec<Tag> {
    let mut rest = text
        .strip_prefix("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n")
        .expect("expected an XML declaration");
    let mut tags = Vec::new();
    let mut open: Vec<String> = Vec::new();
    while let Some(at) = rest.find('<') {
        assert_escaped(&rest[..at]);
        let end = rest[at..].find('>').expect("expected the end of a tag") + at;
        let tag = &rest[at + 1..end];
        rest = &rest[end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name));
            tags.push(Tag::Close(name.to_owned()));
            continue;
        }
        let (tag, alone) = tag.strip_suffix('/').map_or((tag, false), |t| (t, true));
        let (name, mut list) = tag.split_once(' ').unwrap_or((tag, ""));
        let mut attributes = Vec::new();
        while let Some((key, after)) = list.trim_start().split_once("=\"") {
            let (value, after) = after
                .split_once('"')
                .expect("expected the end of an attribute");
            assert_escaped(value);
            attributes.push((key.to_owned(), value.to_owned()));
            list = after;
        }
        assert_eq!(list.trim(), "", "{tag}");
        tags.push(Tag::Open(name.to_owned(), attributes));
        if alone {
            tags.push(Tag::Close(name.to_owned()));
        } else {
            open.push(name.to_owned());
        }
    }
    assert_eq!(rest.trim(), "");
    assert!(open.is_empty(), "{open:?}");
    tags
}

/// Asserts that the text is escaped and has no character that XML forbids.
fn assert_escaped(text: &str) {
    for (at, _) in text.match_indices('&') {
        let entity = text[at + 1..].split(';').next().unwrap_or_default();
        assert!(["amp", "lt", "gt", "quot"].contains(&entity), "{text}");
    }
    let allowed = |c: char| matches!(c, '\n' | '\t') || !(c.is_control() || c == '\u{fffe}');
    assert!(!text.contains('>') && text.chars().all(allowed), "{text:?}");
}

#[test]
fn document_is_well_formed_and_counts_add_up() {
    let text = junit(&night_with_every_verdict(), "bench-1").expect("write JUnit");
    let tags = elements(&text);
    let named = |name: &str| -> Vec<&Vec<(String, String)>> {
        let opened = tags.iter().filter_map(|tag| match tag {
            Tag::Open(n, a) if n == name => Some(a),
            _ => None,
        });
        opened.collect()
    };
    let value = |attributes: &[(String, String)], key: &str| {
        let found = attributes.iter().find(|(k, _)| k == key);
        found.map(|(_, v)| v.clone()).unwrap_or_default()
    };
    for suite in [named("testsuites")[0], named("testsuite")[0]] {
        for (key, element) in [
            ("tests", "testcase"),
            ("failures", "failure"),
            ("errors", "error"),
            ("skipped", "skipped"),
        ] {
            assert_eq!(value(suite, key), named(element).len().to_string(), "{key}");
        }
    }
    assert_eq!(named("testcase").len(), 8);
    let types = |element: &str| -> Vec<String> {
        named(element).iter().map(|a| value(a, "type")).collect()
    };
    assert_eq!(types("failure"), ["broken-limit"; 2]);
    assert_eq!(
        types("error"),
        ["broken-limit", "broken-limit", "device-at-fault"]
    );
    assert_eq!(
        value(named("skipped")[0], "message"),
        "not &quot;here&quot; &amp; &lt;now&gt;"
    );
    // Kinds for programs: the verdict, the cause, the rule and the evidence of each check.
    let kinds = |name: &str| {
        let all = named("property").into_iter();
        let named = all.filter(|a| value(a, "name") == name);
        named.map(|a| value(a, "value")).collect::<Vec<_>>()
    };
    assert_eq!(
        kinds("cause"),
        ["infrastructure", "software", "rig", "rig", "skin"]
    );
    // The first is that of the night.
    assert_eq!(
        kinds("verdict"),
        [
            "INVALID",
            "PASS",
            "MARGINAL",
            "FAIL",
            "FAIL",
            "INCONCLUSIVE",
            "INVALID",
            "FAIL",
            "SKIPPED"
        ]
    );
    assert_eq!(kinds("rule"), ["device-at-fault"]);
    assert_eq!(kinds("evidence"), ["camera1: read back"; 7]);
    // JUnit readers require timestamps without a time zone.
    assert_eq!(
        value(named("testsuite")[0], "timestamp"),
        "2026-11-20T02:00:00"
    );
}

#[test]
fn infrastructure_is_an_error_and_a_measured_excess_a_failure() {
    for (verdict, cause, outcome) in [
        (Verdict::Pass, None, Outcome::Passed),
        (Verdict::Marginal, None, Outcome::Passed),
        (Verdict::Skipped, None, Outcome::Skipped),
        (Verdict::Fail, Some(Cause::Skin), Outcome::Failure),
        (Verdict::Fail, Some(Cause::Rig), Outcome::Failure),
        (Verdict::Fail, Some(Cause::Infrastructure), Outcome::Error),
        (Verdict::Fail, Some(Cause::Software), Outcome::Error),
        (Verdict::Invalid, Some(Cause::Rig), Outcome::Error),
        (
            Verdict::Inconclusive,
            Some(Cause::Infrastructure),
            Outcome::Failure,
        ),
    ] {
        assert_eq!(
            Outcome::of(verdict, cause),
            outcome,
            "{verdict:?} {cause:?}"
        );
    }
}

/// Validates against the JUnit schema with lxml; runs in CI only.
#[test]
fn document_is_valid_against_the_schema() {
    let Some(python) = std::env::var_os("SKINRIG_PYTHON") else {
        eprintln!("skipped: set SKINRIG_PYTHON to a Python with lxml");
        return;
    };
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/nightly/judging");
    let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("junit.xml");
    let text = junit(&night_with_every_verdict(), "bench-1").expect("write JUnit");
    std::fs::write(&file, text).expect("write a temporary file");
    let output = std::process::Command::new(python)
        .arg(folder.join("validate.py"))
        .arg(folder.join("junit.xsd"))
        .arg(&file)
        .output()
        .expect("start Python");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
}
