//! Owns the data-reduction figure: error and rates against the thinning factor.

use skinrig_analysis::result::{Estimate, Reduction, ReductionCurve, ReductionRow, Thinning};

use super::canvas::{Canvas, Figure, band, nice_above};
use super::legend::{self, Sample, diamond};
use crate::axes::{Axes, Scale, tick_label, ticks};
use crate::format::number;
use crate::input::ReportInput;
use crate::published;
use crate::svg::{Svg, dots, polyline};

/// Content of one panel.
struct Panel {
    name: &'static str,
    label: String,
    value: fn(&ReductionRow) -> Estimate,
    /// Factor from stored to displayed unit.
    scale: f64,
    /// Published values at factors 1 and 1024, in the displayed unit.
    published: Option<(f64, f64)>,
}

/// RMSE, pass rate, within-X rate and located rate against the factor on a log2 axis, for both kinds of thinning, with 95 %
/// bands (panel B is the paper's figure "pass rate reduction"). `None` without the study.
#[must_use]
pub fn reduction(input: &ReportInput<'_>) -> Option<Figure> {
    let study = input.analysis.reduction.as_ref()?;
    if study.curves.iter().all(|c| c.rows.is_empty()) {
        return None;
    }
    let mut canvas = Canvas::new(
        input,
        "reduction",
        "Data reduction",
        caption(study),
        (1240.0, 700.0),
        &[],
    );
    let percent = |name| format!("{name} (%)");
    let panels = [
        Panel {
            name: "A   RMSE of the located presses",
            label: "RMSE (mm)".into(),
            value: |r| r.rmse_mm,
            scale: 1.0,
            published: Some((published::RMSE_MM, published::RMSE_1024_MM)),
        },
        Panel {
            name: "B   pass rate, threshold fixed at factor 1",
            label: percent("pass rate"),
            value: |r| r.pass_rate,
            scale: 100.0,
            published: Some((
                100.0 * published::PASS_RATE.0,
                100.0 * published::PASS_RATE.1,
            )),
        },
        Panel {
            name: "C   within the absolute limit",
            label: percent(&format!("within {} mm", number(Some(study.within_mm), 1))),
            value: |r| r.within_rate,
            scale: 100.0,
            published: None,
        },
        Panel {
            name: "D   located",
            label: percent("located rate"),
            value: |r| r.located_rate,
            scale: 100.0,
            published: None,
        },
    ];
    for (i, panel) in panels.iter().enumerate() {
        let left = 66.0 + 620.0 * (i % 2) as f64;
        let top = if i < 2 { 92.0 } else { 404.0 };
        draw(&mut canvas.svg, study, panel, (left, top), i < 2);
    }
    legend::line(
        &mut canvas.svg,
        (66.0, 18.0),
        &[
            (Sample::Line("line c1"), "exact count (public code)"),
            (Sample::Line("line dashed c2"), "Bernoulli (paper's text)"),
            (Sample::Area("band f1"), "95 % interval over locations"),
            (Sample::Published, "published, another recording"),
        ],
    );
    let n = format!("n = {} presses, {} seeds", study.presses, study.seeds);
    Some(canvas.finish(&n, "reduction", ""))
}

fn caption(study: &Reduction) -> String {
    let mut caption = format!(
        "Data reduction: localisation when only one event in k is kept, with one clustering setting at all factors \
         (radius {} px, core threshold {} events). Values are means over {} seeds, bands 95 % intervals over locations \
         (bootstrap; exact where a share is 0 or 100 %), {} presses. A press without an estimate fails in B, C and D. \
         The pass threshold is the 95th percentile of the errors at factor 1 ({} mm), so B begins at about 95 % by \
         construction; C requires an error of at most {} mm. Small figures above the plots: kB/s of both cameras \
         during a press.",
        number(Some(study.eps_px), 1),
        study.min_samples,
        study.seeds,
        study.presses,
        number(study.pass_threshold_mm, 2),
        number(Some(study.within_mm), 1),
    );
    if let Some((best, all)) = better_with_less(study) {
        caption += &format!(
            "A has its minimum at k = {} ({} mm; with all events {} mm). The core threshold is a number of events, so \
             fewer events require denser neighbourhoods, while a cluster of all events includes more of its \
             surroundings.",
            best.factor,
            number(best.rmse_mm.value, 2),
            number(all.rmse_mm.value, 2),
        );
    }
    caption
}

/// Best factor and factor 1, if thinning lowers the error beyond both intervals.
fn better_with_less(study: &Reduction) -> Option<(&ReductionRow, &ReductionRow)> {
    let rows = &study.curves.first()?.rows;
    let all = rows.iter().find(|r| r.factor == 1)?;
    let with_error = rows
        .iter()
        .filter_map(|r| Some((r, r.rmse_mm.value.filter(|v| v.is_finite())?)));
    let (best, _) = with_error.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (best.rmse_mm.high? < all.rmse_mm.low?).then_some((best, all))
}

fn power(row: &ReductionRow) -> f64 {
    f64::from(row.factor.max(1)).log2()
}

fn axes(study: &Reduction, panel: &Panel, (left, top): (f64, f64)) -> Axes {
    let rows = || study.curves.iter().flat_map(|c| &c.rows);
    let values = rows().flat_map(|r| {
        let e = (panel.value)(r);
        [e.value, e.low, e.high]
    });
    let drawn: Vec<f64> = values
        .flatten()
        .filter(|v| v.is_finite())
        .map(|v| v * panel.scale)
        .chain(panel.published.into_iter().flat_map(|(a, b)| [a, b]))
        .collect();
    let high = drawn.iter().copied().fold(0.0, f64::max);
    let low = drawn.iter().copied().fold(f64::INFINITY, f64::min);
    let y = if panel.scale > 1.0 {
        // Shares: from a round number below the minimum to 100 %.
        (((low - 4.0) / 10.0).floor().clamp(0.0, 9.0) * 10.0, 101.0)
    } else {
        (0.0, nice_above(high * 1.02))
    };
    let last = rows().map(power).fold(0.0, f64::max);
    Axes {
        x: Scale::new((-0.35, last + 0.35), (left, left + 540.0)),
        y: Scale::new(y, (top + 208.0, top)),
        x_label: "one event in k kept".into(),
        y_label: panel.label.clone(),
        tick_count: (0, 5),
    }
}

fn draw(svg: &mut Svg, study: &Reduction, panel: &Panel, at: (f64, f64), with_bytes: bool) {
    let axes = axes(study, panel, at);
    let (low, high) = (axes.y.data.0, axes.y.data.1.min(100.0));
    let marks = ticks(
        low,
        if panel.scale > 1.0 {
            high
        } else {
            axes.y.data.1
        },
        5,
    );
    let step = if marks.len() > 1 {
        marks[1] - marks[0]
    } else {
        1.0
    };
    let ys: Vec<_> = marks.iter().map(|t| (*t, tick_label(*t, step))).collect();
    let most = axes.x.data.1.floor() as u32;
    let every = if most > 14 { 2 } else { 1 };
    let xs: Vec<_> = (0..=most)
        .step_by(every)
        .map(|p| (f64::from(p), (1u64 << p).to_string()))
        .collect();
    axes.draw_with(svg, &xs, &ys);
    let name_y = if with_bytes { at.1 - 36.0 } else { at.1 - 12.0 };
    svg.text((at.0, name_y), "panel", "start", panel.name);
    if with_bytes {
        bytes(svg, study, &axes, at.1);
    }
    for curve in &study.curves {
        let (area, line, dot) = match curve.thinning {
            Thinning::Exact => ("band f1", "line c1", "dots c1"),
            Thinning::Bernoulli => ("band f2", "line dashed c2", "dots c2"),
        };
        let points = points(curve, panel, &axes);
        svg.path(area, &band(points.iter().filter_map(|p| Some((p.0, p.2?)))));
        let middle: Vec<_> = points.iter().filter_map(|p| Some((p.0, p.1?))).collect();
        svg.path(line, &polyline(middle.iter().copied(), false));
        svg.path(dot, &dots(middle));
    }
    if panel.scale == 1.0 {
        nothing_located(svg, study, &axes);
    }
    if let Some((one, many)) = panel.published {
        for (power, value) in [(0.0, one), (10.0, many)] {
            if power <= axes.x.data.1 {
                svg.path("published", &diamond((axes.x.at(power), axes.y.at(value))));
            }
        }
    }
}

/// Notes where no press is located any more, so that the missing line is explained.
fn nothing_located(svg: &mut Svg, study: &Reduction, axes: &Axes) {
    let rows = || study.curves.iter().flat_map(|c| &c.rows);
    let last = rows()
        .filter(|r| r.rmse_mm.value.is_some())
        .map(power)
        .fold(0.0, f64::max);
    let end = rows().map(power).fold(0.0, f64::max);
    if end - last >= 2.0 {
        let (left, right) = (axes.x.at(last + 1.0), axes.x.at(end));
        let y = (axes.y.px.0 + axes.y.px.1) / 2.0;
        let middle = ((left + right) / 2.0, y);
        svg.text(middle, "note halo", "middle", "no press is located");
    }
}

/// x, y of the value, y of both ends of the interval.
type PlotPoint = (f64, Option<f64>, Option<(f64, f64)>);

fn points(curve: &ReductionCurve, panel: &Panel, axes: &Axes) -> Vec<PlotPoint> {
    let y = |v: Option<f64>| {
        v.filter(|v| v.is_finite())
            .map(|v| axes.y.at(v * panel.scale))
    };
    let drawn = |r: &ReductionRow| {
        let e = (panel.value)(r);
        (axes.x.at(power(r)), y(e.value), y(e.low).zip(y(e.high)))
    };
    curve.rows.iter().map(drawn).collect()
}

/// Second scale above the plot: bytes per second during a press.
fn bytes(svg: &mut Svg, study: &Reduction, axes: &Axes, top: f64) {
    let Some(curve) = study.curves.first() else {
        return;
    };
    for row in curve
        .rows
        .iter()
        .filter(|r| (power(r) as u32).is_multiple_of(2))
    {
        let x = axes.x.at(power(row));
        svg.line("axis", (x, top - 4.0), (x, top));
        let Some(kilo) = row.press_bytes_per_s.value.map(|b| b / 1e3) else {
            continue;
        };
        let digits = if kilo >= 10.0 { 0 } else { 2 };
        let unit = if row.factor == 1 { " kB/s" } else { "" };
        let text = format!("{}{unit}", number(Some(kilo), digits));
        svg.text((x, top - 8.0), "tick", "middle", &text);
    }
}
