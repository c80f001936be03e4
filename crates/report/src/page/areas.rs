//! Owns the tables of areas, taxels, contact maps and data rates.

use skinrig_analysis::result::{Analysis, Estimate};

use super::cells::estimate;
use crate::document::Table;
use crate::format::{NONE, contact_map, interval, number, rounded_to_interval};
use crate::published;

/// Areas and taxels beside the published ones.
pub(super) fn coverage(a: &Analysis) -> Option<Table> {
    let c = a.coverage.as_ref()?;
    let mut grid = Table::new(
        "coverage",
        "Areas and taxels",
        &["Quantity", "#Session", "#95 % interval", "#Published"],
    );
    let [skin, seen, probed] = published::AREAS_MM2;
    let share = |part: f64, whole: f64| {
        if whole > 0.0 {
            format!(" ({} %)", number(Some(100.0 * part / whole), 1))
        } else {
            String::new()
        }
    };
    let area = |name: &str, value: Option<f64>, of: Option<f64>, theirs: f64, their_share: &str| {
        let parts = value.zip(of);
        let share = parts.map_or_else(String::new, |(value, whole)| share(value, whole));
        [
            name.to_owned(),
            format!("{}{share}", number(value, 0)),
            NONE.to_owned(),
            format!("{theirs}{their_share}"),
        ]
    };
    grid.row(area("skin (mm²)", Some(c.skin_mm2), None, skin, ""));
    grid.row(area(
        "seen by both cameras (mm², share of the skin)",
        Some(c.seen_by_both_mm2),
        Some(c.skin_mm2),
        seen,
        " (93.9 %)",
    ));
    grid.row(area(
        "probed (mm², share of the seen area)",
        c.probed_mm2,
        Some(c.seen_by_both_mm2),
        probed,
        " (52.7 %)",
    ));
    let taxels = |name: &str, e: &Estimate, theirs: f64| {
        let (e, digits) = rounded_to_interval(e);
        [
            name.to_owned(),
            number(e.value, digits),
            interval(&e, 1.0, digits),
            theirs.to_string(),
        ]
    };
    grid.row(taxels(
        "effective taxels, probed area",
        &c.taxels_probed,
        published::TAXELS.1,
    ));
    grid.row(taxels(
        "effective taxels, whole skin",
        &c.taxels_skin,
        published::TAXELS.0,
    ));
    let cell = c.cell_mm.map_or_else(String::new, |mm| {
        format!(
            ", one cell of {} mm for each of {} locations",
            number(Some(mm), 2),
            c.locations
        )
    });
    grid.note(format!(
        "Taxels: circles of radius RMSE that fill the area. The RMSE was measured in the probed area only{cell}; the \
         number for the whole skin assumes the same RMSE everywhere, which was not tested."
    ));
    grid.note("The published number of taxels requires a radius of 5.31 mm instead of the published RMSE of 4.66 mm, \
        and an area of 64 x 64 mm instead of 4620 mm².");
    grid.download("coverage");
    Some(grid)
}

/// Contact map reconstruction error with its parameters.
pub(super) fn cmre(a: &Analysis) -> Option<Table> {
    let c = a.cmre.as_ref()?;
    let mut grid = Table::new(
        "cmre",
        "Contact map",
        &["Quantity", "#Session", "#95 % interval", "#n"],
    );
    grid.row([
        "imbalance of the contact map [95 % interval]".to_owned(),
        contact_map(&c.percent),
        NONE.to_owned(),
        c.percent.n.to_string(),
    ]);
    grid.row([
        "RMSE, share of the skin's diagonal (%)".to_owned(),
        number(a.scored.rmse_diagonal_percent, 2),
        interval(&a.scored.rmse_mm, percent_per_mm(a), 2),
        a.scored.rmse_mm.n.to_string(),
    ]);
    grid.note(
        "Imbalance, by the public code's formula: brightness that the map of the estimate lacks in the true cell, minus \
         brightness that it has outside, weighted by distance. Missing: the first is larger; outside: the second is, as \
         for an estimate between two cells. It is a score of cells, not a share; the share of the diagonal is one.",
    );
    grid.note(format!(
        "Parameters: {} x {} cells of {} mm, Gaussian of {} mm, SR of {} mm. None of them is published, so this number \
         is not comparable with the published 3.75 %, which equals an RMSE of 5.30 mm as a share of the diagonal.",
        c.cells.0,
        c.cells.1,
        number(Some(c.settings.cell_mm), 1),
        number(Some(c.settings.sigma_mm), 1),
        number(Some(c.settings.sr_mm), 0),
    ));
    if c.without_score > 0 {
        grid.note(format!(
            "{} presses are outside the map and have no score.",
            c.without_score
        ));
    }
    grid.download("cmre");
    Some(grid)
}

/// One millimetre as a share of the skin's diagonal, %.
fn percent_per_mm(a: &Analysis) -> f64 {
    100.0 / a.rig.outline.diagonal_mm()
}

/// Data rates during presses and while idle.
pub(super) fn bit_rates(a: &Analysis) -> Option<Table> {
    let r = a.bit_rates.as_ref()?;
    let mut grid = Table::new(
        "bit-rates",
        "Data rates",
        &[
            "Both cameras together",
            "#Session",
            "#95 % interval",
            "#n",
            "#Published",
        ],
    );
    let row = |name: &str, e: &Estimate, scale: f64, digits: usize, theirs: &str| {
        let own = estimate(name, e, scale, digits);
        own.into_iter().chain([theirs.to_owned()])
    };
    grid.row(row(
        "press window (kev/s)",
        &r.press_events_per_s,
        1e-3,
        2,
        "28.6",
    ));
    grid.row(row("idle (kev/s)", &r.idle_events_per_s, 1e-3, 2, "9.1"));
    grid.row(row(
        "press window (kB/s)",
        &r.press_bytes_per_s,
        1e-3,
        2,
        "~75",
    ));
    grid.row(row("idle (kB/s)", &r.idle_bytes_per_s, 1e-3, 2, "~24"));
    grid.row(row(
        "press, contact to release (s)",
        &r.press_s,
        1.0,
        2,
        "0.55",
    ));
    grid.note(format!(
        "Events in the rows of the crop; bytes at {} bits per event. The press window begins before the contact and ends \
         after the release (`analysis.window_before`, `window_after`), so its rates are below those between the two. The \
         published event rates are derived from the published bytes at 21 bits.",
        number(Some(r.bits_per_event), 0)
    ));
    grid.download("bit_rates");
    Some(grid)
}
