//! Owns the histogram of detected onsets after contact.

use super::canvas::{Canvas, Figure, nice_above};
use crate::axes::{Axes, Scale, tick_label};
use crate::derive;
use crate::format::number;
use crate::input::ReportInput;
use crate::svg::Px;

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
    let caption = format!(
        "Detected onsets after contact, {} presses within {} ms of the median onset. Lines: 5th percentile {} ms, \
         median {} ms, 95th percentile {} ms. Not shown: {far} onsets further from the median, {early} presses whose \
         detector fired before contact (false alarms), {missed} presses never detected.",
        counted.len(),
        number(Some(study.settings.window_ms), 0),
        number(Some(low), 1),
        number(Some(median), 1),
        number(Some(high), 1),
    );
    let mut canvas = Canvas::new(
        input,
        "latency-onsets",
        "Detection: onsets after contact",
        caption,
        (620.0, 440.0),
        &[],
    );
    let (first, last) = (counted[0], counted[counted.len() - 1]);
    let width = nice_above((last - first).max(1e-3) / 45.0);
    let start = (first.min(0.0) / width).floor() * width;
    let count = (((last - start) / width).floor() as usize + 1).max(1);
    let mut bins = vec![0u32; count];
    for onset in &counted {
        bins[(((onset - start) / width) as usize).min(count - 1)] += 1;
    }
    let most = bins.iter().copied().max().unwrap_or(1);
    let unit = tick_label(width, width * 0.01);
    let unit = unit.trim_end_matches('0').trim_end_matches('.');
    let axes = Axes {
        x: Scale::new((start, start + width * count as f64), (66.0, 604.0)),
        y: Scale::new((0.0, f64::from(most) * 1.06), (372.0, 44.0)),
        x_label: "onset after contact (ms)".into(),
        y_label: format!("presses per {unit} ms"),
        tick_count: (8, 5),
    };
    let svg = &mut canvas.svg;
    axes.draw(svg);
    svg.open("g", &[("class", &"bars")]);
    for (i, n) in bins.iter().enumerate().filter(|(_, n)| **n > 0) {
        let left = axes.x.at(start + width * i as f64);
        let top = axes.y.at(f64::from(*n));
        svg.leaf(
            "rect",
            &[
                ("x", &Px(left)),
                ("y", &Px(top)),
                ("width", &Px(width * axes.x.per_unit())),
                ("height", &Px(372.0 - top)),
            ],
        );
    }
    svg.close();
    svg.line("axis", (axes.x.at(0.0), 44.0), (axes.x.at(0.0), 372.0));
    let mut free_from = f64::NEG_INFINITY;
    for (name, t, class) in [
        ("5 %", low, "ref"),
        ("median", median, "ref2"),
        ("95 %", high, "ref"),
    ] {
        let x = axes.x.at(t);
        svg.line(class, (x, 36.0), (x, 372.0));
        let label = format!("{name} {}", number(Some(t), 1));
        let half = 3.3 * label.chars().count() as f64;
        let middle = x.max(free_from + half + 8.0);
        svg.text((middle, 28.0), "tick", "middle", &label);
        free_from = middle + half;
    }
    let n = format!("n = {} of {} trials", counted.len(), study.trials);
    Some(canvas.finish(&n, "latency_onsets", ""))
}
