//! Owns the colour scales of the maps. Errors and differences have the same number of px per mm.

use super::{BETTER, NEITHER, WORSE};
use crate::axes::{tick_label, ticks};
use crate::colour::viridis;
use crate::svg::{Px, Svg};

pub(super) const LEFT: f64 = 62.0;
pub(super) const PANEL: f64 = 350.0;
pub(super) const STEP: f64 = 400.0;
const BAR_Y: f64 = 450.0;

/// Blue for -1, light grey for 0, orange for 1.
pub(super) fn diverging(share: f64) -> String {
    let share = share.clamp(-1.0, 1.0);
    let channel = |hex: &str, i: usize| {
        u8::from_str_radix(hex.get(1 + 2 * i..3 + 2 * i).unwrap_or("80"), 16)
            .map_or(128.0, f64::from)
    };
    let end = if share < 0.0 { BETTER } else { WORSE };
    let mixed = [0, 1, 2].map(|i| {
        let (from, to) = (channel("#eceef0", i), channel(end, i));
        (from + share.abs() * (to - from)).round() as u8
    });
    format!("#{:02x}{:02x}{:02x}", mixed[0], mixed[1], mixed[2])
}

pub(super) fn bars(svg: &mut Svg, end: f64, letter: char) {
    let width = PANEL;
    // Same px per mm in both bars.
    let per_mm = width / (2.0 * end);
    bar(svg, LEFT, (0.0, end), per_mm, "mean error (mm)", &|mm| {
        viridis(mm / end)
    });
    let left = LEFT + 2.0 * STEP;
    let label = format!("{letter} - A (mm)");
    bar(svg, left, (-end, end), per_mm, &label, &|mm| {
        diverging(mm / end)
    });
    svg.text(
        (left, BAR_Y - 6.0),
        "tick",
        "start",
        &format!("{letter} errs less"),
    );
    svg.text(
        (left + width, BAR_Y - 6.0),
        "tick",
        "end",
        &format!("{letter} errs more"),
    );
    let x = LEFT + STEP;
    for (i, (fill, text)) in [
        (BETTER, "errs less, interval excludes zero"),
        (WORSE, "errs more, interval excludes zero"),
        (NEITHER, "cross: attempted, never located"),
    ]
    .iter()
    .enumerate()
    {
        let y = BAR_Y + 2.0 + 18.0 * i as f64;
        let data = match i {
            0 => format!("M{} {}h12l-6 9Z", Px(x), Px(y - 5.0)),
            1 => format!("M{} {}h12l-6 -9Z", Px(x), Px(y + 4.0)),
            _ => format!("M{} {}l8 8m0 -8l-8 8", Px(x + 2.0), Px(y - 4.0)),
        };
        let style = if i < 2 {
            format!("fill:{fill}")
        } else {
            "fill:none;stroke:var(--ink)".to_owned()
        };
        svg.leaf("path", &[("d", &data), ("style", &style)]);
        svg.text((x + 20.0, y + 4.0), "tick", "start", text);
    }
}

fn bar(
    svg: &mut Svg,
    left: f64,
    mm: (f64, f64),
    per_mm: f64,
    label: &str,
    colour: &dyn Fn(f64) -> String,
) {
    const CELLS: u32 = 48;
    let width = (mm.1 - mm.0) * per_mm;
    let cell = width / f64::from(CELLS);
    for i in 0..CELLS {
        let middle = mm.0 + (f64::from(i) + 0.5) / f64::from(CELLS) * (mm.1 - mm.0);
        svg.leaf(
            "rect",
            &[
                ("x", &Px(left + f64::from(i) * cell)),
                ("y", &Px(BAR_Y)),
                ("width", &Px(cell + 0.5)),
                ("height", &"13"),
                ("fill", &colour(middle)),
            ],
        );
    }
    let at = ticks(mm.0, mm.1, if mm.0 < 0.0 { 6 } else { 3 });
    let step = if at.len() > 1 { at[1] - at[0] } else { 1.0 };
    for t in at {
        let x = left + (t - mm.0) * per_mm;
        svg.line("axis", (x, BAR_Y + 13.0), (x, BAR_Y + 18.0));
        svg.text((x, BAR_Y + 30.0), "tick", "middle", &tick_label(t, step));
    }
    svg.text((left, BAR_Y + 50.0), "label", "start", label);
}
