//! Owns the figure of the estimated depths: against the measured ones, and errors by depth.

use skinrig_analysis::result::Ranged;
use skinrig_model::{PressRole, Verdict};

use super::origin::foot;
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, Plot, Sample, Sheet, WIDE};

/// Estimated against measured depth with intervals, and errors. `None` without estimates.
#[must_use]
pub fn indentation(input: &ReportInput<'_>) -> Option<Figure> {
    let a = input.analysis;
    let found = a.indentation.as_ref().filter(|_| a.is_valid())?;
    found.depth.as_ref()?;
    let mut known: Vec<(f64, Ranged)> = Vec::new();
    let mut unseen: Vec<(f64, Ranged)> = Vec::new();
    let valid = a.presses.iter().filter(|p| p.verdict == Verdict::Valid);
    for (role, press) in valid.filter_map(|p| Some((p.role, found.of(p.press)?))) {
        let Some(measured) = press.measured_mm else {
            continue;
        };
        match (press.left_out_mm, press.depth_mm) {
            (Some(estimate), _) => unseen.push((measured, estimate)),
            (None, Some(estimate)) if role == PressRole::Score => known.push((measured, estimate)),
            _ => {}
        }
    }
    let all = || known.iter().chain(&unseen);
    let deepest = all().map(|(m, e)| m.max(e.value)).fold(0.1, f64::max);
    let range = (0.0, 1.05 * deepest);
    let largest = all().map(|(m, e)| (e.value - m).abs()).fold(0.05, f64::max);
    let x = || Axis::linear(range, "measured depth (mm)");
    let y = Axis::linear(range, "estimated depth (mm)");
    let mut left = Plot::new(x(), y).line("ref", [(0.0, 0.0), (range.1, range.1)]);
    let y = Axis::linear(
        (-1.1 * largest, 1.1 * largest),
        "estimate - measurement (mm)",
    );
    let mut right = Plot::new(x(), y).line("ref", [(0.0, 0.0), (range.1, 0.0)]);
    let series = [
        ("whisker c2", "dots c2", &unseen),
        ("whisker c1", "dots c1", &known),
    ];
    for (whisker, dots, rows) in series {
        for (measured, estimate) in rows {
            if let Some([low, high]) = estimate.interval {
                let ends = [low, high.min(range.1)].map(|end| (*measured, end));
                left = left.line(whisker, ends);
            }
        }
        left = left.dots(dots, rows.iter().map(|(m, e)| (*m, e.value)));
        right = right.dots(dots, rows.iter().map(|(m, e)| (*m, e.value - m)));
    }
    let caption = "Depth estimated from the events, against the depth that the robot measured during the hold, with 95 % \
                   intervals, and its error. Left-out locations: calibration presses, each estimated without the presses \
                   at its location."
        .to_owned();
    let sheet = Sheet::new("indentation", "Estimated depth", caption, WIDE)
        .columns(&[1.0, 1.0])
        .legend([
            (Sample::Dot("dots c1"), "scored presses"),
            (Sample::Dot("dots c2"), "left-out locations"),
        ])
        .row(360.0, [left, right]);
    let n = format!("n = {} scored, {} left out", known.len(), unseen.len());
    Some(sheet.finish(&foot(input), &n, "indentation"))
}
