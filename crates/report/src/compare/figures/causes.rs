//! Owns the figure of the causes of a change.

use skinrig_compare::{Causes, Comparison};

use super::{BETTER, FigureBuilder, NEITHER, RenderedFigure, WORSE};
use crate::axes::{Scale, tick_label, ticks};
use crate::format::number;
use crate::svg::Px;

const WIDTH: f64 = 900.0;
const ROW: f64 = 38.0;
const TOP: f64 = 34.0;
const LEFT: f64 = 250.0;
const RIGHT: f64 = 800.0;

/// Contributions to the change of the mean square error between the first skin and skin `k`.
pub(in crate::compare) fn causes(result: &Comparison, k: usize, of: &Causes) -> RenderedFigure {
    let letter = result.skins[k].letter;
    let rows: Vec<(&str, &skinrig_compare::statistics::Interval, bool)> =
        std::iter::once(("total change", &of.change_mm2, true))
            .chain(
                of.contributions
                    .iter()
                    .map(|c| (c.factor.name(), &c.mm2, false)),
            )
            .collect();
    let height = TOP + ROW * rows.len() as f64 + 70.0;
    let caption = format!(
        "Contributions to the change of the mean square error from A ({} mm²) to {letter} ({} mm²), with 95 % \
         intervals over locations. The parts add up to the change. Left of zero: lowers the error.",
        number(Some(of.mse_mm2[0]), 3),
        number(Some(of.mse_mm2[1]), 3)
    );
    let title = "Contributions to the change".to_owned();
    let mut figure = FigureBuilder::new(
        &format!("causes-{k}"),
        title,
        caption,
        "causes",
        (WIDTH, height),
    );
    let all = rows
        .iter()
        .flat_map(|(_, i, _)| [Some(i.value), i.low, i.high])
        .flatten();
    let (low, high) = all.fold((0.0f64, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    let room = 0.06 * (high - low).max(1e-9);
    let scale = Scale::new((low - room, high + room), (LEFT, RIGHT));
    let bottom = TOP + ROW * rows.len() as f64;
    let svg = &mut figure.svg;
    let at = ticks(scale.data.0, scale.data.1, 6);
    let step = if at.len() > 1 { at[1] - at[0] } else { 1.0 };
    for t in at {
        svg.line("grid", (scale.at(t), TOP - 6.0), (scale.at(t), bottom));
        svg.text(
            (scale.at(t), bottom + 18.0),
            "tick",
            "middle",
            &tick_label(t, step),
        );
    }
    svg.line("axis", (scale.at(0.0), TOP - 6.0), (scale.at(0.0), bottom));
    svg.text(
        ((LEFT + RIGHT) / 2.0, bottom + 38.0),
        "label",
        "middle",
        "contribution to the change of the mean square error (mm²)",
    );
    for (i, (name, part, whole)) in rows.iter().enumerate() {
        let y = TOP + ROW * i as f64;
        let sure = part.low.is_some_and(|l| l > 0.0) || part.high.is_some_and(|h| h < 0.0);
        let fill = match (sure, part.value < 0.0) {
            (false, _) => NEITHER,
            (true, true) => BETTER,
            (true, false) => WORSE,
        };
        let (from, to) = (
            scale.at(0.0).min(scale.at(part.value)),
            scale.at(0.0).max(scale.at(part.value)),
        );
        let class = if *whole { "panel" } else { "tick ink" };
        svg.text((LEFT - 14.0, y + 19.0), class, "end", name);
        let style = format!("fill:{fill};opacity:{}", if *whole { "1" } else { ".8" });
        svg.leaf(
            "rect",
            &[
                ("x", &Px(from)),
                ("y", &Px(y + 5.0)),
                ("width", &Px((to - from).max(0.8))),
                ("height", &"20"),
                ("rx", &"2"),
                ("style", &style),
            ],
        );
        if let (Some(low), Some(high)) = (part.low, part.high) {
            let data = format!(
                "M{} {}H{}M{} {}v8M{} {}v8",
                Px(scale.at(low)),
                Px(y + 15.0),
                Px(scale.at(high)),
                Px(scale.at(low)),
                Px(y + 11.0),
                Px(scale.at(high)),
                Px(y + 11.0)
            );
            svg.leaf(
                "path",
                &[
                    ("d", &data),
                    ("style", &"fill:none;stroke:var(--ink);stroke-width:1.3"),
                ],
            );
        }
        svg.text(
            (WIDTH - 14.0, y + 19.0),
            class,
            "end",
            &number(Some(part.value), 3),
        );
        if *whole {
            svg.line("axis", (14.0, y + ROW - 4.0), (WIDTH - 14.0, y + ROW - 4.0));
        }
    }
    figure.finish(result, k, height)
}
