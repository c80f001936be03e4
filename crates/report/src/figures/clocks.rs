//! Owns the figure of clock fits: residuals of every fitted map over the session.

use skinrig_analysis::result::{ClockMap, ClockResiduals};

use super::canvas::{Canvas, Figure, nice_above};
use crate::axes::{Axes, Scale};
use crate::format::number;
use crate::input::ReportInput;
use crate::svg::{Px, dots};

/// Height of a row of panels, px.
const ROW: f64 = 232.0;

/// One panel per fitted clock map: residuals against host time. `None` without any.
#[must_use]
pub fn clock_residuals(input: &ReportInput<'_>) -> Option<Figure> {
    let alignment = &input.analysis.alignment;
    let maps = &alignment.residuals;
    if maps.is_empty() {
        return None;
    }
    let caption = "Residuals of each map between two clocks: observed minus mapped time, against session time. Dots: \
        points used by the fit; open squares at the edge: rejected points, wherever they lie. Above 600 points every \
        n-th is drawn, and the largest. The last two panels show one line through all trains: its curvature is the \
        wander of the clock rates, which the piecewise maps above follow."
        .to_owned();
    let rows = maps.len().div_ceil(2);
    let size = (1240.0, ROW * rows as f64 + 40.0);
    let mut canvas = Canvas::new(
        input,
        "clock-residuals",
        "Clock fits: residuals",
        caption,
        size,
        &[],
    );
    let ends = maps.iter().flat_map(|m| &m.points).map(|p| p.host_s);
    let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| {
        (l.min(t), h.max(t))
    });
    for (i, map) in maps.iter().enumerate() {
        let (left, top) = (66.0 + 614.0 * (i % 2) as f64, 34.0 + ROW * (i / 2) as f64);
        let axes = Axes {
            x: Scale::new((low, high), (left, left + 540.0)),
            y: limits(map, top),
            x_label: if i + 2 >= maps.len() {
                "time since the session's start, host clock (s)".into()
            } else {
                String::new()
            },
            y_label: "residual (µs)".into(),
            tick_count: (6, 4),
        };
        panel(
            &mut canvas,
            map,
            &axes,
            alignment.maps.iter().find(|m| m.map == map.map),
        );
    }
    let n: u32 = maps.iter().map(|m| m.n).sum();
    Some(canvas.finish(
        &format!("n = {n} points of {} maps", maps.len()),
        "clock_residuals",
        "",
    ))
}

/// Symmetric about zero, to a round number beyond the points used.
fn limits(map: &ClockResiduals, top: f64) -> Scale {
    let used = map.points.iter().filter(|p| p.used);
    let most = used.map(|p| p.residual_us.abs()).filter(|r| r.is_finite());
    let end = nice_above(most.fold(0.0, f64::max) * 1.05);
    Scale::new((-end, end), (top + 160.0, top))
}

fn panel(canvas: &mut Canvas<'_>, map: &ClockResiduals, axes: &Axes, stated: Option<&ClockMap>) {
    let svg = &mut canvas.svg;
    let (left, right) = axes.x.px;
    axes.draw(svg);
    svg.line("axis", (left, axes.y.at(0.0)), (right, axes.y.at(0.0)));
    svg.text((left, axes.y.px.1 - 9.0), "panel", "start", map.map.name());
    let rms = stated.and_then(|m| m.residual_rms_us);
    let text = format!("n = {}, rms {} µs", map.n, number(rms, 2));
    svg.text((right, axes.y.px.1 - 9.0), "tick", "end", &text);
    let used = map.points.iter().filter(|p| p.used);
    svg.path(
        "dots dot-ink",
        &dots(used.map(|p| (axes.x.at(p.host_s), axes.y.at(p.residual_us)))),
    );
    let (low, high) = axes.y.data;
    let mut squares = String::new();
    for p in map.points.iter().filter(|p| !p.used) {
        let (x, y) = (
            axes.x.at(p.host_s),
            axes.y.at(p.residual_us.clamp(low, high)),
        );
        squares.push_str(&format!("M{} {}h6v6h-6Z", Px(x - 3.0), Px(y - 3.0)));
    }
    svg.path("other", &squares);
}
