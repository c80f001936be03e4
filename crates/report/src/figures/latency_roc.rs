//! Owns the figure of the detector's thresholds: detection rate against false alarms.

use super::canvas::{Canvas, Figure};
use super::legend::{self, Sample, diamond};
use crate::axes::{Axes, Scale};
use crate::format::number;
use crate::input::ReportInput;
use crate::published;
use crate::svg::{Px, dots, polyline};

/// Share of trials detected against false alarms per second, one dot per threshold, the chosen one marked. `None` without
/// the study or without thresholds.
#[must_use]
pub(crate) fn latency_roc(input: &ReportInput<'_>) -> Option<Figure> {
    let study = input.analysis.latency.as_ref()?;
    let rows: Vec<_> = study
        .sweep
        .iter()
        .filter(|r| r.detected_rate.is_finite() && r.false_alarms_per_s.is_finite())
        .collect();
    if rows.is_empty() {
        return None;
    }
    let chosen = study.chosen.and_then(|i| study.sweep.get(i as usize));
    let choice = chosen.map_or_else(
        || "No threshold detects anything.".to_owned(),
        |r| {
            format!(
                "Ring: the chosen threshold (h = {}), with the fewest false alarms among those that detect at least {} \
                 % (dashed).",
                number(Some(r.threshold), 2),
                number(Some(100.0 * study.settings.target_rate), 0)
            )
        },
    );
    let caption = format!(
        "Choice of the detector's threshold: share of {} trials with an onset within {} ms of the median onset, \
         against false alarms per second, counted from the start of a trial to its contact or to the first alarm. One \
         dot per threshold ({}); some coincide. {choice}",
        study.trials,
        number(Some(study.settings.window_ms), 0),
        rows.len(),
    );
    let mut canvas = Canvas::new(
        input,
        "latency-roc",
        "Detection: threshold choice",
        caption,
        (620.0, 440.0),
        &[],
    );
    // Decades; thresholds without false alarms are at the left edge.
    let published = published::FALSE_ALARMS_PER_S.0;
    let positive = || {
        let found = rows.iter().map(|r| r.false_alarms_per_s);
        found.chain([published]).filter(|f| *f > 0.0)
    };
    let low = positive().fold(f64::INFINITY, f64::min).log10().floor() - 1.0;
    let high = positive().fold(0.0, f64::max).log10().ceil().max(low + 2.0);
    let at = |f: f64| if f > 0.0 { f.log10() } else { low };
    let least = rows.iter().map(|r| 100.0 * r.detected_rate);
    let least = least.fold(100.0 * study.settings.target_rate, f64::min);
    let bottom = ((least - 2.0) / 5.0).floor().max(0.0) * 5.0;
    let axes = Axes {
        x: Scale::new((low - 0.25, high + 0.1), (66.0, 604.0)),
        y: Scale::new((bottom, 100.6), (372.0, 44.0)),
        x_label: "false alarms per second".into(),
        y_label: "trials detected (%)".into(),
        tick_count: (0, 5),
    };
    let decade = |p: i32| {
        if p < 0 {
            format!("{:.*}", -p as usize, 10f64.powi(p))
        } else {
            10f64.powi(p).to_string()
        }
    };
    let mut xs: Vec<_> = (low as i32 + 1..=high as i32)
        .map(|p| (f64::from(p), decade(p)))
        .collect();
    xs.insert(0, (low, "none".into()));
    let ys: Vec<_> = crate::axes::ticks(bottom, 100.0, 6)
        .into_iter()
        .map(|t| (t, number(Some(t), 0)))
        .collect();
    let svg = &mut canvas.svg;
    axes.draw_with(svg, &xs, &ys);
    let target = axes.y.at(100.0 * study.settings.target_rate);
    svg.line("ref2", (66.0, target), (604.0, target));
    let place = |f: f64, d: f64| (axes.x.at(at(f)), axes.y.at(100.0 * d));
    let points: Vec<_> = rows
        .iter()
        .map(|r| place(r.false_alarms_per_s, r.detected_rate))
        .collect();
    svg.path("line thin c1", &polyline(points.iter().copied(), false));
    svg.path("dots strong c1", &dots(points.iter().copied()));
    let named = chosen.map(|r| r.threshold);
    let ends = [0, rows.len() - 1].map(|i| (rows[i], points[i]));
    for (row, (x, y)) in ends
        .into_iter()
        .filter(|(row, _)| Some(row.threshold) != named)
    {
        let text = format!("h = {}", number(Some(row.threshold), 1));
        // The label goes above the line or below it, and to the right of points at the left edge.
        let (dx, anchor) = if x < 130.0 {
            (10.0, "start")
        } else {
            (-10.0, "end")
        };
        svg.text((x + dx, y - 7.0), "tick halo", anchor, &text);
    }
    if let Some(r) = chosen {
        let (x, y) = place(r.false_alarms_per_s, r.detected_rate);
        svg.leaf(
            "circle",
            &[
                ("class", &"ring"),
                ("cx", &Px(x)),
                ("cy", &Px(y)),
                ("r", &"8"),
            ],
        );
        let text = format!("chosen, h = {}", number(Some(r.threshold), 2));
        let (dx, anchor) = if x < 400.0 {
            (12.0, "start")
        } else {
            (-12.0, "end")
        };
        svg.text((x + dx, y + 21.0), "note halo", anchor, &text);
    }
    svg.path(
        "published",
        &diamond(place(published, published::DETECTED_RATE.0)),
    );
    legend::line(
        svg,
        (66.0, 18.0),
        &[
            (Sample::Dot("dots strong c1"), "thresholds"),
            (Sample::Line("ref2"), "target rate"),
            (Sample::Published, "published, another recording"),
        ],
    );
    let n = format!("n = {} trials", study.trials);
    Some(canvas.finish(&n, "latency_sweep", ""))
}
