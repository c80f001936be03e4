//! The data behind the figure of `skinrig scene predict`.

use serde_json::{Value, json};

use super::table::Table;
use crate::scene_prediction::ScenePrediction;

/// Data for the script of the page: a row per figure.
pub(crate) fn of_prediction(found: &ScenePrediction) -> Value {
    let rows = Table::of(found.figures.iter())
        .any("figure", |row| row.figure)
        .number("session", 6, |row| row.session)
        .number("predicted", 6, |row| row.predicted.map(|p| p.middle))
        .number("low", 6, |row| row.predicted.map(|p| p.low))
        .number("high", 6, |row| row.predicted.map(|p| p.high))
        .number("deviations", 3, |row| {
            row.predicted.and_then(|p| p.deviations)
        })
        .number("p", 6, |row| row.predicted.and_then(|p| p.p))
        .any("replicates", |row| row.replicates)
        .finish();
    json!({ "session": found.session, "tables": { "prediction": rows } })
}
