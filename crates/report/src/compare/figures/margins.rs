//! Owns the figure of differences in units of their margins, which shows equivalence at a glance.

use skinrig_compare::statistics::{Better, Comparison as Compared, Verdict};
use skinrig_compare::{Comparison, Row};

use super::{BETTER, FigureBuilder, NEITHER, RenderedFigure, WORSE};
use crate::compare::text;
use crate::svg::{Px, dots};

const WIDTH: f64 = 900.0;
const ROW: f64 = 30.0;
const TOP: f64 = 56.0;
const LEFT: f64 = 190.0;
const RIGHT: f64 = 690.0;
/// Margins shown on each side.
const MAX_MARGINS: f64 = 4.0;

/// Skin `k` against the first, one row per metric; `None` without margins.
pub(in crate::compare) fn margins(result: &Comparison, k: usize) -> Option<RenderedFigure> {
    let rows: Vec<(&Row, &Compared, f64, Option<Verdict>)> = result
        .table
        .iter()
        .filter_map(|row| {
            let found = row.against_first.iter().find(|a| a.subject == k)?;
            Some((row, found.comparison.as_ref()?, row.margin?, found.verdict))
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    let letter = result.skins[k].letter;
    let height = TOP + ROW * rows.len() as f64 + 66.0;
    let mut figure = FigureBuilder::new(
        &format!("margins-{k}"),
        format!("{letter} against A, in units of the margins"),
        format!(
            "Differences with 95 % intervals in units of each metric's margin. Right is better. Differences within the \
             band are equivalent. Arrows: beyond {MAX_MARGINS} margins."
        ),
        "metrics",
        (WIDTH, height),
    );
    let svg = &mut figure.svg;
    let middle = (LEFT + RIGHT) / 2.0;
    let per = (RIGHT - LEFT) / (2.0 * MAX_MARGINS);
    let x = |v: f64| middle + per * v.clamp(-MAX_MARGINS, MAX_MARGINS);
    let bottom = TOP + ROW * rows.len() as f64;
    svg.leaf(
        "rect",
        &[
            ("x", &Px(x(-1.0))),
            ("y", &Px(TOP - 8.0)),
            ("width", &Px(2.0 * per)),
            ("height", &Px(bottom - TOP + 8.0)),
            ("style", &"fill:var(--skin);stroke:var(--rule)"),
        ],
    );
    for tick in [-4.0, -2.0, 0.0, 2.0, 4.0] {
        svg.line(
            if tick == 0.0 { "axis" } else { "grid" },
            (x(tick), TOP - 8.0),
            (x(tick), bottom),
        );
        svg.text(
            (x(tick), bottom + 18.0),
            "tick",
            "middle",
            &format!("{tick}"),
        );
    }
    svg.text(
        (middle, bottom + 38.0),
        "label",
        "middle",
        "difference (margins)",
    );
    svg.text(
        (LEFT, TOP - 22.0),
        "panel",
        "start",
        &format!("← {letter} worse"),
    );
    svg.text(
        (RIGHT, TOP - 22.0),
        "panel",
        "end",
        &format!("{letter} better →"),
    );
    svg.text((middle, TOP - 22.0), "note", "middle", "no difference");
    for (i, (row, c, margin, verdict)) in rows.iter().enumerate() {
        let y = TOP + ROW * (i as f64 + 0.5) - 4.0;
        let turn = improvement_factor(row, c) / margin;
        let ends = |v: Option<f64>| v.map(|v| v * turn);
        let (mut low, mut high) = (ends(c.difference.low), ends(c.difference.high));
        if turn < 0.0 {
            std::mem::swap(&mut low, &mut high);
        }
        let (low, high) = (low.unwrap_or(-f64::INFINITY), high.unwrap_or(f64::INFINITY));
        let at = c.difference.value * turn;
        let colour = match verdict {
            Some(Verdict::Better) => BETTER,
            Some(Verdict::Worse) => WORSE,
            _ => NEITHER,
        };
        svg.text((LEFT - 14.0, y + 4.0), "tick ink", "end", &row.name);
        let stroke = format!("stroke:{colour};stroke-width:3;stroke-linecap:round;fill:none");
        if low < MAX_MARGINS && high > -MAX_MARGINS {
            let data = format!("M{} {}H{}", Px(x(low)), Px(y), Px(x(high)));
            svg.leaf("path", &[("d", &data), ("style", &stroke)]);
        }
        for (end, direction) in [(low, -1.0), (high, 1.0)] {
            if end.abs() > MAX_MARGINS && end * direction > 0.0 {
                let tip = x(direction * MAX_MARGINS) + 9.0 * direction;
                let data = format!("M{} {}l{} -5v10Z", Px(tip), Px(y), Px(-9.0 * direction));
                svg.leaf(
                    "path",
                    &[("d", &data), ("style", &format!("fill:{colour}"))],
                );
            }
        }
        if at.abs() <= MAX_MARGINS {
            let style = format!("stroke:{colour};stroke-width:11;stroke-linecap:round");
            svg.leaf("path", &[("d", &dots([(x(at), y)])), ("style", &style)]);
        }
        svg.text(
            (RIGHT + 24.0, y + 4.0),
            "tick ink",
            "start",
            text::verdict(*verdict),
        );
        let said = format!(
            "margin {} {}",
            text::value(row, Some(*margin)),
            row.format.unit
        );
        svg.text((WIDTH - 12.0, y + 4.0), "tick", "end", &said);
    }
    Some(figure.finish(result, k, height))
}

/// Sign and scale that turn a difference so that positive is better.
fn improvement_factor(row: &Row, c: &Compared) -> f64 {
    match row.metric.better() {
        Better::Lower => -1.0,
        Better::Higher => 1.0,
        Better::NearerZero if c.a.value > 0.0 => -1.0,
        Better::NearerZero => 1.0,
    }
}
