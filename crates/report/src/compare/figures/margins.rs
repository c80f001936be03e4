//! Owns the figure of differences in units of their margins, which shows equivalence at a glance.

use skinrig_compare::{BaselineComparison, Comparison, Row};
use skinrig_statistics::{Comparison as Compared, ImprovementDirection, Verdict};

use super::{foot, sign_class};
use crate::compare::text;
use crate::plot::{Axis, Figure, Plot, Sheet, rectangle};
use crate::svg::{Px, dots};

const ROW: f64 = 30.0;
/// Margins shown on each side.
const MAX_MARGINS: f64 = 4.0;

/// Skin `k` against the first, one row per metric; `None` without margins.
pub(in crate::compare) fn margins(result: &Comparison, k: usize) -> Option<Figure> {
    let rows: Vec<(&Row, &BaselineComparison, f64)> = result
        .table
        .iter()
        .filter_map(|row| {
            let found = row.against_first.iter().find(|a| a.subject == k)?;
            found.comparison.as_ref()?;
            Some((row, found, row.margin?))
        })
        .collect();
    if rows.is_empty() {
        return None;
    }
    let letter = result.skins[k].letter;
    let caption = format!(
        "Differences with {} intervals in units of each metric's margin. Right is better. Differences within the \
         band are equivalent. Arrows: beyond {MAX_MARGINS} margins.",
        text::level(result)
    );
    let n = rows.len();
    // Arrows beyond the last margin stay inside the frame.
    let end = MAX_MARGINS + 0.25;
    let x = Axis::linear((-end, end), "difference (margins)").ticks(5);
    let names = rows.iter().map(|(row, ..)| row.name.clone());
    let mut plot = Plot::new(x, Axis::categories(names, "").downwards())
        .title(format!("← {letter} worse"))
        .draw(move |svg, place| {
            let (frame, top, width, height) = place.frame();
            let (left, right) = (place.x.at(-1.0), place.x.at(1.0));
            rectangle(svg, "tile", (left, top, right - left, height));
            let better = format!("{letter} better →");
            svg.text((frame + width, top - 9.0), "panel", "end", &better);
            svg.text(
                (place.middle().0, top - 9.0),
                "note",
                "middle",
                "no difference",
            );
        })
        .upright("axis", 0.0);
    for (i, (row, found, margin)) in rows.into_iter().enumerate() {
        let Some((compared, difference)) = found.comparison.as_ref().zip(found.difference()) else {
            continue;
        };
        let turn = improvement_factor(row, compared) / margin;
        let ends = |v: Option<f64>| v.map(|v| v * turn);
        let (mut low, mut high) = (ends(difference.low), ends(difference.high));
        if turn < 0.0 {
            std::mem::swap(&mut low, &mut high);
        }
        let (low, high) = (low.unwrap_or(-f64::INFINITY), high.unwrap_or(f64::INFINITY));
        let at = difference.value * turn;
        let class = sign_class(match found.verdict {
            Some(Verdict::Better) => -1,
            Some(Verdict::Worse) => 1,
            _ => 0,
        });
        plot = plot.draw(move |svg, place| {
            let y = place.y.at(i as f64);
            let x = |v: f64| place.x.at(v.clamp(-MAX_MARGINS, MAX_MARGINS));
            if low < MAX_MARGINS && high > -MAX_MARGINS {
                let class = format!("difference {class}");
                svg.line(&class, (x(low), y), (x(high), y));
            }
            for (end, direction) in [(low, -1.0), (high, 1.0)] {
                if end.abs() > MAX_MARGINS && end * direction > 0.0 {
                    let tip = x(direction * MAX_MARGINS) + 9.0 * direction;
                    let back = Px(-9.0 * direction);
                    svg.path(class, &format!("M{} {}l{back} -5v10Z", Px(tip), Px(y)));
                }
            }
            if at.abs() <= MAX_MARGINS {
                let class = format!("difference value {class}");
                svg.path(&class, &dots([(x(at), y)]));
            }
            let right = place.x.px.1;
            let verdict = text::verdict(found.verdict);
            svg.text((right + 24.0, y + 4.0), "tick ink", "start", verdict);
            let margin = text::value(row, Some(margin));
            let text = format!("margin {margin} {}", row.format.unit);
            svg.text((right + 228.0, y + 4.0), "tick", "end", &text);
        });
    }
    let title = format!("{letter} against A, in units of the margins");
    let sheet = Sheet::new(&format!("margins-{k}"), &title, caption, 900.0)
        .margins(230.0, 240.0)
        .row(ROW * n as f64, [plot]);
    Some(sheet.finish(&foot(result, k), "", "metrics"))
}

/// Sign and scale that turn a difference so that positive is better.
fn improvement_factor(row: &Row, c: &Compared) -> f64 {
    match row.metric.better() {
        ImprovementDirection::Lower => -1.0,
        ImprovementDirection::Higher => 1.0,
        ImprovementDirection::NearerZero if c.a.value > 0.0 => -1.0,
        ImprovementDirection::NearerZero => 1.0,
    }
}
