//! Owns the figure of clock fits: residuals of every fitted map over the session.

use skinrig_analysis::result::{ClockMap, ClockResiduals};

use super::origin::{HOST_TIME, foot};
use crate::format::number;
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, Plot, Sheet, WIDE, extent, nice_above};

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
    let times = maps.iter().flat_map(|m| &m.points).map(|p| p.host_s);
    let span = extent(times).unwrap_or((0.0, 1.0));
    let plots = maps.iter().enumerate().map(|(i, map)| {
        let label = if i + 2 >= maps.len() { HOST_TIME } else { "" };
        let stated = alignment.maps.iter().find(|m| m.map == map.map);
        plot(map, Axis::linear(span, label).ticks(6), stated)
    });
    let sheet = Sheet::new("clock-residuals", "Clock fits: residuals", caption, WIDE)
        .columns(&[1.0, 1.0])
        .rows(160.0, plots);
    let n: u32 = maps.iter().map(|m| m.n).sum();
    let n = format!("n = {n} points of {} maps", maps.len());
    Some(sheet.finish(&foot(input), &n, "clock_residuals"))
}

fn plot(map: &ClockResiduals, x: Axis, stated: Option<&ClockMap>) -> Plot<'static> {
    // Symmetric about zero, to a round number beyond the points used.
    let used = || map.points.iter().filter(|p| p.used);
    let most = extent(used().map(|p| p.residual_us.abs())).map_or(0.0, |e| e.1);
    let end = nice_above(most * 1.05);
    let rejected = map.points.iter().filter(|p| !p.used);
    let rms = number(stated.and_then(|m| m.residual_rms_us), 2);
    Plot::new(x, Axis::linear((-end, end), "residual (µs)").ticks(4))
        .title(map.map.name())
        .note(format!("n = {}, rms {rms} µs", map.n))
        .across("axis", 0.0)
        .dots("dots dot-ink", used().map(|p| (p.host_s, p.residual_us)))
        .squares(
            "other",
            rejected.map(|p| (p.host_s, p.residual_us.clamp(-end, end))),
        )
}
