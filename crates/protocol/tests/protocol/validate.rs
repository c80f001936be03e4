//! A JSON Schema validator for the keywords of the generated schemas.

use serde_json::Value;

/// Validates a value. `Err` names the first location that does not fit.
pub(crate) fn validate(
    schema: &Value,
    value: &Value,
    root: &Value,
    place: &str,
) -> Result<(), String> {
    let fail = |what: &str| Err(format!("{place}: {what}: {value}"));
    if let Some(reference) = schema.get("$ref").and_then(Value::as_str) {
        let target = root.pointer(reference.trim_start_matches('#'));
        validate(target.expect("a definition"), value, root, place)?;
    }
    if let Some(types) = schema.get("type") {
        let is = |t: &str| match t {
            "object" => value.is_object(),
            "array" => value.is_array(),
            "string" => value.is_string(),
            "integer" => value.is_i64() || value.is_u64(),
            "number" => value.is_number(),
            "boolean" => value.is_boolean(),
            other => panic!("unknown type {other}"),
        };
        let fits = match types {
            Value::Array(list) => list.iter().any(|t| is(t.as_str().unwrap())),
            one => is(one.as_str().unwrap()),
        };
        if !fits {
            return fail("type");
        }
    }
    if schema.get("const").is_some_and(|c| c != value) {
        return fail("const");
    }
    let number = value.as_f64();
    for (word, ok) in [
        ("minimum", (|v, l| v >= l) as fn(f64, f64) -> bool),
        ("maximum", |v, l| v <= l),
        ("exclusiveMinimum", |v, l| v > l),
    ] {
        if let (Some(limit), Some(v)) = (schema.get(word).and_then(Value::as_f64), number)
            && !ok(v, limit)
        {
            return fail(word);
        }
    }
    for part in schema
        .get("allOf")
        .and_then(Value::as_array)
        .into_iter()
        .flatten()
    {
        validate(part, value, root, place)?;
    }
    if let Some(options) = schema.get("oneOf").and_then(Value::as_array) {
        let fitting = options
            .iter()
            .filter(|o| validate(o, value, root, place).is_ok())
            .count();
        if fitting != 1 {
            return fail("oneOf");
        }
    }
    for key in schema
        .get("required")
        .and_then(Value::as_array)
        .into_iter()
        .flatten()
    {
        if value.get(key.as_str().unwrap()).is_none() {
            return fail(&format!("required {key}"));
        }
    }
    if let Some(object) = value.as_object() {
        for (key, inner) in object {
            let place = format!("{place}.{key}");
            match (
                schema.pointer(&format!("/properties/{key}")),
                schema.get("additionalProperties"),
            ) {
                (Some(of), _) => validate(of, inner, root, &place)?,
                (None, Some(Value::Bool(false))) => return Err(format!("{place}: unknown key")),
                (None, Some(of)) => validate(of, inner, root, &place)?,
                (None, None) => {}
            }
        }
    }
    if let Some(list) = value.as_array() {
        let limit = |word| schema.get(word).and_then(Value::as_u64).map(|n| n as usize);
        if limit("minItems").is_some_and(|n| list.len() < n)
            || limit("maxItems").is_some_and(|n| list.len() > n)
        {
            return fail("length");
        }
        if let Some(of) = schema.get("items") {
            for (k, item) in list.iter().enumerate() {
                validate(of, item, root, &format!("{place}[{k}]"))?;
            }
        }
    }
    Ok(())
}
