//! Owns the answer with the settings in which two analyses differ.

use serde::Deserialize;
use serde_json::{Value, json};

use crate::folder::Folder;
use crate::lab::Lab;
use crate::problem::Problem;

/// Two sessions of the folder, each with the name of a variant; the official analysis without.
#[derive(Debug, Deserialize)]
pub(crate) struct Pair {
    a: String,
    b: String,
    #[serde(default)]
    a_analysis: Option<String>,
    #[serde(default)]
    b_analysis: Option<String>,
}

/// The differences, and the number of settings.
pub(crate) fn document(lab: &dyn Lab, folder: &Folder, pair: &Pair) -> Result<Value, Problem> {
    let (a, b) = (folder.session(&pair.a)?, folder.session(&pair.b)?);
    let sides = [
        (&*a, pair.a_analysis.as_deref()),
        (&*b, pair.b_analysis.as_deref()),
    ];
    let (differences, keys) = lab.differences(sides)?;
    Ok(json!({ "differences": differences, "keys": keys }))
}
