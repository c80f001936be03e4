//! Owns the figure of the detector's thresholds: detection rate against false alarms.

use super::origin::foot;
use crate::format::number;
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, HALF, Plot, Sample, Sheet, extent};
use crate::published;

/// Share of trials detected against false alarms per second, one dot per threshold, the chosen one marked. `None` without
/// the study or without thresholds.
#[must_use]
pub(crate) fn latency_roc(input: &ReportInput<'_>) -> Option<Figure> {
    let study = input.analysis.latency.as_ref()?;
    let finite = |v: &f64| v.is_finite();
    let rows: Vec<_> = study
        .sweep
        .iter()
        .filter(|r| finite(&r.detected_rate) && finite(&r.false_alarms_per_s))
        .collect();
    let last = rows.last()?;
    let chosen = study.chosen.and_then(|i| study.sweep.get(i as usize));
    let target = 100.0 * study.settings.target_rate;
    let choice = chosen.map_or_else(
        || "No threshold detects anything.".to_owned(),
        |r| {
            let why = if 100.0 * r.detected_rate >= target {
                "with the fewest false alarms among those that detect at least"
            } else {
                "which detects most, because none detects"
            };
            format!(
                "Ring: the chosen threshold (h = {}), {why} {} % (dashed).",
                number(Some(r.threshold), 2),
                number(Some(target), 0)
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
    // Thresholds without false alarms are at the left edge, one decade below all others.
    let published = published::FALSE_ALARMS_PER_S.0;
    let rates = rows.iter().map(|r| r.false_alarms_per_s).chain([published]);
    let (low, high) = extent(rates.filter(|f| *f > 0.0)).unwrap_or((1.0, 1.0));
    let first = libm::log10(low).floor() as i32 - 1;
    let end = (libm::log10(high).ceil() as i32).max(first + 2);
    let power = |p: i32| 10f64.powi(p);
    let decade = |p: i32| (power(p), number(Some(power(p)), (-p).max(0) as usize));
    let mut decades: Vec<_> = (first + 1..=end).map(decade).collect();
    decades.insert(0, (power(first), "none".to_owned()));
    let least = rows.iter().map(|r| 100.0 * r.detected_rate);
    let least = least.fold(target, f64::min);
    let bottom = ((least - 2.0) / 5.0).floor().max(0.0) * 5.0;
    let place = |f: f64, d: f64| (f.max(power(first)), 100.0 * d);
    let points: Vec<_> = rows
        .iter()
        .map(|r| place(r.false_alarms_per_s, r.detected_rate))
        .collect();
    let x = Axis::log(
        (0.56 * power(first), 1.26 * power(end)),
        "false alarms per second",
    );
    let y = Axis::linear((bottom, 100.6), "trials detected (%)");
    let mut plot = Plot::new(x.marked(decades), y)
        .across("ref2", target)
        .line("line thin c1", points.iter().copied())
        .dots("dots strong c1", points.iter().copied());
    let named = chosen.map(|r| r.threshold);
    for (row, at) in [(rows[0], points[0]), (*last, points[points.len() - 1])] {
        if Some(row.threshold) != named {
            let text = format!("h = {}", number(Some(row.threshold), 1));
            plot = plot.text("tick halo", at, (10.0, -7.0), text);
        }
    }
    if let Some(r) = chosen {
        let at = place(r.false_alarms_per_s, r.detected_rate);
        let text = format!("chosen, h = {}", number(Some(r.threshold), 2));
        plot = plot
            .ring("ring", at)
            .text("note halo", at, (12.0, 21.0), text);
    }
    let plot = plot.published(place(published, published::DETECTED_RATE.0));
    let sheet = Sheet::new("latency-roc", "Detection: threshold choice", caption, HALF)
        .legend([
            (Sample::Dot("dots strong c1"), "thresholds"),
            (Sample::Line("ref2"), "target rate"),
            (Sample::Published, "published, another recording"),
        ])
        .row(328.0, [plot]);
    let n = format!("n = {} trials", study.trials);
    Some(sheet.finish(&foot(input), &n, "latency_sweep"))
}
