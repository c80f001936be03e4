//! Owns the figure of the regions: stated against observed shares.

use super::origin::foot;
use crate::derive::locator_name;
use crate::input::ReportInput;
use crate::plot::{Axis, Figure, HALF, Plot, Sample, Sheet};

/// Share of the scored presses inside the regions of each stated probability, with its interval. `None` without regions.
#[must_use]
pub fn reliability(input: &ReportInput<'_>) -> Option<Figure> {
    let locator = input.analysis.locator.as_ref()?;
    let rows = &locator.reliability;
    if rows.is_empty() || !input.analysis.is_valid() {
        return None;
    }
    let caption = format!(
        "Reliability of the regions ({}). Dots: share of the scored presses whose true position lies inside the region of the \
         stated probability, with its 95 % interval over locations. On the line the regions are right; above it they are \
         wider than they need to be, below it they promise too much.",
        locator_name(locator.locator)
    );
    let lowest = rows.iter().filter_map(|r| r.inside.low).fold(0.5, f64::min);
    let low = (10.0 * lowest).floor() * 10.0;
    let x = Axis::linear((45.0, 101.0), "stated probability (%)");
    let y = Axis::linear((low.min(45.0), 101.0), "presses inside (%)");
    let mut plot = Plot::new(x, y).line("ref", [(45.0, 45.0), (100.0, 100.0)]);
    for row in rows {
        let at = 100.0 * row.level;
        if let (Some(low), Some(high)) = (row.inside.low, row.inside.high) {
            plot = plot.line("whisker c1", [(at, 100.0 * low), (at, 100.0 * high)]);
        }
        if let Some(value) = row.inside.value {
            plot = plot.dots("dots strong c1", [(at, 100.0 * value)]);
        }
    }
    let sheet = Sheet::new("reliability", "Reliability of the regions", caption, HALF)
        .legend([
            (Sample::Dot("dots strong c1"), "scored presses"),
            (Sample::Line("ref"), "as stated"),
        ])
        .row(346.0, [plot]);
    let n = rows.iter().map(|r| r.inside.n).max().unwrap_or(0);
    Some(sheet.finish(&foot(input), &format!("n = {n} presses"), "reliability"))
}
