//! The page: verdict, figure and table.

use super::{HEADS, ScenePrediction, cells, failures, figure, sentence};
use crate::document::{Banner, Document, Group, Row, Section, Table, Text, paragraph, soft};
use crate::format::capitalised;

/// A self-contained page.
#[must_use]
pub fn page(found: &ScenePrediction) -> String {
    let words = "The predictions come from simulated sessions.";
    let differences = found.differing();
    let list = differences.iter().fold(Group::card(), |card, row| {
        card.with(paragraph(capitalised(&sentence(row))))
    });
    let list = (!differences.is_empty()).then_some(list);
    Document {
        title: "A session and its scene · skinrig scene predict".to_owned(),
        brand: "skinrig scene predict",
        heading: capitalised(&found.verdict()),
        heading_id: "heading",
        subheads: vec![
            Text::from(format!("{} ({})", found.session, found.origin)),
            Text::from(format!("Scene: {}", found.scene_in_words())),
        ],
        banners: vec![Banner::note("simulated", "Simulated", words)],
        skip: ("#figures", "Skip to the figures"),
        sections: vec![
            Section::new("figures", "Figures")
                .with_all(list)
                .with_all(figure::deviations(found))
                .with(Group::card().with(table(found)))
                .with_all(failures(found).map(soft)),
        ],
        about: "Each simulated session is a draw of the scene with other seeds: other noise, pixels, camera places. If the scene is \
                right, the session is one more draw. Intervals: Student's t over the simulated sessions. p: corrected for the \
                number of figures (Holm 1979)."
            .to_owned(),
        data: Some(crate::tables::of_prediction(found)),
        ..Document::default()
    }
    .html()
}

fn table(found: &ScenePrediction) -> Table {
    let heads = HEADS.map(|head| match head {
        "figure" => head.to_owned(),
        number => format!("#{number}"),
    });
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let rows = found.figures.iter().map(|row| Row::new(cells(row)));
    Table::new(
        "prediction-table",
        "Figures of the session and of the simulated sessions",
        &heads,
    )
    .with(rows)
}
