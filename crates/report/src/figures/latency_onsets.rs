//! Owns the histogram of detected onsets after contact.

use super::histogram::{bin_width, histogram};
use super::origin::foot;
use crate::derive;
use crate::format::number;
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, HALF, Plot, Sheet, nice_above};

/// Time from contact to detection at the chosen threshold. `None` without the study or any onset.
#[must_use]
pub(crate) fn latency_onsets(input: &ReportInput<'_>) -> Option<Figure> {
    let study = input.analysis.latency.as_ref()?;
    let counted = derive::onsets_ms(study);
    let (low, median, high) = derive::onset_percentiles(study)?;
    let undetected = study.onsets.iter().filter(|(_, o)| o.is_none()).count();
    let early = study.false_detections.len();
    let missed = undetected.saturating_sub(early);
    let far = study.onsets.len() - undetected - counted.len();
    let ms = |v: f64| number(Some(v), 1);
    let caption = format!(
        "Detected onsets after contact, {} presses within {} ms of the median onset. Lines: 5th percentile {} ms, \
         median {} ms, 95th percentile {} ms. Not shown: {far} onsets further from the median, {early} presses whose \
         detector fired before contact (false alarms), {missed} presses never detected.",
        counted.len(),
        number(Some(study.settings.window_ms), 0),
        ms(low),
        ms(median),
        ms(high),
    );
    let (first, last) = (counted[0], counted[counted.len() - 1]);
    let width = nice_above((last - first).max(1e-3) / 45.0);
    let start = (first.min(0.0) / width).floor() * width;
    let count = (((last - start) / width).floor() as usize + 1).max(1);
    let bins = histogram(&counted, (start, width), count);
    let most = bins.iter().copied().max().unwrap_or(1);
    let end = start + width * count as f64;
    let y_label = format!("presses per {} ms", bin_width(width));
    let plot = Plot::new(
        Axis::linear((start, end), "onset after contact (ms)").ticks(8),
        Axis::linear((0.0, f64::from(most) * 1.06), y_label),
    )
    .bars((start, width), &bins)
    .upright("axis", 0.0)
    .references(vec![
        ("ref", low, format!("5 % {}", ms(low))),
        ("ref2", median, format!("median {}", ms(median))),
        ("ref", high, format!("95 % {}", ms(high))),
    ]);
    let title = "Detection: onsets after contact";
    let sheet = Sheet::new("latency-onsets", title, caption, HALF).row(328.0, [plot]);
    let n = format!("n = {} of {} trials", counted.len(), study.trials);
    Some(sheet.finish(&foot(input), &n, "latency_onsets"))
}
