//! Owns the figure of the threshold choice.

use super::origin::foot;
use crate::format::number;
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, HALF, Plot, Sheet, extent};

/// Root mean square cost of each candidate for the minimum number of cluster events, the chosen one marked. `None` if the
/// threshold was not chosen automatically.
#[must_use]
pub fn threshold(input: &ReportInput<'_>) -> Option<Figure> {
    let choice = input.analysis.threshold.as_ref()?;
    let candidates = choice
        .candidates
        .iter()
        .filter(|(_, cost)| cost.is_finite());
    let rows: Vec<(f64, f64)> = candidates
        .map(|(events, cost)| (f64::from((*events).max(1)), *cost))
        .collect();
    let (low, high) = extent(rows.iter().map(|r| r.0))?;
    let floor = choice.candidates.first().map(|(events, _)| *events) == Some(choice.events);
    let mut caption = format!(
        "Choice of the minimum number of cluster events, on the {} calibration presses alone. Cost of a threshold: \
         root mean square error over presses, where a rejected press counts {} mm (the error of a blind guess) and a \
         kept one at most sqrt(2) times as much. Ring: the chosen threshold, {} events in the weaker camera; it \
         rejects {} presses.",
        choice.n,
        number(Some(choice.penalty_mm), 1),
        choice.events,
        choice.left_out,
    );
    if floor {
        caption += &choice.chance.map_or_else(
            || " It is the smallest candidate: no larger one costs less.".to_owned(),
            |p| {
                let p = number(Some(p), 3);
                format!(
                    "It is the smallest candidate: the gain of a larger one could be chance (p = {p}), or depends on a \
                     single location."
                )
            },
        );
    } else if let Some(p) = choice.chance {
        let p = number(Some(p), 3);
        caption += &format!(" A gain this large by chance has p = {p} (permutation test).");
    }
    let margin = libm::pow(high / low, 0.04).max(1.05);
    let x = Axis::log(
        (low / margin, high * margin),
        "minimum number of cluster events",
    );
    let costs = rows.iter().map(|r| r.1 * 1.05);
    let y = Axis::from_zero(costs, "cost on calibration presses (mm)").ticks(6);
    let chosen = f64::from(choice.events.max(1));
    let away = |row: &(f64, f64)| libm::log(row.0 / chosen).abs();
    let nearest = rows.iter().min_by(|a, b| away(a).total_cmp(&away(b)))?;
    let at = (chosen, nearest.1);
    let least = if floor { ", smallest candidate" } else { "" };
    let plot = Plot::new(x, y)
        .line("line c1", rows.iter().copied())
        .dots("dots c1", rows.iter().copied())
        .ring("ring", at)
        .text(
            "note halo",
            at,
            (4.0, -14.0),
            format!("{} events{least}", choice.events),
        );
    let title = "Choice of the threshold";
    let sheet = Sheet::new("threshold", title, caption, HALF).row(382.0, [plot]);
    Some(sheet.finish(
        &foot(input),
        &format!("n = {} presses", choice.n),
        "threshold",
    ))
}
