//! Owns the figure of event rates around the contact: percentiles of presses and background.

use skinrig_analysis::result::Latency;

use super::origin::foot;
use crate::derive;
use crate::format::number;
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, Plot, Sample, Sheet, WIDE};

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
    let contact = if study.from_contact.is_some() {
        "measured contact"
    } else {
        "contact as scheduled or aligned"
    };
    let caption = format!(
        "Event rate of both cameras around the {contact}, percentiles over {} presses: median (line) and 5 to 95 % (band). \
         Horizontal: the same percentiles of the background (median {} events per second). Dashed: 5th and 95th \
         percentile of the detected onsets, {} ms apart. A: whole trial, B: onset. Counts in bins of {} ms.",
        study.trials,
        number(Some(study.background_rate_per_s), 0),
        number(study.width_ms.value, 1),
        number(Some(study.course.bin_ms), 1),
    );
    let start = study.course.start_ms;
    let whole = (start, start + study.course.bin_ms * bins as f64);
    let close = onsets.map_or(
        (whole.0.max(-50.0), whole.1.min(150.0)),
        |(low, _, high)| {
            let margin = (1.5 * (high - low)).max(20.0);
            let first = (low.min(0.0) - margin).max(whole.0);
            (first, (high + margin).min(whole.1))
        },
    );
    let width = onsets.map_or(String::new(), |(low, _, high)| {
        format!("{} ms between the onsets", number(Some(high - low), 1))
    });
    let plots = [
        plot(study, onsets, whole, 10)
            .title("A   whole trial")
            .clipped("latency-course-whole"),
        plot(study, onsets, close, 6)
            .title("B   onset")
            .note(width)
            .clipped("latency-course-close"),
    ];
    let title = "Detection: event rates around the contact";
    let sheet = Sheet::new("latency-course", title, caption, WIDE)
        .columns(&[1.8, 1.0])
        .legend([
            (Sample::Line("line c1"), "presses, median"),
            (Sample::Area("band f1"), "presses, 5 to 95 %"),
            (Sample::Line("line c2"), "background, median"),
            (Sample::Area("band f2"), "background, 5 to 95 %"),
            (Sample::Line("ref"), "5 and 95 % of the onsets"),
        ])
        .row(298.0, plots);
    let n = format!("n = {} trials", study.trials);
    Some(sheet.finish(&foot(input), &n, "latency_course"))
}

fn plot(
    study: &Latency,
    onsets: Option<(f64, f64, f64)>,
    shown: (f64, f64),
    ticks: u32,
) -> Plot<'static> {
    let course = &study.course;
    let centre = |i: usize| course.start_ms + (i as f64 + 0.5) * course.bin_ms;
    let kilo = |v: f32| f64::from(v) / 1e3;
    let [p5, p50, p95] = &course.press_per_s;
    let bins: Vec<usize> = (0..p5.len().min(p50.len()).min(p95.len()))
        .filter(|i| (shown.0..=shown.1).contains(&centre(*i)))
        .collect();
    let [b5, b50, b95] = course.background_per_s.map(kilo);
    let highest = bins.iter().map(|i| kilo(p95[*i])).chain([b95]);
    let x = Axis::linear(shown, "time since contact (ms)").ticks(ticks);
    let y = Axis::from_zero(highest, "event rate, both cameras (kev/s)");
    let finite = |i: &&usize| p5[**i].is_finite() && p95[**i].is_finite();
    let area = bins.iter().filter(finite);
    let mut plot = Plot::new(x, y)
        .band("band f2", [(shown.0, (b5, b95)), (shown.1, (b5, b95))])
        .across("line c2", b50)
        .band(
            "band f1",
            area.map(|i| (centre(*i), (kilo(p5[*i]), kilo(p95[*i])))),
        )
        .line("line c1", bins.iter().map(|i| (centre(*i), kilo(p50[*i]))))
        .upright("axis", 0.0);
    for t in onsets.into_iter().flat_map(|(low, _, high)| [low, high]) {
        plot = plot.upright("ref", t);
    }
    plot
}
