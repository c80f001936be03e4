//! Owns the figures of robot motion: measured against commanded path, over the session and during single presses.

use skinrig_analysis::result::{Motion, MotionBin, PressMotion, TipSample};

use super::origin::{HOST_TIME, foot};
use crate::format::{grouped, number};
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, Plot, Sample, Sheet, WIDE, extent, nice_above};

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
    let starts = || motion.course.iter().map(|b| b.start_s);
    let end = starts().next_back().map_or(1.0, |s| s + motion.bin_s);
    let span = (starts().next().unwrap_or(0.0), end);
    let middle = motion.bin_s / 2.0;
    let line = |value: fn(&MotionBin) -> f64| {
        let bins = motion.course.iter();
        bins.map(move |b| (b.start_s + middle, value(b)))
    };
    let plot = Plot::new(
        Axis::linear(span, HOST_TIME).ticks(10),
        Axis::from_zero([motion.max_mm], "distance (mm)").ticks(4),
    )
    .line("line thin c1", line(|b| b.max_mm))
    .line("line c1", line(|b| b.rms_mm));
    let id = "pose-course";
    let sheet = Sheet::new(id, "Robot pose against command", caption, WIDE).row(206.0, [plot]);
    let n = format!("n = {} samples", grouped(motion.samples));
    Some(sheet.finish(&foot(input), &n, "pose_course"))
}

/// Height, and distance per axis, during single presses. `None` without any.
#[must_use]
pub(crate) fn pose_presses(input: &ReportInput<'_>) -> Option<Figure> {
    let motion = input.analysis.motion.as_ref()?;
    if motion.presses.is_empty() {
        return None;
    }
    let caption = "The tip during single presses, against time since measured contact. Above: height over the skin, \
        commanded (dashed) and measured. Below: measured minus commanded position along each axis. Negative heights \
        are below the surface."
        .to_owned();
    let (heights, off) = (heights(motion), off_axis(motion));
    let x = |p: &PressMotion, label: &str| {
        let times = p.samples.iter().map(|s| s.since_contact_s);
        Axis::linear(extent(times).unwrap_or((0.0, 0.0)), label).ticks(6)
    };
    let line = |p: &PressMotion, value: &dyn Fn(&TipSample) -> f64| {
        let samples = p.samples.iter();
        samples
            .map(|s| (s.since_contact_s, value(s)))
            .collect::<Vec<_>>()
    };
    let upper = motion.presses.iter().map(|p| {
        Plot::new(x(p, ""), Axis::linear(heights, "height z (mm)"))
            .title(p.press.to_string())
            .upright("ref2", 0.0)
            .line("line c1", line(p, &|s| s.measured_mm[2]))
            .line("ref2", line(p, &|s| s.commanded_mm[2]))
    });
    let lower = motion.presses.iter().map(|p| {
        let y = Axis::linear((-off, off), "measured - commanded (mm)");
        let plot = Plot::new(x(p, "time since contact (s)"), y).upright("ref2", 0.0);
        let axes = AXES.iter().enumerate();
        axes.fold(plot, |plot, (k, (class, _))| {
            plot.line(class, line(p, &|s| s.measured_mm[k] - s.commanded_mm[k]))
        })
    });
    let legend = [("ref2", "commanded"), ("line c1", "measured")].into_iter();
    let legend = legend
        .chain(AXES)
        .map(|(class, name)| (Sample::Line(class), name));
    let title = "Single presses: pose against command";
    let sheet = Sheet::new("pose-presses", title, caption, WIDE)
        .shared_columns(motion.presses.len())
        .legend(legend)
        .row(158.0, upper)
        .row(162.0, lower);
    let n = format!("{} presses", motion.presses.len());
    Some(sheet.finish(&foot(input), &n, "pose_presses"))
}

const AXES: [(&str, &str); 3] = [
    ("line on-line", "x"),
    ("line off-line", "y"),
    ("line c2", "z"),
];

/// Lowest and highest height of all presses, with padding.
fn heights(motion: &Motion) -> (f64, f64) {
    let samples = motion.presses.iter().flat_map(|p| &p.samples);
    let all = samples.flat_map(|s| [s.commanded_mm[2], s.measured_mm[2]]);
    let (low, high) = extent(all).unwrap_or((0.0, 0.0));
    let room = 0.06 * (high - low);
    (low - room, high + room)
}

/// Largest distance along one axis, rounded up.
fn off_axis(motion: &Motion) -> f64 {
    let samples = motion.presses.iter().flat_map(|p| &p.samples);
    let off = samples.flat_map(|s| [0, 1, 2].map(|k| (s.measured_mm[k] - s.commanded_mm[k]).abs()));
    nice_above(extent(off).map_or(0.0, |e| e.1))
}
