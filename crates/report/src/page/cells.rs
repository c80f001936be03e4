//! Owns what several sections share: the cells of an estimate, and the card of something missing.

use skinrig_analysis::result::Estimate;

use crate::document::{Block, Group, Text, paragraph};
use crate::format::{interval, number};

/// Cells of an estimate: name, value, interval, number of samples. The numbers are multiplied by `scale`.
pub(super) fn estimate(name: &str, e: &Estimate, scale: f64, digits: usize) -> [String; 4] {
    let value = number(e.value.map(|v| v * scale), digits);
    let interval = interval(e, scale, digits);
    [name.to_owned(), value, interval, e.n.to_string()]
}

/// Says in a card why something is missing.
pub(super) fn missing(test_id: &str, why: impl Into<Text>) -> Block {
    let card = Group::card().class("soft");
    let card = match test_id {
        "" => card,
        id => card.test_id(id),
    };
    card.with(paragraph(why)).into()
}
