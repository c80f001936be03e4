//! Owns the figure of a tradeoff: RMSE against each cost, with Pareto fronts.

use skinrig_analysis::tradeoff::{Cost, Row, Tradeoff};
use skinrig_model::Estimator;

use crate::choices::{label, short};
use crate::format::number;
use crate::markup::Markup;
use crate::plot::{Axis, Figure, Place, Plot, Sample, Sheet, WIDE, extent};
use crate::svg::Px;

/// Short name of a cost.
pub(crate) const fn name(cost: Cost) -> &'static str {
    match cost {
        Cost::Cpu => "CPU",
        Cost::Bytes => "bytes",
        Cost::Delay => "delay",
        Cost::Pixels => "pixels",
    }
}

const fn axis(cost: Cost) -> &'static str {
    match cost {
        Cost::Cpu => "CPU time per press (µs)",
        Cost::Bytes => "bytes sent during a press (kB/s)",
        Cost::Delay => "contact to end of window (ms)",
        Cost::Pixels => "pixels that are read, after rows and bin",
    }
}

fn value(cost: Cost, row: &Row) -> f64 {
    match cost {
        Cost::Bytes => cost.of(row) / 1e3,
        _ => cost.of(row),
    }
}

/// Marks of the estimators around (0, 0): circle, square, triangle, diamond.
const CIRCLE: &str = "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0Z";
const SQUARE: &str = "M-3.5 -3.5h7v7h-7Z";
const TRIANGLE: &str = "M0 -5l4.6 8h-9.2Z";
const DIAMOND: &str = "M0 -5l5 5l-5 5l-5 -5Z";

/// Classes (competing, not competing) and mark of an estimator.
const fn mark_of(estimator: Estimator) -> ([&'static str; 2], &'static str) {
    match estimator {
        Estimator::Dbscan => (["f1 c1 solid", "f1 c1 hollow"], CIRCLE),
        Estimator::ColumnMedian => (["f2 c2 solid", "f2 c2 hollow"], SQUARE),
        Estimator::HistogramPeak => (["on on-line solid", "on on-line hollow"], TRIANGLE),
        Estimator::Streaming => (["off off-line solid", "off off-line hollow"], DIAMOND),
    }
}

/// Four panels, one per cost. Points are choices, one mark per estimator; hollow ones locate too few presses. `foot` names
/// the session.
#[must_use]
pub(crate) fn fronts(result: &Tradeoff, rig: &str, foot: &str) -> Figure {
    let caption = format!(
        "RMSE of {} ways to locate the same {} attempted scoring presses (those that count in each), against CPU time, \
         data sent, delay and pixels of a camera, all logarithmic. Lines: Pareto fronts, where no other choice is better in both; bars: 95 \
         % intervals over locations. Hollow: not on any front, because fewer than {} % of the presses were located. \
         Ring: the session's own choice. {rig}",
        result.rows.len(),
        result.scored.0,
        number(Some(100.0 * result.least_located), 1),
    );
    let sample = |estimator, i: usize| {
        let (classes, data) = mark_of(estimator);
        Sample::Path(classes[i], data)
    };
    let sheet = Sheet::new("tradeoff", "Error against cost", caption, WIDE)
        .columns(&[1.0; 2])
        .legend([
            (sample(Estimator::Dbscan, 0), "dbscan"),
            (sample(Estimator::ColumnMedian, 0), "median"),
            (sample(Estimator::HistogramPeak, 0), "histogram peak"),
            (sample(Estimator::Streaming, 0), "streaming"),
            (sample(Estimator::Dbscan, 1), "locates too few"),
            (Sample::Ring("select"), "the session's own"),
        ])
        .row(
            468.0,
            [Cost::Cpu, Cost::Bytes].map(|cost| plot(result, cost)),
        )
        .row(
            468.0,
            [Cost::Delay, Cost::Pixels].map(|cost| plot(result, cost)),
        );
    let n = format!(
        "n = {} presses, {} choices",
        result.scored.0,
        result.rows.len()
    );
    sheet.finish(foot, &n, "tradeoff")
}

fn plot(result: &Tradeoff, cost: Cost) -> Plot<'_> {
    let positive = |v: &f64| *v > 0.0;
    let errors = result.rows.iter().filter_map(|r| r.rmse_mm.value);
    let (low, high) = extent(errors.filter(positive)).unwrap_or((1.0, 10.0));
    // Space below for the labels of choices on a front.
    let y = Axis::log((low / 2.6, high * 1.15), "RMSE (mm)");
    let costs = result.rows.iter().map(|r| value(cost, r));
    let (low, high) = extent(costs.filter(positive)).unwrap_or((1.0, 10.0));
    let x = Axis::log((low / 1.2, high * 1.2), axis(cost));
    let at = move |r: &Row| {
        Some((value(cost, r), r.rmse_mm.value?)).filter(|(c, e)| *c > 0.0 && *e > 0.0)
    };
    let (mut front, others): (Vec<&Row>, Vec<&Row>) =
        result.rows.iter().partition(|r| r.fronts.contains(&cost));
    front.sort_by(|a, b| value(cost, a).total_cmp(&value(cost, b)));
    let mut steps: Vec<(f64, f64)> = Vec::new();
    for (c, e) in front.iter().filter_map(|r| at(r)) {
        steps.extend(steps.last().map(|last| (c, last.1)));
        steps.push((c, e));
    }
    steps.extend(steps.last().map(|last| (high * 1.2, last.1)));
    let own = result.rows.first().and_then(at);
    let plot = Plot::new(x, y).line("ref2", steps).draw(move |svg, place| {
        for row in others {
            if let Some(at) = at(row) {
                mark(svg, row, place.at(at));
            }
        }
        for row in &front {
            let Some(at) = at(row) else { continue };
            let px = place.at(at);
            if let (Some(l), Some(h)) = (row.rmse_mm.low, row.rmse_mm.high) {
                let (low, high) = place.y.data;
                let end = |e: f64| (px.0, place.y.at(e.clamp(low, high)));
                svg.line("axis", end(l), end(h));
            }
            mark(svg, row, px);
        }
        labels(svg, place, &front, at);
    });
    match own {
        Some(own) => plot.ring("select", own),
        None => plot,
    }
}

fn mark(svg: &mut Markup, row: &Row, (x, y): (f64, f64)) {
    let (classes, data) = mark_of(row.choice.estimator);
    let class = classes[usize::from(!row.competes)];
    let to = format!("translate({} {})", Px(x), Px(y));
    svg.open(
        "path",
        &[("class", &class), ("d", &data), ("transform", &to)],
    );
    svg.holding("title", &[], &tooltip(row));
    svg.close();
}

/// A phone shows the texts of this figure so many times as large.
const PHONE_TEXTS: f64 = 1.4;

/// Labels of the choices on a front, below their points where the line leaves room, unless they would overlap.
fn labels(
    svg: &mut Markup,
    place: &Place,
    front: &[&Row],
    at: impl Fn(&Row) -> Option<(f64, f64)>,
) {
    let (left, top, width, height) = place.frame();
    let (right, bottom) = (left + width, top + height);
    let mut taken: Vec<(f64, f64, f64)> = Vec::new();
    for row in front {
        let Some((px, py)) = at(row).map(|at| place.at(at)) else {
            continue;
        };
        let text = label(&row.choice);
        let width = 5.9 * text.chars().count() as f64;
        let last = right - PHONE_TEXTS * width;
        let from = (px - width / 2.0).clamp(left + 2.0, last.max(left + 2.0));
        let free = |y: f64| {
            taken.iter().all(|(a, b, at)| {
                from > *b + 6.0 || from + width < *a - 6.0 || (y - at).abs() > 12.0
            })
        };
        let places = [30.0, 43.0, 56.0, 69.0, -30.0, -43.0, -56.0, -69.0, -82.0].map(|d| py + d);
        let mut places = places.into_iter();
        let Some(y) = places.find(|y| free(*y) && *y < bottom - 4.0 && *y > top + 10.0) else {
            continue;
        };
        taken.push((from, from + width, y));
        let near = if y > py { y - 10.0 } else { y + 3.0 };
        svg.line("grid", (px, py), (px.clamp(from, from + width), near));
        svg.text((from, y), "tick halo", "start", &text);
    }
}

fn tooltip(row: &Row) -> String {
    format!(
        "{}: RMSE {} mm, located {} %, {} µs, {} kB/s, {} ms, {} px",
        label(&row.choice),
        number(row.rmse_mm.value, 2),
        number(row.located_rate.value.map(|v| 100.0 * v), 1),
        short(row.cpu_us),
        short(row.bytes_per_s / 1e3),
        short(row.delay_ms),
        row.pixels
    )
}
