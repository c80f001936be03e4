//! Owns the figure of event rates around the contact: percentiles of presses and background.

use skinrig_analysis::result::Latency;

use super::canvas::{Canvas, Figure, band, nice_above};
use super::legend::{self, Sample};
use crate::axes::{Axes, Scale};
use crate::derive;
use crate::format::number;
use crate::input::ReportInput;
use crate::svg::{Px, Svg, polyline};

/// Percentiles of the event rate over trials against time since contact, with those of the background and dashed lines at
/// the 5-95 % onsets (the paper's figure "event rate latency"): the whole trial, and a close-up of the onset. `None` without
/// the study.
#[must_use]
pub(crate) fn latency_course(input: &ReportInput<'_>) -> Option<Figure> {
    let study = input.analysis.latency.as_ref()?;
    let bins = study.course.press_per_s.iter().map(Vec::len).min()?;
    if bins == 0 {
        return None;
    }
    let onsets = derive::onset_percentiles(study);
    let caption = format!(
        "Event rate of both cameras around the {}, percentiles over {} presses: median (line) and 5 to 95 % (band). \
         Horizontal: the same percentiles of the background (median {} events per second). Dashed: 5th and 95th \
         percentile of the detected onsets, {} ms apart. A: whole trial, B: onset. Counts in bins of {} ms.",
        contact(study),
        study.trials,
        number(Some(study.background_rate_per_s), 0),
        number(study.width_ms.value, 1),
        number(Some(study.course.bin_ms), 1),
    );
    let mut canvas = Canvas::new(
        input,
        "latency-course",
        "Detection: event rates around the contact",
        caption,
        (1240.0, 420.0),
        &[],
    );
    let start = study.course.start_ms;
    let whole = (start, start + study.course.bin_ms * bins as f64);
    let close = onsets.map_or(
        (whole.0.max(-50.0), whole.1.min(150.0)),
        |(low, _, high)| {
            let margin = (1.5 * (high - low)).max(20.0);
            (
                (low.min(0.0) - margin).max(whole.0),
                (high + margin).min(whole.1),
            )
        },
    );
    panel(
        &mut canvas.svg,
        study,
        onsets,
        whole,
        (66.0, 700.0),
        "A   whole trial",
        "whole",
    );
    panel(
        &mut canvas.svg,
        study,
        onsets,
        close,
        (836.0, 388.0),
        "B   onset",
        "close",
    );
    legend::line(
        &mut canvas.svg,
        (66.0, 16.0),
        &[
            (Sample::Line("line c1"), "presses, median"),
            (Sample::Area("band f1"), "presses, 5 to 95 %"),
            (Sample::Line("line c2"), "background, median"),
            (Sample::Area("band f2"), "background, 5 to 95 %"),
            (Sample::Line("ref"), "5 and 95 % of the onsets"),
        ],
    );
    let n = format!("n = {} trials", study.trials);
    Some(canvas.finish(&n, "latency_course", ""))
}

/// Zero of the time axis.
fn contact(study: &Latency) -> &'static str {
    if study.from_contact.is_some() {
        "measured contact"
    } else {
        "contact as scheduled or aligned"
    }
}

fn panel(
    svg: &mut Svg,
    study: &Latency,
    onsets: Option<(f64, f64, f64)>,
    shown: (f64, f64),
    (left, width): (f64, f64),
    name: &str,
    id: &str,
) {
    let (top, height) = (52.0, 298.0);
    let course = &study.course;
    let centre = |i: usize| course.start_ms + (i as f64 + 0.5) * course.bin_ms;
    let inside = |i: &usize| (shown.0..=shown.1).contains(&centre(*i));
    let [p5, p50, p95] = &course.press_per_s;
    let bins: Vec<usize> = (0..p5.len().min(p50.len()).min(p95.len()))
        .filter(inside)
        .collect();
    let most = bins
        .iter()
        .map(|i| f64::from(p95[*i]))
        .filter(|v| v.is_finite());
    let most = most.fold(f64::from(course.background_per_s[2]), f64::max);
    let axes = Axes {
        x: Scale::new(shown, (left, left + width)),
        y: Scale::new((0.0, nice_above(most / 1e3)), (top + height, top)),
        x_label: "time since contact (ms)".into(),
        y_label: "event rate, both cameras (kev/s)".into(),
        tick_count: (if width > 500.0 { 10 } else { 6 }, 5),
    };
    axes.draw(svg);
    svg.text((left, top - 8.0), "panel", "start", name);
    let clip = format!("latency-course-{id}");
    svg.open("clipPath", &[("id", &clip)]);
    svg.leaf(
        "rect",
        &[
            ("x", &Px(left)),
            ("y", &Px(top)),
            ("width", &Px(width)),
            ("height", &Px(height)),
        ],
    );
    svg.close();
    svg.open("g", &[("clip-path", &format_args!("url(#{clip})"))]);
    let y = |v: f32| axes.y.at(f64::from(v) / 1e3);
    let [b5, b50, b95] = course.background_per_s.map(y);
    let (l, r) = axes.x.px;
    svg.path("band f2", &band([(l, (b5, b95)), (r, (b5, b95))]));
    svg.line("line c2", (l, b50), (r, b50));
    let x = |i: usize| axes.x.at(centre(i));
    let finite = |i: &&usize| p5[**i].is_finite() && p95[**i].is_finite();
    let area = bins.iter().filter(finite);
    svg.path(
        "band f1",
        &band(area.map(|i| (x(*i), (y(p5[*i]), y(p95[*i]))))),
    );
    let median = bins.iter().filter(|i| p50[**i].is_finite());
    svg.path(
        "line c1",
        &polyline(median.map(|i| (x(*i), y(p50[*i]))), false),
    );
    svg.close();
    svg.line(
        "axis",
        (axes.x.at(0.0), top),
        (axes.x.at(0.0), top + height),
    );
    if let Some((low, _, high)) = onsets {
        for t in [low, high] {
            svg.line("ref", (axes.x.at(t), top), (axes.x.at(t), top + height));
        }
        if id == "close" {
            let text = format!("{} ms", number(Some(high - low), 1));
            let middle = axes.x.at((low + high) / 2.0);
            svg.text((middle, top - 8.0), "tick", "middle", &text);
        }
    }
}
