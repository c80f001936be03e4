//! Problems as they are in `data/*.json`, and what skinrig makes of them.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::Value;

/// Problems of one kind.
#[derive(Debug, Deserialize)]
pub(crate) struct Family {
    /// Name, also of its file.
    pub family: String,
    pub problems: Vec<Problem>,
}

/// One problem.
#[derive(Debug, Deserialize)]
pub(crate) struct Problem {
    pub name: String,
    /// `easy`, `average` or `hard`.
    pub level: String,
    /// `solved`, or why there is no answer.
    pub outcome: String,
    pub inputs: Value,
    pub answers: Vec<Answer>,
}

/// A certified number.
#[derive(Debug, Deserialize)]
pub(crate) struct Answer {
    pub quantity: String,
    /// 30 digits.
    pub value: String,
    /// Relative change of the answer per relative change of the inputs.
    pub condition: f64,
}

/// What skinrig makes of a problem.
#[derive(Debug, PartialEq)]
pub(crate) enum Solution {
    /// Its values, by quantity.
    Values(Vec<(&'static str, f64)>),
    /// Refused: the outcome in the words of the data, the type that says so, and the values that there are all the same.
    Refused(String, &'static str, Vec<(&'static str, f64)>),
    /// Takes minutes, and was not asked for.
    Skipped,
}

/// Folder of this package.
pub(crate) fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

/// The problems of a family.
pub(crate) fn family(name: &str) -> Family {
    let path = folder().join("data").join(name).with_extension("json");
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

impl Problem {
    /// A number of the inputs.
    pub(crate) fn number(&self, key: &str) -> f64 {
        self.inputs[key].as_f64().unwrap()
    }

    /// Numbers of the inputs.
    pub(crate) fn numbers(&self, key: &str) -> Vec<f64> {
        numbers(&self.inputs[key])
    }

    /// Rows of numbers of the inputs.
    pub(crate) fn rows(&self, key: &str) -> Vec<Vec<f64>> {
        let rows = self.inputs[key].as_array().unwrap();
        rows.iter().map(numbers).collect()
    }
}

/// A list of numbers.
pub(crate) fn numbers(list: &Value) -> Vec<f64> {
    let list = list.as_array().unwrap();
    list.iter().map(|v| v.as_f64().unwrap()).collect()
}
