//! Selections: presses that do not count, the schema, and diagnostics.

use skinrig_model::{PressId, PressRole};
use skinrig_protocol::selection::{SessionFacts, SessionFault};
use skinrig_protocol::{Selection, selection_schema_json};

use crate::common::shipped;
use crate::validate::validate;

/// Two sync presses and eight scored ones, sealed with as many `a`; `open` has no seal.
fn look_up(file: &str) -> Result<SessionFacts, SessionFault> {
    let digit = match file {
        "a" => Some("a"),
        "b" => Some("b"),
        "open" => None,
        "broken" => return Err(SessionFault::Unreadable("damaged".to_owned())),
        _ => return Err(SessionFault::Missing),
    };
    let mut roles = vec![PressRole::Sync; 2];
    roles.extend([PressRole::Score; 8]);
    Ok(SessionFacts {
        path: file.into(),
        content_sha256: digit.map(|d| d.repeat(64)),
        roles,
    })
}

/// `text` with `A` and `B` for the hashes of the sessions.
fn parse(text: &str) -> Result<Selection, skinrig_protocol::Diagnostics> {
    let text = text
        .replace("=A", &"a".repeat(64))
        .replace("=B", &"b".repeat(64));
    Selection::parse("x.selection.yaml", text.as_bytes(), &look_up)
}

const EVERY_KEY: &str = "skinrig_selection: 1\nname: mine\ndescription: the lamp was on\nsessions:\n  - file: a\n    content_sha256: \
    aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa\n    only: {presses: [3-8], reason: later ones have no lamp, decided_by: \
    A. Person}\n    exclude:\n      - {presses: [4, 5-6], reason: the table was hit, decided_by: B. Person}\n";

#[test]
fn presses_that_do_not_count_have_a_reason_each() {
    let selection = parse(EVERY_KEY).unwrap();
    let out = &selection.sessions[0].selected_out;
    let numbers: Vec<u32> = out.iter().map(|s| s.press.number()).collect();
    assert_eq!(numbers, [4, 5, 6, 9, 10]);
    assert_eq!(out[0].why.reason, "the table was hit");
    assert_eq!(out[4].press, PressId::from_index(9));
    assert_eq!(out[4].why.decided_by, "A. Person");
    let other = parse(&EVERY_KEY.replace("lamp was on", "lamp was off")).unwrap();
    assert_ne!(
        selection.sha256, other.sha256,
        "the hash is that of the text"
    );
    let all = parse("skinrig_selection: 1\nname: all\nsessions: [{file: a, content_sha256: =A}]\n");
    assert!(all.unwrap().sessions[0].selected_out.is_empty());
}

#[test]
fn the_schema_ships_and_fits() {
    let schema = selection_schema_json();
    let advice = "run `cargo run -p skinrig-protocol --example write_schema`";
    assert_eq!(shipped("skinrig-selection.schema.json"), schema, "{advice}");
    let schema: serde_json::Value = serde_json::from_str(&schema).unwrap();
    let read: serde_json::Value = serde_yaml::from_str(EVERY_KEY).unwrap();
    validate(&schema, &read, &schema, "selection").unwrap();
}

#[test]
fn all_findings_of_a_selection_at_once() {
    let text = "skinrig_selection: 1\nname: wrong\nsessions:\n  - {file: a, content_sha256: =B}\n  - {file: open, content_sha256: =A}\n  \
        - {file: c, content_sha256: =A}\n  - {file: broken, content_sha256: =A}\n";
    insta::assert_snapshot!("wrong-sessions", parse(text).unwrap_err().render(false));
    let text = "skinrig_selection: 1\nname: wrong\nsessions:\n  - file: a\n    content_sha256: =A\n    only: {presses: [3-9], reason: r, decided_by: \
        p}\n    exclude:\n      - {presses: [2, 11, 4-12], reason: r, decided_by: p}\n      - {presses: [5, 5, 10], reason: r, decided_by: p}\n  \
        - {file: a, content_sha256: =A}\n";
    insta::assert_snapshot!("wrong-presses", parse(text).unwrap_err().render(false));
    let text = "skinrig_selection: 1\nname: wrong\nsessions:\n  - file: a\n    content_sha256: AB\n    exclude: [{presses: [3]}]\n";
    insta::assert_snapshot!("no-reason", parse(text).unwrap_err().render(false));
    let error = parse("skinrig_limits: 1\nname: x\n").unwrap_err();
    assert!(error.to_string().contains("a file of limits"), "{error}");
}
