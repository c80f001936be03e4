//! Owns the drawing of one control chart.

use skinrig_nightly::trend::report::{day, format_number as number};
use skinrig_nightly::trend::{Chart, Report};

use super::name::series_name;
use crate::markup::Markup;
use crate::plot::{Axis, LeftTexts, Place, Plot, Scale, band, extent};
use crate::svg::{dots, polyline};

/// Sizes of a chart in an alarm and in the table, px.
const LARGE: (f64, f64) = (860.0, 250.0);
const SMALL: (f64, f64) = (330.0, 46.0);
/// Margins of the large chart: left, right, top, bottom.
const MARGINS: (f64, f64, f64, f64) = (84.0, 36.0, 14.0, 46.0);

/// Range of the values, with padding.
fn range(chart: &Chart, limits: bool) -> (f64, f64) {
    let values = chart.nights.iter().map(|n| n.value);
    let reference = chart.reference.iter();
    let around = reference.flat_map(|r| [r.centre - 3.0 * r.below, r.centre + 3.0 * r.above]);
    let mut all: Vec<f64> = values.chain(around).collect();
    let (low, high) = ends(&all);
    // A distant limit would flatten everything else.
    let near = |v: &f64| limits && (*v - low).abs().min((*v - high).abs()) <= high - low;
    let last = chart.series.points.iter().rev().find_map(|p| p.limit);
    let stated = last.into_iter().flat_map(|l| [l.at_least, l.at_most]);
    all.extend(stated.flatten().filter(near));
    let (low, high) = ends(&all);
    let room = 0.06 * (high - low);
    (low - room, high + room)
}

fn ends(values: &[f64]) -> (f64, f64) {
    match extent(values.iter().copied()) {
        Some((low, high)) if low < high => (low, high),
        Some((low, _)) => (low - 0.5, low + 0.5),
        None => (0.0, 1.0),
    }
}

/// Chart of a drifted series over all nights.
pub(super) fn large(report: &Report, chart: &Chart) -> String {
    let (width, height) = LARGE;
    let (left, right, top, bottom) = MARGINS;
    let nights = report.nights.len();
    // Days along the axis.
    let days = (0..nights).step_by((nights / 7).max(1));
    let days = days.map(|n| (n as f64, day(&report.nights[n]).to_owned()));
    let unit = match chart.series.unit.as_str() {
        "" => "count",
        unit => unit,
    };
    let x = Axis::linear((-0.5, nights as f64 - 0.5), "night").marked(days.collect());
    let range = range(chart, true);
    let ys = crate::plot::ticks(range.0, range.1, 5).into_iter();
    let y = Axis::linear(range, unit).marked(ys.map(|y| (y, number(y))).collect());
    let place = Place {
        x: x.scale((left, width - right)),
        y: y.scale((height - bottom, top)),
    };
    let mut svg = begin(chart, LARGE);
    let plot = Plot::new(x, y).draw(|svg, place| marks(svg, chart, place, true));
    plot.render(&mut svg, &place, LeftTexts::Shown);
    svg.finish()
}

/// Chart in the table: no axes.
pub(super) fn small(report: &Report, chart: &Chart) -> String {
    let (width, height) = SMALL;
    let place = Place {
        x: Scale::new((-0.5, report.nights.len() as f64 - 0.5), (2.0, width - 2.0)),
        y: Scale::new(range(chart, false), (height - 2.0, 2.0)),
    };
    let mut svg = begin(chart, SMALL);
    marks(&mut svg, chart, &place, false);
    svg.finish()
}

fn begin(chart: &Chart, (width, height): (f64, f64)) -> Markup {
    let mut svg = Markup::new();
    let view = format!("0 0 {width} {height}");
    svg.open(
        "svg",
        &[
            ("class", &"fig"),
            ("viewBox", &view),
            ("width", &width),
            ("height", &height),
            ("role", &"img"),
        ],
    );
    let title = format!("{} over the nights", series_name(&chart.series.name));
    svg.holding("title", &[], &title);
    svg
}

/// Reference band, limits, change point, values.
fn marks(svg: &mut Markup, chart: &Chart, &Place { x, y }: &Place, large: bool) {
    let (left, right) = (x.px.0, x.px.1);
    if let Some(r) = chart.reference {
        // Two standard deviations of a new night: roughly where three nights in a row raise an alarm.
        let per = 2.0 / r.score(r.centre + r.above).max(1e-9);
        let (high, low) = (
            y.at(r.centre + per * r.above),
            y.at(r.centre - per * r.below),
        );
        svg.path(
            "band on",
            &band([(left, (high, low)), (right, (high, low))]),
        );
        svg.line("axis", (left, y.at(r.centre)), (right, y.at(r.centre)));
    }
    let last = chart.series.points.iter().rev().find_map(|p| p.limit);
    for limit in last
        .into_iter()
        .flat_map(|l| [l.at_least, l.at_most])
        .flatten()
    {
        if large && limit > y.data.0 && limit < y.data.1 {
            svg.line("ref2", (left, y.at(limit)), (right, y.at(limit)));
            svg.text(
                (right - 4.0, y.at(limit) - 4.0),
                "note halo",
                "end",
                &format!("limit {}", number(limit)),
            );
        }
    }
    for night in &chart.accepted {
        let at = x.at(*night as f64 - 0.5);
        svg.line("ref2", (at, y.px.0), (at, y.px.1));
    }
    for e in &chart.excursions {
        let at = x.at(e.change.likeliest as f64 - 0.5);
        svg.line("ref", (at, y.px.0), (at, y.px.1));
    }
    let place = |n: &skinrig_nightly::trend::ChartPoint| (x.at(n.night as f64), y.at(n.value));
    let off = |night: usize| {
        chart
            .excursions
            .iter()
            .any(|e| night >= e.change.likeliest && e.ended.is_none_or(|end| night <= end))
    };
    let (bad, good): (Vec<_>, Vec<_>) = chart.nights.iter().partition(|n| off(n.night));
    let line = if large { "line marks" } else { "line dot-ink" };
    svg.path(line, &polyline(chart.nights.iter().map(place), false));
    if large {
        svg.path("dots dot-ink", &dots(good.into_iter().map(place)));
        svg.path("dots mid c2", &dots(bad.into_iter().map(place)));
    } else {
        svg.path("dots c2", &dots(bad.into_iter().map(place)));
    }
}
