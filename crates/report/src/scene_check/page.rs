//! The page: what differs in a table, and figures of the recordings side by side.

use super::figures;
use super::rows::{ROWS, Recording, cameras, remarks, source};
use crate::document::{Banner, Document, Group, Row, Section, Table, Text, soft};

/// A self-contained page.
#[must_use]
pub fn page(recordings: &[Recording]) -> String {
    let names = recordings.iter().enumerate().map(source);
    let stand_ins = recordings.iter().filter(|r| r.is_stand_in).count();
    let banner = (stand_ins > 0).then(|| {
        let words = "Not every recording comes from cameras: see the kind of rig of each.";
        Banner::note("simulated", "Simulated or emulated", words)
    });
    Document {
        title: "Events of recordings · skinrig scene check".to_owned(),
        brand: "skinrig scene check",
        heading: "How like a camera".to_owned(),
        heading_id: "heading",
        subheads: names.map(Text::from).collect(),
        banners: banner.into_iter().collect(),
        skip: ("#statistics", "Skip to the statistics"),
        sections: vec![
            Section::new("statistics", "Statistics").with(Group::card().with(table(recordings))).with_all(
                remarks(recordings).into_iter().map(soft),
            ),
            Section::new("figures", "Figures").with_all(figures::all(recordings)),
        ],
        about: "Where a recording and a simulation of its protocol differ, the simulation is not like the camera.".to_owned(),
        data: Some(crate::tables::of_events(&cameras(recordings.iter().enumerate()))),
        ..Document::default()
    }
    .html()
}

fn table(recordings: &[Recording]) -> Table {
    let cameras = cameras(recordings.iter().enumerate());
    let heads = cameras.iter().map(|(name, _)| format!("#{name}"));
    let heads: Vec<String> = std::iter::once("Statistic".to_owned())
        .chain(heads)
        .collect();
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    let rows = ROWS.map(|(name, cell)| {
        let cells = cameras.iter().map(|(_, camera)| cell(camera));
        Row::new(std::iter::once(name.to_owned()).chain(cells))
    });
    Table::new(
        "statistics-table",
        "Statistics of the events of each camera",
        &heads,
    )
    .with(rows)
}
