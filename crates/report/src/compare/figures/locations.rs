//! Owns the figure that compares both skins per location.

use skinrig_compare::Comparison;

use super::{foot, sign_class};
use crate::format::number;
use crate::plot::{Axis, Figure, HALF, Plot, Sheet, extent, nice_above};
use crate::svg::Px;

/// Error of skin `k` against that of the first skin at each shared location.
pub(in crate::compare) fn locations(result: &Comparison, k: usize) -> Option<Figure> {
    let letter = result.skins[k].letter;
    let of = |l: &skinrig_compare::Location| Some((l.skins[0].error_mm?, l.skins[k].error_mm?));
    let points = result.locations.iter().filter_map(|l| Some((l, of(l)?)));
    let points: Vec<_> = points.collect();
    let end = nice_above(extent(points.iter().flat_map(|(_, (a, b))| [*a, *b]))?.1);
    let lower = points.iter().filter(|(_, (a, b))| b < a).count();
    let caption = format!(
        "Mean error per location: A along x, {letter} along y. Below the line {letter} errs less ({lower} of {} \
         locations). Filled: the 95 % interval of the difference excludes zero. The table of locations lists ranks by \
         error.",
        points.len()
    );
    let axis = |skin| Axis::linear((0.0, end), format!("mean error of {skin} (mm)")).ticks(6);
    let n = format!("n = {} locations", points.len());
    let plot = Plot::new(axis('A'), axis(letter))
        .line("ref2", [(0.0, 0.0), (end, end)])
        .draw(move |svg, place| {
            for (location, (a, b)) in &points {
                let (x, y) = place.at((*a, *b));
                let class = format!("location {}", sign_class(location.skins[k].sign()));
                svg.open(
                    "circle",
                    &[
                        ("class", &class),
                        ("cx", &Px(x)),
                        ("cy", &Px(y)),
                        ("r", &"5"),
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
        });
    let sheet = Sheet::new(
        &format!("places-{k}"),
        "Location by location",
        caption,
        HALF,
    );
    Some(
        sheet
            .row(460.0, [plot])
            .finish(&foot(result, k), &n, "locations"),
    )
}
