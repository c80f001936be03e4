//! Owns the figure of differences in units of their margins: what is equivalent, what is not, at a glance.

use skinrig_compare::statistics::{Better, Comparison as Compared, Verdict};
use skinrig_compare::{Comparison, Row};

use super::{BETTER, Drawn, NEITHER, Sheet, WORSE};
use crate::compare::words;
use crate::svg::{Px, dots};

const WIDTH: f64 = 900.0;
const ROW: f64 = 30.0;
const TOP: f64 = 56.0;
const LEFT: f64 = 190.0;
const RIGHT: f64 = 690.0;
/// Margins shown to either side.
const MOST: f64 = 4.0;

/// Skin `k` against the first, metric by metric; `None` without a margin.
pub(in crate::compare) fn margins(result: &Comparison, k: usize) -> Option<Drawn> {
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
    let mut sheet = Sheet::new(
        &format!("margins-{k}"),
        format!("{letter} against A, in margins"),
        format!(
            "Differences with their 95 % intervals in units of the margin of each metric, turned so that right is better. Within the \
             band a difference is none. Arrows: beyond {MOST} margins."
        ),
        "metrics",
        (WIDTH, height),
    );
    let svg = &mut sheet.svg;
    let middle = (LEFT + RIGHT) / 2.0;
    let per = (RIGHT - LEFT) / (2.0 * MOST);
    let x = |v: f64| middle + per * v.clamp(-MOST, MOST);
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
        "difference in margins",
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
        let turn = turn(row, c) / margin;
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
        if low < MOST && high > -MOST {
            let data = format!("M{} {}H{}", Px(x(low)), Px(y), Px(x(high)));
            svg.leaf("path", &[("d", &data), ("style", &stroke)]);
        }
        for (end, direction) in [(low, -1.0), (high, 1.0)] {
            if end.abs() > MOST && end * direction > 0.0 {
                let tip = x(direction * MOST) + 9.0 * direction;
                let data = format!("M{} {}l{} -5v10Z", Px(tip), Px(y), Px(-9.0 * direction));
                svg.leaf(
                    "path",
                    &[("d", &data), ("style", &format!("fill:{colour}"))],
                );
            }
        }
        if at.abs() <= MOST {
            let style = format!("stroke:{colour};stroke-width:11;stroke-linecap:round");
            svg.leaf("path", &[("d", &dots([(x(at), y)])), ("style", &style)]);
        }
        svg.text(
            (RIGHT + 24.0, y + 4.0),
            "tick ink",
            "start",
            words::verdict(*verdict),
        );
        let said = format!(
            "margin {} {}",
            words::value(row, Some(*margin)),
            row.shown.unit
        );
        svg.text((WIDTH - 12.0, y + 4.0), "tick", "end", &said);
    }
    Some(sheet.finish(result, k, height))
}

/// What a difference is multiplied by so that above 0 is better.
fn turn(row: &Row, c: &Compared) -> f64 {
    match row.metric.better() {
        Better::Lower => -1.0,
        Better::Higher => 1.0,
        Better::NearerZero if c.a.value > 0.0 => -1.0,
        Better::NearerZero => 1.0,
    }
}
