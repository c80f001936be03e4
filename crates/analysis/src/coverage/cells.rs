//! The area that probed places stand for: the union of one square cell per place, within the outline.

use skinrig_model::skin::polygon_area_mm2;
use skinrig_model::{Point2, SkinOutline};

use super::{ARC_SEGMENTS, clip};
use crate::metrics::quantile;

/// The median distance of a place from its nearest neighbour, mm; `None` with fewer than two places. Places are
/// distinct.
#[must_use]
pub fn neighbour_distance_mm(places: &[Point2]) -> Option<f64> {
    if places.len() < 2 {
        return None;
    }
    let distance = |a: &Point2, b: &Point2| libm::hypot(a.x_mm - b.x_mm, a.y_mm - b.y_mm);
    let nearest = |i: usize| {
        let others = places.iter().enumerate().filter(move |(j, _)| *j != i);
        others
            .map(|(_, p)| distance(p, &places[i]))
            .fold(f64::INFINITY, f64::min)
    };
    let mut distances: Vec<f64> = (0..places.len()).map(nearest).collect();
    quantile(&mut distances, 0.5)
}

/// The area in mm² of the union of axis-parallel squares of this side about the places, as far as it lies within the
/// outline.
///
/// Between two neighbouring left or right sides of squares the union is a set of rectangles; each is clipped alone.
#[must_use]
pub fn probed_area_mm2(outline: &SkinOutline, places: &[Point2], side_mm: f64) -> f64 {
    let half = side_mm / 2.0;
    let polygon = outline.polygon(ARC_SEGMENTS);
    let mut sides: Vec<f64> = places
        .iter()
        .flat_map(|p| [p.x_mm - half, p.x_mm + half])
        .collect();
    sides.sort_by(f64::total_cmp);
    sides.dedup();
    let mut area = 0.0;
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for strip in sides.windows(2) {
        let (left, right) = (strip[0], strip[1]);
        spans.clear();
        let across = places
            .iter()
            .filter(|p| p.x_mm - half <= left && p.x_mm + half >= right);
        spans.extend(across.map(|p| (p.y_mm - half, p.y_mm + half)));
        spans.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut spans = spans.iter().copied();
        let Some(mut open) = spans.next() else {
            continue;
        };
        for span in spans {
            if span.0 > open.1 {
                area += rectangle_area_mm2(outline, &polygon, (left, right), open);
                open = span;
            } else {
                open.1 = open.1.max(span.1);
            }
        }
        area += rectangle_area_mm2(outline, &polygon, (left, right), open);
    }
    area
}

/// The part of a rectangle within the outline, mm²; `polygon` is the outline.
fn rectangle_area_mm2(
    outline: &SkinOutline,
    polygon: &[Point2],
    x: (f64, f64),
    y: (f64, f64),
) -> f64 {
    let corners = [(x.0, y.0), (x.1, y.0), (x.1, y.1), (x.0, y.1)];
    let corners = corners.map(|(x, y)| Point2::new(x, y));
    // The outline is convex: with its corners in it the rectangle is.
    if corners.iter().all(|c| outline.contains(*c)) {
        return (x.1 - x.0) * (y.1 - y.0);
    }
    polygon_area_mm2(&clip::convex(&corners, polygon))
}
