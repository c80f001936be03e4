//! Owns the figure of the threshold choice.

use super::canvas::{Canvas, Figure, nice_above};
use crate::axes::{Axes, Scale};
use crate::format::number;
use crate::input::ReportInput;
use crate::svg::{Px, dots, polyline};

/// Root mean square cost of each candidate for the minimum number of cluster events, the chosen one marked. `None` if the
/// threshold was not chosen automatically.
#[must_use]
pub fn threshold(input: &ReportInput<'_>) -> Option<Figure> {
    let choice = input.analysis.threshold.as_ref()?;
    let rows: Vec<(f64, f64)> = choice
        .candidates
        .iter()
        .filter(|(_, cost)| cost.is_finite())
        .map(|(events, cost)| (f64::from((*events).max(1)).log10(), *cost))
        .collect();
    if rows.is_empty() {
        return None;
    }
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
    let mut canvas = Canvas::new(
        input,
        "threshold",
        "Choice of the threshold",
        caption,
        (620.0, 480.0),
        &[],
    );
    let span = |pick: fn(f64, f64) -> f64, from: f64| rows.iter().map(|r| r.0).fold(from, pick);
    let (low, high) = (
        span(f64::min, f64::INFINITY),
        span(f64::max, f64::NEG_INFINITY),
    );
    let margin = 0.04 * (high - low).max(0.5);
    let most = rows.iter().map(|r| r.1).fold(0.0, f64::max);
    let axes = Axes {
        x: Scale::new((low - margin, high + margin), (66.0, 604.0)),
        y: Scale::new((0.0, nice_above(most * 1.05)), (412.0, 30.0)),
        x_label: "minimum number of cluster events".into(),
        y_label: "cost on calibration presses (mm)".into(),
        tick_count: (0, 6),
    };
    let marks: Vec<_> = (0..=9)
        .flat_map(|p| [1u64, 2, 5].map(|m| m * 10u64.pow(p)))
        .map(|m| ((m as f64).log10(), m.to_string()))
        .filter(|(at, _)| (axes.x.data.0..=axes.x.data.1).contains(at))
        .collect();
    let step = crate::axes::ticks(axes.y.data.0, axes.y.data.1, 6);
    let distance = if step.len() > 1 {
        step[1] - step[0]
    } else {
        1.0
    };
    let ys: Vec<_> = step
        .iter()
        .map(|t| (*t, crate::axes::tick_label(*t, distance)))
        .collect();
    let svg = &mut canvas.svg;
    axes.draw_with(svg, &marks, &ys);
    let points: Vec<_> = rows
        .iter()
        .map(|(x, y)| (axes.x.at(*x), axes.y.at(*y)))
        .collect();
    svg.path("line c1", &polyline(points.iter().copied(), false));
    svg.path("dots c1", &dots(points));
    let chosen = f64::from(choice.events.max(1)).log10();
    let nearest = rows
        .iter()
        .min_by(|a, b| (a.0 - chosen).abs().total_cmp(&(b.0 - chosen).abs()));
    if let Some((_, cost)) = nearest {
        let (x, y) = (axes.x.at(chosen), axes.y.at(*cost));
        svg.leaf(
            "circle",
            &[
                ("class", &"ring"),
                ("cx", &Px(x)),
                ("cy", &Px(y)),
                ("r", &"8"),
            ],
        );
        let least = if floor { ", smallest candidate" } else { "" };
        let text = format!("{} events{least}", choice.events);
        // On the side with more space.
        let (dx, anchor) = if x < 400.0 {
            (4.0, "start")
        } else {
            (-4.0, "end")
        };
        svg.text((x + dx, y - 14.0), "note halo", anchor, &text);
    }
    Some(canvas.finish(&format!("n = {} presses", choice.n), "threshold", ""))
}
