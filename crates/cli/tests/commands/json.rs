//! Machine-readable output: JSON with stable keys, and no control characters.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use crate::dataset::Dataset;
use crate::support::{Lab, SMALL, only, skinrig, text};

/// Every key path in `value` with its kinds of value; list items are merged into `[]`.
pub(crate) fn shape(value: &Value) -> String {
    fn collect_types(
        value: &Value,
        path: &str,
        found: &mut BTreeMap<String, BTreeSet<&'static str>>,
    ) {
        let kind = match value {
            Value::Null => "null",
            Value::Bool(_) => "bool",
            Value::Number(_) => "number",
            Value::String(_) => "text",
            Value::Array(items) => {
                for item in items {
                    collect_types(item, &format!("{path}[]"), found);
                }
                "list"
            }
            Value::Object(members) => {
                for (key, member) in members {
                    collect_types(member, &format!("{path}.{key}"), found);
                }
                "map"
            }
        };
        found.entry(path.to_owned()).or_default().insert(kind);
    }
    let mut found = BTreeMap::new();
    collect_types(value, "", &mut found);
    let mut text = String::new();
    for (path, kinds) in found {
        let kinds: Vec<_> = kinds.into_iter().collect();
        text += &format!("{path}: {}\n", kinds.join(" or "));
    }
    text
}

#[test]
fn json_keys_are_stable() {
    let lab = Lab::new();
    let s = lab.text("s");
    let json = |arguments: &[&str]| {
        let mut all = vec!["--json"];
        all.extend_from_slice(arguments);
        skinrig(&all).code(0).json()
    };
    let run = json(&["run", SMALL, "--sessions", &s]);
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    assert_eq!(run["files"]["session"], session.as_str());
    let analyze = json(&["analyze", &session]);
    // A run ends with the analysis of its session.
    assert_eq!(shape(&run), shape(&analyze));
    insta::assert_snapshot!("run", shape(&run));
    insta::assert_snapshot!("check", shape(&json(&["check", SMALL])));
    insta::assert_snapshot!("plan", shape(&json(&["plan", SMALL])));
    let tag = json(&["tag", &session, "good", "--note", "warm", "--by", "Ann"]);
    insta::assert_snapshot!("tag", shape(&tag));
    insta::assert_snapshot!("sessions", shape(&json(&["sessions", &s])));
    insta::assert_snapshot!("prototypes", shape(&json(&["prototypes", &s])));
    let status = json(&["catalogue", "status", &s]);
    insta::assert_snapshot!("catalogue_status", shape(&status));
    let registered = json(&["catalogue", "register", &s]);
    insta::assert_snapshot!("catalogue_register", shape(&registered));
    let answer = json(&["catalogue", "query", "rigs", "--folder", &s]);
    insta::assert_snapshot!("catalogue_query", shape(&answer));
    insta::assert_snapshot!("watch", shape(&json(&["watch", &session, "--once"])));
    insta::assert_snapshot!(
        "show",
        shape(&json(&["show", &session, "--presses", "--protocol"]))
    );
    insta::assert_snapshot!("report", shape(&json(&["report", &session])));
    let scene = json(&["scene", "check", &session]);
    insta::assert_snapshot!("scene", shape(&scene));
    let cameras = &scene["recordings"][0]["cameras"];
    assert!(cameras[1]["events"].as_u64() > Some(0), "{scene}");
    insta::assert_snapshot!("verify", shape(&json(&["verify", &session])));
    let export = json(&["export", &session, "--to", "all", "--out", &lab.text("e")]);
    insta::assert_snapshot!("export", shape(&export));
    let bundle = lab.text("b");
    json(&["export", &session, "--to", "bundle", "--out", &bundle]);
    insta::assert_snapshot!("verify_bundle", shape(&json(&["verify", &bundle])));
    insta::assert_snapshot!("inspect_session", shape(&json(&["inspect", &session])));
    let raw = text(&only(&lab.path("e"), ".camera1.raw"));
    insta::assert_snapshot!("inspect_raw", shape(&json(&["inspect", &raw])));
    let hdf5 = text(&only(&lab.path("e"), ".camera1.hdf5"));
    insta::assert_snapshot!("inspect_hdf5", shape(&json(&["inspect", &hdf5])));
    let data = Dataset::new(&lab);
    let arguments = data.arguments(&lab.path("i"));
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    insta::assert_snapshot!("import", shape(&json(&arguments)));
    // A schema is JSON anyway.
    assert_eq!(json(&["schema"]), skinrig(&["schema"]).code(0).json());
    let recorded = json(&["run", SMALL, "--sessions", &lab.text("n"), "--no-analysis"]);
    insta::assert_snapshot!("run_no_analysis", shape(&recorded));
}

#[test]
fn without_a_terminal_output_is_plain_lines() {
    let lab = Lab::new();
    let s = lab.text("s");
    let run = skinrig(&["run", SMALL, "--sessions", &s]).code(0);
    let session = text(&only(&lab.path("s"), ".session.sqlite"));
    let progress: Vec<&str> = run
        .err
        .lines()
        .filter(|l| l.starts_with("press "))
        .collect();
    assert!(
        (2..=11).contains(&progress.len()),
        "a line each tenth: {}",
        run.err
    );
    for part in ["press 10/10", "rep 2", "mm", "kev/s", "seen", "eta"] {
        assert!(
            progress.last().unwrap().contains(part),
            "{part}: {progress:#?}"
        );
    }
    let distinct: BTreeSet<&&str> = progress.iter().collect();
    assert_eq!(
        distinct.len(),
        progress.len(),
        "no line twice: {progress:#?}"
    );
    let mut all = vec![run];
    for arguments in [
        vec!["--help"],
        vec!["check", SMALL],
        vec!["check", SMALL, "--set", "dept=1 mm"],
        vec!["plan", SMALL, "--steps"],
        vec!["sessions", &s],
        vec!["show", &session, "--presses", "--protocol"],
        vec!["analyze", &session],
        vec!["report", &session],
        vec!["verify", &session],
        vec!["inspect", &session],
        vec!["export", &session, "--to", "all", "--out", &lab.text("e")],
        vec!["tag", &session, "good", "--note", "warm"],
        vec!["prototypes", &s, "--prototype", "test skin"],
        vec!["catalogue", "status", &s],
        vec!["catalogue", "query", "devices", "--folder", &s],
        vec!["catalogue", "query"],
        vec!["watch", &session],
        vec!["schema"],
        vec!["no-such-command"],
    ] {
        all.push(skinrig(&arguments));
    }
    for output in all {
        for (name, text) in [
            ("standard output", &output.out),
            ("standard error", &output.err),
        ] {
            let control = text.chars().find(|c| c.is_control() && *c != '\n');
            assert_eq!(control, None, "{name}: {text:?}");
            assert!(text.is_empty() || text.ends_with('\n'), "{name}: {text:?}");
        }
    }
}
