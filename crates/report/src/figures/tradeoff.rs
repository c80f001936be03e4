//! Owns the figure of a tradeoff: RMSE against each cost, with Pareto fronts.

use skinrig_analysis::tradeoff::{Cost, Row, Tradeoff};
use skinrig_model::Estimator;

use super::canvas::Figure;
use crate::axes::{Scale, tick_label};
use crate::choices::{label, short};
use crate::svg::{Px, Svg};

const SIZE: (f64, f64) = (1240.0, 600.0);
const TOP: f64 = 64.0;
const BOTTOM: f64 = 532.0;
const WIDTH: f64 = 352.0;

/// Short name of a cost.
pub(crate) const fn name(cost: Cost) -> &'static str {
    match cost {
        Cost::Cpu => "CPU",
        Cost::Bytes => "bytes",
        Cost::Delay => "delay",
    }
}

const fn axis(cost: Cost) -> &'static str {
    match cost {
        Cost::Cpu => "CPU time per press (µs)",
        Cost::Bytes => "bytes sent during a press (kB/s)",
        Cost::Delay => "contact to end of window (ms)",
    }
}

fn value(cost: Cost, row: &Row) -> f64 {
    match cost {
        Cost::Bytes => cost.of(row) / 1e3,
        _ => cost.of(row),
    }
}

/// Three panels, one per cost. Points are choices, one mark per estimator; hollow ones locate too few presses. `foot` names
/// the session.
#[must_use]
pub(crate) fn fronts(result: &Tradeoff, rig: &str, foot: &str) -> Figure {
    let shown = result.rows.iter().filter_map(|r| r.rmse_mm.value);
    let shown: Vec<f64> = shown.filter(|e| *e > 0.0).collect();
    let (low, high) = shown
        .iter()
        .fold((f64::INFINITY, 0.0f64), |(l, h), e| (l.min(*e), h.max(*e)));
    // Space below for the labels of choices on a front.
    let exponents = if low <= high {
        ((low / 2.6).log10(), (high * 1.15).log10())
    } else {
        (0.0, 1.0)
    };
    let title = "Error against cost";
    let caption = format!(
        "RMSE of {} ways to locate the same {} attempted scoring presses (those that count in each), against CPU time, \
         data sent and delay, all logarithmic. Lines: Pareto fronts, where no other choice is better in both; bars: 95 \
         % intervals over locations. Hollow: not on any front, because fewer than {} % of the presses were located. \
         Ring: the session's own choice. {rig}",
        result.rows.len(),
        result.scored.0,
        crate::format::number(Some(100.0 * result.least_located), 1),
    );
    let mut svg = Svg::new();
    let view = format!("0 0 {} {}", Px(SIZE.0), Px(SIZE.1));
    svg.open(
        "svg",
        &[
            ("xmlns", &"http://www.w3.org/2000/svg"),
            ("class", &"fig"),
            ("id", &"tradeoff"),
            ("viewBox", &view),
            ("role", &"img"),
            ("aria-labelledby", &"tradeoff-title tradeoff-desc"),
        ],
    );
    svg.holding("title", &[("id", &"tradeoff-title")], title);
    svg.holding("desc", &[("id", &"tradeoff-desc")], &caption);
    legend(&mut svg);
    let y = Scale::new(exponents, (BOTTOM, TOP));
    for (i, cost) in Cost::ALL.into_iter().enumerate() {
        let left = 62.0 + i as f64 * (WIDTH + 42.0);
        panel(&mut svg, result, cost, left, y, i == 0);
    }
    svg.text((10.0, SIZE.1 - 8.0), "foot", "start", foot);
    let n = format!(
        "n = {} presses, {} choices",
        result.scored.0,
        result.rows.len()
    );
    svg.text((SIZE.0 - 10.0, SIZE.1 - 8.0), "foot count", "end", &n);
    Figure {
        id: "tradeoff",
        title,
        caption,
        svg: svg.finish(),
        table: "tradeoff",
        interaction: "",
    }
}

const ESTIMATORS: [(Estimator, &str, &str); 4] = [
    (Estimator::Dbscan, "f1 c1", "dbscan"),
    (Estimator::ColumnMedian, "f2 c2", "median"),
    (Estimator::HistogramPeak, "on on-line", "histogram peak"),
    (Estimator::Streaming, "off off-line", "streaming"),
];

fn legend(svg: &mut Svg) {
    let mut x = 70.0;
    for (estimator, _, text) in ESTIMATORS {
        mark(svg, estimator, (x, 24.0), true, text);
        svg.text((x + 11.0, 28.0), "tick", "start", text);
        x += 36.0 + 6.6 * text.len() as f64;
    }
    for (text, solid) in [("competes", true), ("locates too few", false)] {
        mark(svg, Estimator::Dbscan, (x + 20.0, 24.0), solid, text);
        svg.text((x + 31.0, 28.0), "tick", "start", text);
        x += 40.0 + 6.6 * text.len() as f64;
    }
}

/// Circle, square, triangle or diamond.
fn mark(svg: &mut Svg, estimator: Estimator, at: (f64, f64), solid: bool, title: &str) {
    let class = ESTIMATORS
        .iter()
        .find(|e| e.0 == estimator)
        .map_or("", |e| e.1);
    let (x, y) = at;
    let data = match estimator {
        Estimator::Dbscan => {
            format!("M{} {}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0Z", Px(x - 4.0), Px(y))
        }
        Estimator::ColumnMedian => format!("M{} {}h7v7h-7Z", Px(x - 3.5), Px(y - 3.5)),
        Estimator::HistogramPeak => format!("M{} {}l4.6 8h-9.2Z", Px(x), Px(y - 5.0)),
        Estimator::Streaming => format!("M{} {}l5 5l-5 5l-5 -5Z", Px(x), Px(y - 5.0)),
    };
    let class = format!("{class} {}", if solid { "solid" } else { "hollow" });
    svg.open("path", &[("class", &class), ("d", &data)]);
    svg.holding("title", &[], title);
    svg.close();
}

fn panel(svg: &mut Svg, result: &Tradeoff, cost: Cost, left: f64, y: Scale, first: bool) {
    let right = left + WIDTH;
    let costs = || {
        result
            .rows
            .iter()
            .map(|r| value(cost, r))
            .filter(|c| *c > 0.0)
    };
    let (low, high) = (
        costs().fold(f64::INFINITY, f64::min),
        costs().fold(0.0, f64::max),
    );
    let exponents = if low <= high {
        (low.log10() - 0.08, high.log10() + 0.08)
    } else {
        (0.0, 1.0)
    };
    let x = Scale::new(exponents, (left, right));
    axes(svg, x, y, cost, first);
    let place = |r: &Row| {
        let (c, e) = (value(cost, r), r.rmse_mm.value?);
        (c > 0.0 && e > 0.0).then(|| (x.at(c.log10()), y.at(e.log10())))
    };
    let mut front: Vec<&Row> = result
        .rows
        .iter()
        .filter(|r| r.fronts.contains(&cost))
        .collect();
    front.sort_by(|a, b| value(cost, a).total_cmp(&value(cost, b)));
    let mut steps: Vec<(f64, f64)> = Vec::new();
    for (px, py) in front.iter().filter_map(|r| place(r)) {
        if let Some((_, before)) = steps.last().copied() {
            steps.push((px, before));
        }
        steps.push((px, py));
    }
    if let Some((_, last)) = steps.last().copied() {
        steps.push((right, last));
    }
    svg.path("ref2", &crate::svg::polyline(steps, false));
    for row in result.rows.iter().filter(|r| !r.fronts.contains(&cost)) {
        if let Some(at) = place(row) {
            mark(svg, row.choice.estimator, at, row.competes, &tooltip(row));
        }
    }
    for row in &front {
        let Some((px, py)) = place(row) else { continue };
        if let (Some(l), Some(h)) = (row.rmse_mm.low, row.rmse_mm.high) {
            let at = |e: f64| y.at(e.max(f64::MIN_POSITIVE).log10().clamp(y.data.0, y.data.1));
            svg.line("axis", (px, at(l)), (px, at(h)));
        }
        mark(
            svg,
            row.choice.estimator,
            (px, py),
            row.competes,
            &tooltip(row),
        );
    }
    if let Some((px, py)) = result.rows.first().and_then(place) {
        svg.leaf(
            "circle",
            &[
                ("class", &"select"),
                ("cx", &Px(px)),
                ("cy", &Px(py)),
                ("r", &Px(8.5)),
            ],
        );
    }
    labels(svg, &front, place, (left, right));
}

/// Labels of the choices on a front, below their points where the line leaves room, unless they would overlap.
fn labels(
    svg: &mut Svg,
    front: &[&Row],
    place: impl Fn(&Row) -> Option<(f64, f64)>,
    (left, right): (f64, f64),
) {
    let mut taken: Vec<(f64, f64, f64)> = Vec::new();
    for row in front {
        let Some((px, py)) = place(row) else { continue };
        let text = label(&row.choice);
        let width = 5.9 * text.chars().count() as f64;
        let from = (px - width / 2.0).clamp(left + 2.0, (right - width).max(left + 2.0));
        let free = |y: f64| {
            taken.iter().all(|(a, b, at)| {
                from > *b + 6.0 || from + width < *a - 6.0 || (y - at).abs() > 12.0
            })
        };
        let places = [30.0, 43.0, 56.0, 69.0, -30.0, -43.0, -56.0, -69.0, -82.0].map(|d| py + d);
        let Some(y) = places
            .into_iter()
            .find(|y| free(*y) && *y < BOTTOM - 4.0 && *y > TOP + 10.0)
        else {
            continue;
        };
        taken.push((from, from + width, y));
        let near = if y > py { y - 10.0 } else { y + 3.0 };
        svg.line("grid", (px, py), (px.clamp(from, from + width), near));
        svg.holding(
            "text",
            &[("x", &Px(from)), ("y", &Px(y)), ("class", &"tick halo")],
            &text,
        );
    }
}

fn tooltip(row: &Row) -> String {
    format!(
        "{}: RMSE {} mm, located {} %, {} µs, {} kB/s, {} ms",
        label(&row.choice),
        crate::format::number(row.rmse_mm.value, 2),
        crate::format::number(row.located_rate.value.map(|v| 100.0 * v), 1),
        short(row.cpu_us),
        short(row.bytes_per_s / 1e3),
        short(row.delay_ms)
    )
}

fn axes(svg: &mut Svg, x: Scale, y: Scale, cost: Cost, first: bool) {
    let (left, right) = x.px;
    for (at, text) in decades(y.data) {
        svg.line("grid", (left, y.at(at)), (right, y.at(at)));
        svg.text((left - 7.0, y.at(at) + 4.0), "tick", "end", &text);
    }
    for (at, text) in decades(x.data) {
        svg.line("grid", (x.at(at), TOP), (x.at(at), BOTTOM));
        svg.text((x.at(at), BOTTOM + 16.0), "tick", "middle", &text);
    }
    svg.line("axis", (left, BOTTOM), (right, BOTTOM));
    svg.line("axis", (left, TOP), (left, BOTTOM));
    svg.text(
        ((left + right) / 2.0, BOTTOM + 38.0),
        "label",
        "middle",
        axis(cost),
    );
    if first {
        let (px, py) = (left - 40.0, (TOP + BOTTOM) / 2.0);
        svg.holding(
            "text",
            &[
                ("class", &"label"),
                ("text-anchor", &"middle"),
                (
                    "transform",
                    &format_args!("translate({} {}) rotate(-90)", Px(px), Px(py)),
                ),
            ],
            "RMSE (mm)",
        );
    }
}

/// Ticks of a logarithmic axis over these exponents of ten: 1, 2 and 5 of each power, or only the powers over more than
/// three decades.
fn decades(exponents: (f64, f64)) -> Vec<(f64, String)> {
    let wide = exponents.1 - exponents.0 > 3.0;
    let powers = exponents.0.floor() as i32..=exponents.1.ceil() as i32;
    let all = powers.flat_map(|p| [1.0, 2.0, 5.0].map(|factor| (factor, factor * 10f64.powi(p))));
    all.filter(|(factor, _)| !wide || *factor == 1.0)
        .map(|(_, t)| (t.log10(), tick_label(t, t.min(1.0))))
        .filter(|(at, _)| (exponents.0..=exponents.1).contains(at))
        .collect()
}
