//! Owns the figure that compares both skins per location.

use skinrig_compare::Comparison;

use super::{FigureBuilder, RenderedFigure, sign_colour};
use crate::axes::{Axes, Scale};
use crate::figures::nice_above;
use crate::format::number;
use crate::svg::Px;

const SIZE: (f64, f64) = (620.0, 560.0);

/// Error of skin `k` against that of the first skin at each shared location.
pub(in crate::compare) fn locations(result: &Comparison, k: usize) -> Option<RenderedFigure> {
    let letter = result.skins[k].letter;
    let points: Vec<_> = result
        .locations
        .iter()
        .filter_map(|l| Some((l, l.skins[0].error_mm?, l.skins[k].error_mm?)))
        .collect();
    let largest = points
        .iter()
        .map(|(_, a, b)| a.max(*b))
        .fold(f64::NAN, f64::max);
    let end = nice_above(if largest.is_finite() {
        largest
    } else {
        return None;
    });
    let lower = points.iter().filter(|(_, a, b)| b < a).count();
    let caption = format!(
        "Mean error per location: A along x, {letter} along y. Below the line {letter} errs less ({lower} of {} \
         locations). Filled: the 95 % interval of the difference excludes zero. The table of locations lists ranks by \
         error.",
        points.len()
    );
    let title = "Location by location".to_owned();
    let mut figure = FigureBuilder::new(&format!("places-{k}"), title, caption, "locations", SIZE);
    let axes = Axes {
        x: Scale::new((0.0, end), (70.0, 590.0)),
        y: Scale::new((0.0, end), (482.0, 22.0)),
        x_label: "mean error of A (mm)".into(),
        y_label: format!("mean error of {letter} (mm)"),
        tick_count: (6, 6),
    };
    let svg = &mut figure.svg;
    axes.draw(svg);
    svg.line(
        "ref2",
        (axes.x.at(0.0), axes.y.at(0.0)),
        (axes.x.at(end), axes.y.at(end)),
    );
    for (location, a, b) in &points {
        let here = &location.skins[k];
        let colour = sign_colour(here.sign());
        let style = if here.sign() == 0 {
            "fill:none;stroke:var(--mark);stroke-width:1.3".to_owned()
        } else {
            format!("fill:{colour};fill-opacity:.85;stroke:var(--ink);stroke-width:.5")
        };
        svg.open(
            "circle",
            &[
                ("cx", &Px(axes.x.at(*a))),
                ("cy", &Px(axes.y.at(*b))),
                ("r", &"5"),
                ("style", &style),
            ],
        );
        let text = format!(
            "({}, {}) mm\nA {} mm, {letter} {} mm",
            location.at.x_mm,
            location.at.y_mm,
            number(Some(*a), 2),
            number(Some(*b), 2)
        );
        svg.holding("title", &[], &text);
        svg.close();
    }
    Some(figure.finish(result, k, SIZE.1))
}
