//! Owns the figure of the causes of a change.

use skinrig_compare::{Causes, Comparison};
use skinrig_statistics::Interval;

use super::{foot, sign_class};
use crate::format::number;
use crate::plot::{Axis, Figure, Plot, Sheet, extent, rectangle};
use crate::svg::Px;

const ROW: f64 = 38.0;

/// Contributions to the change of the mean square error between the first skin and skin `k`.
pub(in crate::compare) fn causes(result: &Comparison, k: usize, of: &Causes) -> Figure {
    let letter = result.skins[k].letter;
    let parts = of.contributions.iter().map(|c| (c.factor.name(), &c.mm2));
    let rows: Vec<(&str, &Interval)> = [("total change", &of.change_mm2)]
        .into_iter()
        .chain(parts)
        .collect();
    let caption = format!(
        "Contributions to the change of the mean square error from A ({} mm²) to {letter} ({} mm²), with 95 % \
         intervals over locations. The parts add up to the change. Left of zero: lowers the error.",
        number(Some(of.mse_mm2[0]), 3),
        number(Some(of.mse_mm2[1]), 3)
    );
    let ends = rows
        .iter()
        .flat_map(|(_, i)| [Some(i.value), i.low, i.high]);
    let (low, high) = extent(ends.flatten().chain([0.0])).unwrap_or((0.0, 0.0));
    let room = 0.06 * (high - low).max(1e-9);
    let label = "contribution to the change of the mean square error (mm²)";
    let x = Axis::linear((low - room, high + room), label).ticks(6);
    let names = rows.iter().map(|(name, _)| (*name).to_owned());
    let n = rows.len();
    let mut plot = Plot::new(x, Axis::categories(names, "").downwards()).upright("axis", 0.0);
    for (i, (_, part)) in rows.into_iter().enumerate() {
        let sure = part.low.is_some_and(|l| l > 0.0) || part.high.is_some_and(|h| h < 0.0);
        let sign = match (sure, part.value < 0.0) {
            (false, _) => 0,
            (true, true) => -1,
            (true, false) => 1,
        };
        plot = plot.draw(move |svg, place| {
            let y = place.y.at(i as f64);
            let (zero, at) = (place.x.at(0.0), place.x.at(part.value));
            let whole = if i == 0 { "whole " } else { "" };
            let class = format!("{whole}{}", sign_class(sign));
            let width = (at - zero).abs().max(0.8);
            rectangle(svg, &class, (zero.min(at), y - 10.0, width, 20.0));
            if let (Some(low), Some(high)) = (part.low, part.high) {
                let (low, high) = (Px(place.x.at(low)), Px(place.x.at(high)));
                let (y, end) = (Px(y), Px(y - 4.0));
                let data = format!("M{low} {y}H{high}M{low} {end}v8M{high} {end}v8");
                svg.path("interval", &data);
            }
            let (left, _, width, _) = place.frame();
            let right = left + width;
            let class = if i == 0 { "panel" } else { "tick ink" };
            let text = number(Some(part.value), 3);
            svg.text((right + 86.0, y + 4.0), class, "end", &text);
            if i == 0 {
                svg.line("axis", (14.0, y + ROW / 2.0), (right + 86.0, y + ROW / 2.0));
            }
        });
    }
    let title = "Contributions to the change";
    Sheet::new(&format!("causes-{k}"), title, caption, 900.0)
        .margins(300.0, 100.0)
        .row(ROW * n as f64, [plot])
        .finish(&foot(result, k), "", "causes")
}
