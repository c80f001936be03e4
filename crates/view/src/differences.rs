//! Owns the answer with the settings in which two sessions differ.

use std::collections::BTreeSet;
use std::path::Path;

use serde_json::{Value, json};

use crate::lab::Lab;
use crate::problem::Problem;

/// Keys whose values differ, with both values (`null`: the session has no such key), and the number of equal ones.
pub(crate) fn document(lab: &dyn Lab, sessions: [&Path; 2]) -> Result<Value, Problem> {
    let [one, two] = [lab.facts(sessions[0])?, lab.facts(sessions[1])?];
    let keys: BTreeSet<&String> = one.keys().chain(two.keys()).collect();
    let of = keys.len();
    let rows: Vec<Value> = keys
        .into_iter()
        .map(|key| (key, one.get(key), two.get(key)))
        .filter(|(_, a, b)| a != b)
        .map(|(key, a, b)| json!({ "key": key, "a": a, "b": b }))
        .collect();
    Ok(json!({ "differences": rows, "keys": of }))
}
