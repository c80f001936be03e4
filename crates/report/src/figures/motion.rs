//! Owns the figures of robot motion: measured against commanded path, over the session and during single presses.

use skinrig_analysis::result::{Motion, PressMotion};

use super::canvas::{Canvas, Figure, nice_above};
use crate::axes::{Axes, Scale};
use crate::format::{grouped, number};
use crate::input::ReportInput;
use crate::svg::polyline;

/// Distance between commanded and measured position over the session. `None` without poses.
#[must_use]
pub fn pose_course(input: &ReportInput<'_>) -> Option<Figure> {
    let motion = input.analysis.motion.as_ref()?;
    let broken = if motion.broken > 0 {
        format!(
            " {} samples without finite positions are left out.",
            grouped(motion.broken)
        )
    } else {
        String::new()
    };
    let caption = format!(
        "Euclidean distance of the tip from its commanded position, in bins of {} s. Strong line: root mean square; \
         light line: maximum. Over all {} samples: {} mm root mean square, {} mm at most.{broken} The command is the \
         set point at that instant, so most of the distance during motion is lag.",
        number(Some(motion.bin_s), 2),
        grouped(motion.samples),
        number(Some(motion.rms_mm), 3),
        number(Some(motion.max_mm), 3),
    );
    let mut canvas = Canvas::new(
        input,
        "pose-course",
        "Robot pose against command",
        caption,
        (1240.0, 300.0),
        &[],
    );
    let first = motion.course.first().map_or(0.0, |b| b.start_s);
    let last = motion
        .course
        .last()
        .map_or(1.0, |b| b.start_s + motion.bin_s);
    let axes = Axes {
        x: Scale::new((first, last), (66.0, 1224.0)),
        y: Scale::new((0.0, nice_above(motion.max_mm)), (226.0, 20.0)),
        x_label: "time since the session's start, host clock (s)".into(),
        y_label: "distance (mm)".into(),
        tick_count: (10, 4),
    };
    let svg = &mut canvas.svg;
    axes.draw(svg);
    let at = |value: fn(&skinrig_analysis::result::MotionBin) -> f64| {
        let middle = motion.bin_s / 2.0;
        polyline(
            motion
                .course
                .iter()
                .map(|b| (axes.x.at(b.start_s + middle), axes.y.at(value(b)))),
            false,
        )
    };
    svg.path("line thin c1", &at(|b| b.max_mm));
    svg.path("line c1", &at(|b| b.rms_mm));
    Some(canvas.finish(
        &format!("n = {} samples", grouped(motion.samples)),
        "pose_course",
        "",
    ))
}

/// Height, and distance per axis, during single presses. `None` without any.
#[must_use]
pub(crate) fn pose_presses(input: &ReportInput<'_>) -> Option<Figure> {
    let motion = input
        .analysis
        .motion
        .as_ref()
        .filter(|m| !m.presses.is_empty())?;
    let caption = "The tip during single presses, against time since measured contact. Above: height over the skin, \
        commanded (dashed) and measured. Below: measured minus commanded position along each axis. Negative heights \
        are below the surface."
        .to_owned();
    let mut canvas = Canvas::new(
        input,
        "pose-presses",
        "Single presses: pose against command",
        caption,
        (1240.0, 500.0),
        &[],
    );
    let column = (1240.0 - 66.0 - 14.0) / motion.presses.len() as f64;
    let (heights, off) = (heights(motion), off_axis(motion));
    for (i, press) in motion.presses.iter().enumerate() {
        let left = 66.0 + column * i as f64;
        let px = (left, left + column - 16.0);
        let x = Scale::new(span(press), px);
        let label = |text: &str| {
            if i == 0 {
                text.to_owned()
            } else {
                String::new()
            }
        };
        let ticks = (6, if i == 0 { 5 } else { 0 });
        let upper = Axes {
            x,
            y: Scale::new(heights, (212.0, 54.0)),
            x_label: String::new(),
            y_label: label("height z (mm)"),
            tick_count: ticks,
        };
        let lower = Axes {
            x,
            y: Scale::new((-off, off), (426.0, 264.0)),
            x_label: "time since contact (s)".into(),
            y_label: label("measured - commanded (mm)"),
            tick_count: ticks,
        };
        let svg = &mut canvas.svg;
        upper.draw(svg);
        lower.draw(svg);
        svg.text((left, 42.0), "panel", "start", &press.press.to_string());
        for axes in [&upper, &lower] {
            svg.line("ref2", (x.at(0.0), axes.y.px.1), (x.at(0.0), axes.y.px.0));
        }
        let samples = || press.samples.iter();
        svg.path(
            "line c1",
            &polyline(
                samples().map(|s| (x.at(s.since_contact_s), upper.y.at(s.measured_mm[2]))),
                false,
            ),
        );
        svg.path(
            "ref2",
            &polyline(
                samples().map(|s| (x.at(s.since_contact_s), upper.y.at(s.commanded_mm[2]))),
                false,
            ),
        );
        for (axis, class) in AXES.iter().map(|a| a.1).enumerate() {
            let line = samples().map(|s| {
                (
                    x.at(s.since_contact_s),
                    lower.y.at(s.measured_mm[axis] - s.commanded_mm[axis]),
                )
            });
            svg.path(class, &polyline(line, false));
        }
    }
    let svg = &mut canvas.svg;
    for (i, (name, class)) in LEGEND.into_iter().chain(AXES).enumerate() {
        let x = 800.0 + 96.0 * i as f64 - if i > 2 { 48.0 * (i - 2) as f64 } else { 0.0 };
        svg.path(class, &polyline([(x, 16.0), (x + 18.0, 16.0)], false));
        svg.text((x + 23.0, 20.0), "tick", "start", name);
    }
    Some(canvas.finish(
        &format!("{} presses", motion.presses.len()),
        "pose_presses",
        "",
    ))
}

const LEGEND: [(&str, &str); 2] = [("commanded", "ref2"), ("measured", "line c1")];
const AXES: [(&str, &str); 3] = [
    ("x", "line on-line"),
    ("y", "line off-line"),
    ("z", "line c2"),
];

fn span(press: &PressMotion) -> (f64, f64) {
    let at = |s: Option<&skinrig_analysis::result::TipSample>| s.map_or(0.0, |s| s.since_contact_s);
    (at(press.samples.first()), at(press.samples.last()))
}

/// Lowest and highest height of all presses, with padding.
fn heights(motion: &Motion) -> (f64, f64) {
    let samples = motion.presses.iter().flat_map(|p| &p.samples);
    let all = samples.flat_map(|s| [s.commanded_mm[2], s.measured_mm[2]]);
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| {
        (l.min(z), h.max(z))
    });
    let room = 0.06 * (high - low);
    (low - room, high + room)
}

/// Largest distance along one axis, rounded up.
fn off_axis(motion: &Motion) -> f64 {
    let samples = motion.presses.iter().flat_map(|p| &p.samples);
    let off = samples.flat_map(|s| [0, 1, 2].map(|k| (s.measured_mm[k] - s.commanded_mm[k]).abs()));
    nice_above(off.fold(0.0, f64::max))
}
