//! The data behind the figures of `skinrig twin`.

use serde_json::{Value, json};

use super::table::Table;
use crate::twin::SessionTwin;

/// Data for the script of the page: a row per constant, and one per place.
pub(crate) fn of_twin(found: &SessionTwin) -> Value {
    let constants = Table::of(found.twin.constants.iter())
        .any("constant", |row| row.constant.key())
        .number("value", 6, |row| Some(row.value.middle))
        .number("low", 6, |row| Some(row.value.low))
        .number("high", 6, |row| Some(row.value.high))
        .any("unit", |row| row.constant.unit())
        .number("explained", 4, |row| Some(row.explained))
        .finish();
    let places = found.twin.places.iter();
    let places = places.flat_map(|p| p.places.iter().zip(&p.predicted_mm));
    let places = Table::of(places)
        .any("location", |(place, _)| place.location)
        .number("x_mm", 4, |(place, _)| Some(place.at.x_mm))
        .number("y_mm", 4, |(place, _)| Some(place.at.y_mm))
        .number("predicted_mm", 4, |(_, predicted)| **predicted)
        .number("recorded_mm", 4, |(place, _)| place.scored_mm)
        .finish();
    json!({ "session": found.session, "tables": { "constants": constants, "places": places } })
}
