//! Owns the data behind the figures of a comparison, for the page's CSV downloads.

use serde_json::{Value, json};
use skinrig_compare::Comparison;

use crate::tables::Table;

/// Named tables in column-wise layout.
pub(super) fn script_data(result: &Comparison) -> Value {
    json!({
        "session": "comparison",
        "tables": {
            "locations": locations(result),
            "metrics": metrics(result),
            "causes": causes(result),
        },
    })
}

fn locations(result: &Comparison) -> Value {
    let table = Table::of(&result.locations)
        .any("x_mm", |l| l.at.x_mm)
        .any("y_mm", |l| l.at.y_mm);
    let skins = result.skins.iter().enumerate();
    let all = skins.fold(table, |table, (k, skin)| {
        let name = |what: &str| format!("{}_{what}", skin.letter);
        table
            .any(name("error_mm"), |l| l.skins[k].error_mm)
            .any(name("vector_x_mm"), |l| l.skins[k].vector_mm.map(|v| v[0]))
            .any(name("vector_y_mm"), |l| l.skins[k].vector_mm.map(|v| v[1]))
            .any(name("presses"), |l| l.skins[k].presses[0])
            .any(name("attempted"), |l| l.skins[k].presses[1])
            .any(name("rank"), |l| l.skins[k].rank)
            .any(name("difference_mm"), |l| {
                l.skins[k].difference_mm.map(|d| d.value)
            })
            .any(name("difference_low_mm"), |l| {
                l.skins[k].difference_mm.and_then(|d| d.low)
            })
            .any(name("difference_high_mm"), |l| {
                l.skins[k].difference_mm.and_then(|d| d.high)
            })
    });
    all.finish()
}

fn metrics(result: &Comparison) -> Value {
    let rows = result.table.iter();
    let rows = rows.flat_map(|row| row.against_first.iter().map(move |found| (row, found)));
    Table::of(rows)
        .any("metric", |(row, _)| row.metric.key())
        .any("unit", |(row, _)| row.unit)
        .any("skin", |(_, f)| result.skins[f.subject].letter)
        .any("a", |(_, f)| f.comparison.as_ref().map(|c| c.a.value))
        .any("b", |(_, f)| f.comparison.as_ref().map(|c| c.b.value))
        .any("difference", |(_, f)| f.difference().map(|of| of.value))
        .any("low", |(_, f)| f.difference().and_then(|of| of.low))
        .any("high", |(_, f)| f.difference().and_then(|of| of.high))
        .any("margin", |(row, _)| row.margin)
        .any("verdict", |(_, f)| f.verdict)
        .finish()
}

fn causes(result: &Comparison) -> Value {
    let skins = result.skins.iter().skip(1).zip(&result.causes);
    let parts = skins.flat_map(|(skin, causes)| {
        let parts = causes.iter().flat_map(|c| &c.contributions);
        parts.map(move |part| (skin.letter, part))
    });
    Table::of(parts)
        .any("skin", |(letter, _)| *letter)
        .any("factor", |(_, part)| part.factor)
        .any("mm2", |(_, part)| part.mm2.value)
        .any("low_mm2", |(_, part)| part.mm2.low)
        .any("high_mm2", |(_, part)| part.mm2.high)
        .finish()
}
