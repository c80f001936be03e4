//! JSON Schemas (draft 2020-12) of the languages, from their tables.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};
use skinrig_settings::{Dimension, Need, Settings, Shape, Table, ValueRange, Word, expectation};

/// The JSON Schema of a protocol, for documentation, completion and checks in editors.
#[must_use]
pub fn schema_json() -> String {
    render(crate::keys::ProtocolKeys::TABLE, "skinrig protocol")
}

/// The JSON Schema of a schedule for `skinrig import`.
#[must_use]
pub fn schedule_schema_json() -> String {
    render(crate::keys::ScheduleKeys::TABLE, "skinrig schedule")
}

/// The JSON Schema of a rig file for `--rig`.
#[must_use]
pub fn rig_schema_json() -> String {
    render(crate::rig::RigFile::TABLE, "skinrig rig")
}

/// The JSON Schema of the limits for `skinrig compare`.
#[must_use]
pub fn limits_schema_json() -> String {
    render(crate::limits::Limits::TABLE, "skinrig limits")
}

/// The JSON Schema of a selection, as `skinrig select` writes it.
#[must_use]
pub fn selection_schema_json() -> String {
    render(crate::selection::Selection::TABLE, "skinrig selection")
}

/// The JSON Schema of what a publication states, for `skinrig publish --about`.
#[must_use]
pub fn publication_schema_json() -> String {
    render(
        crate::publication::Publication::TABLE,
        "skinrig publication",
    )
}

/// The JSON Schema of settings for `skinrig reanalyze --settings`.
#[must_use]
pub fn new_settings_schema_json() -> String {
    render(crate::new_settings::NewSettings::TABLE, "skinrig settings")
}

/// The JSON Schema of a suite for `skinrig hil run`.
#[must_use]
pub fn suite_schema_json() -> String {
    render(crate::suite::Suite::TABLE, "skinrig suite")
}

/// Documentation of the setting that a field of [`Protocol`](crate::Protocol) or [`RigFile`](crate::RigFile) holds, by its path below
/// `protocol` or `bench`, such as `protocol.motion.settle.tolerance_mm`; `None` for another field.
#[must_use]
pub fn setting_doc(path: &str) -> Option<&'static str> {
    match path.split_once('.')? {
        ("protocol", field) => crate::keys::ProtocolKeys::TABLE.doc_of_field(field),
        ("bench", field) => crate::rig::RigFile::TABLE.doc_of_field(field),
        _ => None,
    }
}

/// The JSON Schema of the files of a table, for documentation, completion and checks in editors.
fn render(table: &'static Table, title: &str) -> String {
    let mut definitions = BTreeMap::new();
    let mut root = object(table, &mut definitions);
    root.insert(
        "$schema".into(),
        json!("https://json-schema.org/draft/2020-12/schema"),
    );
    root.insert("title".into(), json!(title));
    root.insert("$defs".into(), json!(definitions));
    let mut text = serde_json::to_string_pretty(&Value::Object(root)).unwrap_or_default();
    text.push('\n');
    text
}

type Definitions = BTreeMap<&'static str, Value>;

fn object(table: &'static Table, definitions: &mut Definitions) -> Map<String, Value> {
    let mut properties = Map::new();
    for key in table.keys {
        let mut value = shape(&key.shape, definitions);
        let mut doc = key.doc.to_owned();
        if let Shape::Quantity(..) | Shape::Tuple(..) = key.shape {
            doc.push_str(&format!(" Expected: {}.", expectation(&key.shape)));
        }
        if let Need::Default(text) = key.need {
            if text != "{}" {
                doc.push_str(&format!(" Default: {text}."));
            }
            value.insert("default".into(), plain_default(&key.shape, text));
        }
        value.insert("description".into(), json!(doc));
        properties.insert(key.name.into(), Value::Object(value));
    }
    let required: Vec<&str> = table
        .keys
        .iter()
        .filter(|k| matches!(k.need, Need::Required))
        .map(|k| k.name)
        .collect();
    let mut object = Map::new();
    object.insert("type".into(), json!("object"));
    object.insert("description".into(), json!(table.doc));
    object.insert("properties".into(), Value::Object(properties));
    object.insert("additionalProperties".into(), json!(false));
    if !required.is_empty() {
        object.insert("required".into(), json!(required));
    }
    let each_required = |names: &mut dyn Iterator<Item = &'static str>| -> Vec<Value> {
        names.map(|k| json!({"required": [k]})).collect()
    };
    let mut groups: Vec<Value> = table
        .exactly_one
        .iter()
        .map(|group| json!({"oneOf": each_required(&mut group.iter().copied())}))
        .collect();
    let any = each_required(&mut table.at_least_one());
    if !any.is_empty() {
        groups.push(json!({"anyOf": any}));
    }
    if !groups.is_empty() {
        object.insert("allOf".into(), json!(groups));
    }
    object
}

/// A default as JSON. Lists and mappings get their defaults from their own schemas.
fn plain_default(shape: &Shape, text: &str) -> Value {
    match shape {
        Shape::Map(_) | Shape::Named(_) => json!({}),
        Shape::Whole { .. } | Shape::Number(_) | Shape::Flag => {
            serde_json::from_str(text).unwrap_or(Value::Null)
        }
        Shape::List { .. } | Shape::Tuple(..) | Shape::Numbers => {
            let inner = text.trim_matches(['[', ']']);
            json!(
                inner
                    .split(',')
                    .map(str::trim)
                    .filter(|t| !t.is_empty())
                    .collect::<Vec<_>>()
            )
        }
        _ => json!(text),
    }
}

fn reference(table: &'static Table, definitions: &mut Definitions) -> Map<String, Value> {
    if !definitions.contains_key(table.name) {
        definitions.insert(table.name, Value::Null);
        let value = Value::Object(object(table, definitions));
        definitions.insert(table.name, value);
    }
    let mut map = Map::new();
    map.insert("$ref".into(), json!(format!("#/$defs/{}", table.name)));
    map
}

fn shape(of: &'static Shape, definitions: &mut Definitions) -> Map<String, Value> {
    let value = match of {
        Shape::Text => json!({"type": ["string", "number", "boolean"], "minLength": 1}),
        Shape::Whole { min, max } if *max == i64::MAX => json!({"type": "integer", "minimum": min}),
        Shape::Whole { min, max } => json!({"type": "integer", "minimum": min, "maximum": max}),
        Shape::Number(range) => {
            let low = if range.above {
                "exclusiveMinimum"
            } else {
                "minimum"
            };
            json!({"type": "number", low: range.min, "maximum": range.max})
        }
        Shape::Flag => json!({"type": "boolean"}),
        Shape::Quantity(dimensions, range) => json!({
            "type": "string",
            "pattern": pattern(dimensions, range),
            "examples": dimensions.iter().map(|d| d.example()).collect::<Vec<_>>(),
        }),
        Shape::Choice(words) => json!({"oneOf": choices(words)}),
        Shape::Tuple(of, names) => json!({
            "type": "array",
            "items": shape(of, definitions),
            "minItems": names.len(),
            "maxItems": names.len(),
        }),
        Shape::List { of, min, max } => {
            json!({"type": "array", "items": shape(of, definitions), "minItems": min, "maxItems": max})
        }
        Shape::Map(table) => return reference(table, definitions),
        Shape::WordOr(words, table) => {
            let mut options = choices(words);
            options.push(Value::Object(reference(table, definitions)));
            json!({"oneOf": options})
        }
        Shape::Named(of) => {
            json!({"type": "object", "additionalProperties": shape(of, definitions)})
        }
        Shape::Numbers => numbers(),
    };
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

fn choices(words: &[Word]) -> Vec<Value> {
    words
        .iter()
        .map(|(word, doc)| json!({"const": word, "description": doc}))
        .collect()
}

fn numbers() -> Value {
    let item = json!({"oneOf": [
        {"type": "integer", "minimum": 1},
        {"type": "string", "pattern": "^[0-9]+ *- *[0-9]+$"},
    ]});
    json!({"oneOf": [{"type": "array", "items": item}, item]})
}

/// A regular expression for a number with one of the units, and a quotient.
fn pattern(dimensions: &[Dimension], range: &ValueRange) -> String {
    let units: Vec<&str> = dimensions
        .iter()
        .flat_map(|d| d.units())
        .map(|(unit, _)| *unit)
        .collect();
    let sign = if range.min >= 0.0 { "[+]?" } else { "[+-]?" };
    format!(
        r"^\s*{sign}([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?\s*({})(\s*/\s*[0-9]+)?\s*$",
        units.join("|")
    )
}
