//! Following the printed help for a missing key fixes the file.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::Value;
use skinrig_protocol::{
    Diagnostic, Diagnostics, Limits, Protocol, RigFile, Schedule, Suite, limits_schema_json,
    rig_schema_json, schedule_schema_json, schema_json, suite_schema_json,
};

/// One language: its schema, files that together have every required key, and its reader.
struct Language {
    schema: String,
    files: Vec<(String, String)>,
    parse: fn(&str, &str) -> Result<(), Diagnostics>,
}

fn files(names: &[&str]) -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let text = |name: &str| std::fs::read_to_string(root.join(name)).unwrap();
    names.iter().map(|n| ((*n).to_owned(), text(n))).collect()
}

/// A file as block YAML with every entry on a line of its own.
fn block(value: &Value, indent: usize, out: &mut String) {
    let pad = " ".repeat(indent);
    for (key, value) in value.as_object().unwrap() {
        match value {
            Value::Object(map) if !map.is_empty() => {
                out.push_str(&format!("{pad}{key}:\n"));
                block(value, indent + 2, out);
            }
            Value::Array(items) if items.first().is_some_and(Value::is_object) => {
                out.push_str(&format!("{pad}{key}:\n"));
                for item in items {
                    let mut text = String::new();
                    block(item, indent + 4, &mut text);
                    if text.is_empty() {
                        text.push_str("{}\n");
                    }
                    out.push_str(&format!("{pad}  - {}", text.trim_start()));
                }
            }
            other => out.push_str(&format!("{pad}{key}: {other}\n")),
        }
    }
}

/// Paths of the mappings in a file, with the groups of keys of which one is required: a required key is a group of one.
fn groups(
    schema: &Value,
    at: &Value,
    value: &Value,
    path: &str,
    out: &mut Vec<(String, String, Vec<String>)>,
) {
    let at = match at.get("$ref").and_then(Value::as_str) {
        Some(reference) => schema.pointer(reference.trim_start_matches('#')).unwrap(),
        None => at,
    };
    let names = |list: &Value| -> Vec<String> {
        let list = list.as_array().unwrap().iter();
        list.map(|o| o["required"][0].as_str().unwrap().to_owned())
            .collect()
    };
    if let Some(object) = value.as_object() {
        let table = at["description"].as_str().unwrap_or("").to_owned();
        for key in at["required"].as_array().into_iter().flatten() {
            out.push((
                path.to_owned(),
                table.clone(),
                vec![key.as_str().unwrap().to_owned()],
            ));
        }
        for group in at["allOf"].as_array().into_iter().flatten() {
            for kind in ["oneOf", "anyOf"] {
                if group.get(kind).is_some() {
                    out.push((path.to_owned(), table.clone(), names(&group[kind])));
                }
            }
        }
        for (key, inner) in object {
            if let Some(property) = at["properties"].get(key) {
                groups(schema, property, inner, &format!("{path}/{key}"), out);
            }
        }
        for option in at["oneOf"].as_array().into_iter().flatten() {
            if option.get("$ref").is_some() {
                groups(schema, option, value, path, out);
            }
        }
    }
    for (i, item) in value.as_array().into_iter().flatten().enumerate() {
        groups(schema, &at["items"], item, &format!("{path}/{i}"), out);
    }
}

/// Inserts `line` at the finding: before the first entry of the mapping, or into an empty one.
fn insert(text: &str, line: usize, column: usize, entry: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let target = lines[line - 1];
    let (before, after) = target.split_at(column - 1);
    let changed = match after.strip_prefix("{}") {
        Some(rest) => format!("{before}{{{entry}}}{rest}"),
        None => format!("{before}{entry}\n{}{after}", " ".repeat(column - 1)),
    };
    let mut lines: Vec<String> = lines.iter().map(ToString::to_string).collect();
    lines[line - 1] = changed;
    lines.join("\n") + "\n"
}

/// The key path of a JSON pointer: `points[0].skin`.
fn dotted(pointer: &str) -> String {
    let mut path = String::new();
    for part in pointer.split('/').skip(1) {
        match part.parse::<usize>() {
            Ok(index) => path.push_str(&format!("[{index}]")),
            Err(_) if path.is_empty() => path.push_str(part),
            Err(_) => path.push_str(&format!(".{part}")),
        }
    }
    path
}

/// Keys without an example that always fits: `evaluation` depends on the number of repetitions.
const UNFIXED: [&str; 5] = [
    "skinrig protocol: evaluation",
    "skinrig protocol: evaluation.score",
    "skinrig schedule: evaluation",
    "skinrig schedule: evaluation.repetitions",
    "skinrig schedule: evaluation.repetitions.score",
];

/// Keys whose example leaves a finding, and keys that no file has.
fn unfixed(language: &Language) -> BTreeSet<String> {
    let schema: Value = serde_json::from_str(&language.schema).unwrap();
    let options = serde_yaml::options! { strict_booleans: true };
    let (mut unfixed, mut covered) = (BTreeSet::new(), BTreeSet::new());
    let title = schema["title"].as_str().unwrap();
    for (name, text) in &language.files {
        let file: Value = serde_yaml::from_str_with_options(text, options.clone()).unwrap();
        let mut cases = Vec::new();
        groups(&schema, &schema, &file, "", &mut cases);
        for (path, table, group) in cases {
            let mut damaged = file.clone();
            let mapping = damaged.pointer_mut(&path).unwrap().as_object_mut().unwrap();
            mapping.retain(|key, _| !group.contains(key));
            let mut text = String::new();
            block(&damaged, 0, &mut text);
            let case = format!("{name}: {}", dotted(&format!("{path}/{}", group.join("|"))));
            let error = (language.parse)(name, &text).expect_err(&case);
            let entry = |d: &Diagnostic| {
                let entry = d
                    .help
                    .as_deref()?
                    .strip_prefix("add `")?
                    .strip_suffix('`')?;
                let key = entry.split_once(": ")?.0;
                group.iter().any(|k| k == key).then(|| entry.to_owned())
            };
            let found = error.list().iter().find_map(|d| Some((d, entry(d)?)));
            let (missing, entry) = found.unwrap_or_else(|| panic!("{case}: no help\n{error}"));
            let at = &missing.location;
            let mended = insert(&text, at.line, at.column, &entry);
            let key = dotted(&format!("{path}/{}", entry.split_once(": ").unwrap().0));
            let left = (language.parse)(name, &mended);
            let left = left.err().unwrap_or_default();
            if left.list().iter().any(|d| d.path.starts_with(&key)) {
                unfixed.insert(format!("{title}: {key}"));
            }
            covered.extend(group.into_iter().map(|key| (table.clone(), key)));
        }
    }
    let tables = schema["$defs"].as_object().unwrap().values();
    for table in tables.chain([&schema]) {
        let doc = table["description"].as_str().unwrap().to_owned();
        for key in table["required"].as_array().into_iter().flatten() {
            if !covered.contains(&(doc.clone(), key.as_str().unwrap().to_owned())) {
                unfixed.insert(format!("{title}: no file has {key} of: {doc}"));
            }
        }
    }
    unfixed
}

#[test]
fn the_help_for_a_missing_key_fixes_the_file() {
    let languages = [
        Language {
            schema: rig_schema_json(),
            files: [
                files(&["hil/rigs/bench.example.yaml", "hil/rigs/emulated.yaml"]),
                vec![("notify.yaml".to_owned(), crate::notify::example())],
            ]
            .concat(),
            parse: |name, text| {
                let value = |_: &str| Some("value".to_owned());
                RigFile::parse(name, text.as_bytes(), &value).map(drop)
            },
        },
        Language {
            schema: suite_schema_json(),
            files: [
                files(&["hil/nightly.yaml"]),
                vec![("notify.yaml".to_owned(), crate::notify::example_suite())],
            ]
            .concat(),
            parse: |name, text| Suite::parse(name, text.as_bytes()).map(drop),
        },
        Language {
            schema: limits_schema_json(),
            files: files(&["protocols/comparison.limits.yaml"]),
            parse: |name, text| Limits::parse(name, text.as_bytes()).map(drop),
        },
        Language {
            schema: schedule_schema_json(),
            files: files(&[
                "protocols/paper-recording.schedule.yaml",
                "protocols/single-repetition.schedule.yaml",
                "crates/protocol/tests/protocol/inputs/every-mapping.schedule.yaml",
            ]),
            parse: |name, text| Schedule::parse(name, text.as_bytes(), &[]).map(drop),
        },
        Language {
            schema: schema_json(),
            files: files(&[
                "protocols/demo.yaml",
                "protocols/paper-meander.yaml",
                "protocols/depth-sweep.yaml",
                "protocols/circles.yaml",
                "protocols/quick-check.yaml",
                "crates/protocol/tests/protocol/inputs/every-mapping.yaml",
            ]),
            parse: |name, text| {
                let csv = |_: &Path| Ok(b"x,y\n0,0\n".to_vec());
                Protocol::parse(name, text.as_bytes(), &[], &csv).map(drop)
            },
        },
    ];
    let found: BTreeSet<String> = languages.iter().flat_map(unfixed).collect();
    let known = UNFIXED.map(str::to_owned).into();
    assert_eq!(found, known);
}
