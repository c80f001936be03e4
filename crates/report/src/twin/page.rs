//! The page: verdict, predictions, constants, places, fitted figures.

use super::{
    CONSTANT_HEADS, FIGURE_HEADS, SessionTwin, constant_cells, figure_cells, figures,
    outcome_cells, outcome_heads,
};
use crate::document::{Banner, Document, Group, Row, Section, Table, Text, paragraph};
use crate::format::capitalised;

/// A self-contained page.
#[must_use]
pub fn page(found: &SessionTwin) -> String {
    let mut banners = vec![Banner::note(
        "simulated",
        "Simulated",
        "Predictions and constants come from simulated skins.",
    )];
    if !found.twin.is_like() {
        banners.push(Banner::alert(
            "no-twin",
            "No twin",
            "No simulated skin looks like this session: the scene lacks something. Nothing is predicted.",
        ));
    }
    let mut subheads = vec![Text::from(format!("{} ({})", found.session, found.origin))];
    subheads.extend(
        found
            .protocol
            .iter()
            .map(|p| Text::from(format!("Simulated protocol: {p}"))),
    );
    if !found.changed.is_empty() {
        subheads.push(Text::from(format!(
            "Changed protocol: {}",
            found.changed.join(", ")
        )));
    }
    let remarks = found.remarks();
    let remarks = (!remarks.is_empty()).then(|| {
        let card = |card: Group, remark: &String| card.with(paragraph(capitalised(remark)));
        remarks.iter().fold(Group::card(), card)
    });
    let mut predictions = Section::new("predictions", "Scored presses").with_all(remarks);
    let mut twin = None;
    if found.twin.is_like() {
        predictions = predictions.with(Group::card().with(outcomes(found)));
        let figures = Group::two()
            .with_all(figures::constants(found))
            .with_all(figures::places(found));
        let section = Section::new("twin", "The twin").with(figures);
        twin = Some(section.with(Group::card().with(constants(found))));
    }
    let fitted = Section::new("fitted", "Fitted to").with(Group::card().with(fitted(found)));
    Document {
        title: "The twin of a session · skinrig twin".to_owned(),
        brand: "skinrig twin",
        heading: capitalised(&found.verdict()),
        heading_id: "heading",
        subheads,
        banners,
        skip: ("#predictions", "Skip to the predictions"),
        sections: [Some(predictions), twin, Some(fitted)].into_iter().flatten().collect(),
        about: format!(
            "Skins are drawn from the assumed range of each constant and simulated by the protocol of the session. A ridge regression over \
             {} skins predicts constants and scored presses from the figures of the calibration presses; the residuals of skins that are \
             left out of it are the uncertainty (jackknife+, Barber et al. 2021). Intervals hold for sessions like these skins. \
             A session farther from the skins than each of them from the other ones has no twin.",
            found.twin.skins
        ),
        data: Some(crate::tables::of_twin(found)),
        ..Document::default()
    }
    .html()
}

fn numbers(heads: &[&str]) -> Vec<String> {
    let number = |(i, head): (usize, &&str)| {
        if i == 0 {
            (*head).to_owned()
        } else {
            format!("#{head}")
        }
    };
    heads.iter().enumerate().map(number).collect()
}

fn table(
    id: &str,
    title: &str,
    heads: &[&str],
    rows: impl IntoIterator<Item = Vec<String>>,
) -> Table {
    let heads = numbers(heads);
    let heads: Vec<&str> = heads.iter().map(String::as_str).collect();
    Table::new(id, title, &heads).with(rows.into_iter().map(Row::new))
}

fn outcomes(found: &SessionTwin) -> Table {
    let rows = found
        .twin
        .outcomes
        .iter()
        .map(|row| outcome_cells(row, found));
    table(
        "outcomes-table",
        "Scored presses, recorded and predicted",
        &outcome_heads(found),
        rows,
    )
}

fn constants(found: &SessionTwin) -> Table {
    let rows = found
        .twin
        .constants
        .iter()
        .map(|row| constant_cells(row).to_vec());
    table(
        "constants-table",
        "Constants of the twin",
        &CONSTANT_HEADS,
        rows,
    )
}

fn fitted(found: &SessionTwin) -> Table {
    let rows = found
        .twin
        .figures
        .iter()
        .map(|row| figure_cells(row).to_vec());
    table(
        "fitted-table",
        "Figures of the calibration presses",
        &FIGURE_HEADS,
        rows,
    )
}
