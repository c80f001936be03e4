//! Owns the centroid tracks: where each camera saw each press.

use skinrig_analysis::result::PressResult;
use skinrig_model::{SENSOR_WIDTH, Verdict};

use super::origin::foot;
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, Plot, Sheet, WIDE, extent};

/// Centroid column of every press against its number, one panel per camera (panels A and B of the paper's figure
/// "centroids").
#[must_use]
pub(crate) fn centroid_tracks(input: &ReportInput<'_>) -> Figure {
    let presses = &input.analysis.presses;
    let view_of = |camera: usize| {
        let column = move |p: &PressResult| p.views[camera].and_then(|v| v.centroid_u);
        let found = presses.iter().filter_map(move |p| Some((p, column(p)?)));
        found.filter(|(_, u)| u.is_finite())
    };
    let counts = [view_of(0).count(), view_of(1).count()];
    let caption = format!(
        "Column of the event cluster's centroid for each press, in the order of the plan. A: camera 1 ({} \
         presses), B: camera 2 ({} presses). Open squares: presses that are not valid.",
        counts[0], counts[1]
    );
    let numbers = presses.iter().map(|p| f64::from(p.press.number()));
    let (first, last) = extent(numbers).unwrap_or((0.0, 0.0));
    let plot = |camera: usize| {
        let label = ["", "press number in the plan"][camera];
        let at = |(p, u): (&PressResult, f64)| (p.press, (f64::from(p.press.number()), u));
        let (valid, others): (Vec<_>, Vec<_>) =
            view_of(camera).partition(|(p, _)| p.verdict == Verdict::Valid);
        let columns = (0.0, f64::from(SENSOR_WIDTH));
        Plot::new(
            Axis::linear((first - 0.5, last + 0.5), label).ticks(14),
            Axis::linear(columns, "centroid column u (px)"),
        )
        .title(["A   camera 1", "B   camera 2"][camera])
        .presses(
            ["dots c1", "dots c2"][camera],
            false,
            valid.into_iter().map(at),
        )
        .presses("other", true, others.into_iter().map(at))
        .empty(counts[camera] == 0, "no centroid in this camera")
    };
    let sheet = Sheet::new("centroid-tracks", "Centroid tracks", caption, WIDE)
        .rows(200.0, [plot(0), plot(1)]);
    let n = format!("n = {} and {} centroids", counts[0], counts[1]);
    sheet.finish(&foot(input), &n, "presses")
}
