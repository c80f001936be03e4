//! Owns the probed area: union of one square cell per location, clipped to the outline.

use skinrig_model::skin::polygon_area_mm2;
use skinrig_model::{Point2, SkinOutline};

use super::{ARC_SEGMENTS, clip};
use crate::metrics::quantile;

/// Median distance between nearest neighbours, mm; `None` with fewer than two points. The points are distinct.
///
/// Sorted along the longer side of all points; the search for a neighbour stops where that distance alone exceeds the
/// nearest found.
#[must_use]
pub fn neighbour_distance_mm(places: &[Point2]) -> Option<f64> {
    if places.len() < 2 {
        return None;
    }
    let length = |of: fn(&Point2) -> f64| {
        let (low, high) = places
            .iter()
            .map(of)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                (l.min(v), h.max(v))
            });
        high - low
    };
    // (along the longer side, across it)
    let mut sorted: Vec<(f64, f64)> = if length(|p| p.x_mm) >= length(|p| p.y_mm) {
        places.iter().map(|p| (p.x_mm, p.y_mm)).collect()
    } else {
        places.iter().map(|p| (p.y_mm, p.x_mm)).collect()
    };
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let nearest = |i: usize| {
        let (at, across) = sorted[i];
        let mut nearest = f64::INFINITY;
        let mut look = |other: &(f64, f64)| {
            let along = other.0 - at;
            let near = along.abs() <= nearest;
            if near {
                nearest = nearest.min(libm::hypot(along, other.1 - across));
            }
            near
        };
        sorted[i + 1..].iter().all(&mut look);
        sorted[..i].iter().rev().all(look);
        nearest
    };
    let mut distances: Vec<f64> = (0..sorted.len()).map(nearest).collect();
    quantile(&mut distances, 0.5)
}

/// Area in mm² of the union of axis-parallel squares with this side around the points, within the outline.
///
/// Between two adjacent left or right edges of squares the union is a set of rectangles; each is clipped alone. From one
/// such strip to the next only squares that begin or end there change.
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
    let mut coming: Vec<Point2> = places.to_vec();
    coming.sort_by(|a, b| a.x_mm.total_cmp(&b.x_mm).then(a.y_mm.total_cmp(&b.y_mm)));
    let mut coming = coming.into_iter().peekable();
    // Squares across the strip, by y.
    let mut across: Vec<Point2> = Vec::new();
    for strip in sides.windows(2) {
        let (left, right) = (strip[0], strip[1]);
        across.retain(|p| p.x_mm + half >= right);
        let known = across.len();
        while let Some(place) = coming.next_if(|p| p.x_mm - half <= left) {
            across.push(place);
        }
        if across.len() > known {
            // Two sorted runs, mostly: sorting is as good as merging.
            across.sort_by(|a, b| a.y_mm.total_cmp(&b.y_mm));
        }
        let mut spans = across.iter().map(|p| (p.y_mm - half, p.y_mm + half));
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

/// Part of a rectangle within the outline, mm²; `polygon` is the outline.
fn rectangle_area_mm2(
    outline: &SkinOutline,
    polygon: &[Point2],
    x: (f64, f64),
    y: (f64, f64),
) -> f64 {
    let corners = [(x.0, y.0), (x.1, y.0), (x.1, y.1), (x.0, y.1)];
    let corners = corners.map(|(x, y)| Point2::new(x, y));
    // The outline is convex: if it contains the corners, it contains the rectangle.
    if corners.iter().all(|c| outline.contains(*c)) {
        return (x.1 - x.0) * (y.1 - y.0);
    }
    polygon_area_mm2(&clip::convex(&corners, polygon))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Brute force over all pairs.
    fn slow_neighbour_distance_mm(places: &[Point2]) -> Option<f64> {
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

    /// Brute force over all points per strip.
    fn slow_probed_area_mm2(outline: &SkinOutline, places: &[Point2], side_mm: f64) -> f64 {
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

    proptest! {
        /// On a lattice many points share an edge.
        #[test]
        fn neighbours_and_areas_are_those_of_looking_at_every_place(
            mut places in prop_oneof![
                prop::collection::vec((-45.0f64..65.0, -53.0f64..57.0), 2..60),
                prop::collection::hash_set((0i32..9, 0i32..60), 2..80)
                    .prop_map(|l| l.into_iter().map(|(i, j)| (0.7 * f64::from(i), 0.7 * f64::from(j))).collect()),
                prop::collection::hash_set((0i32..60, 0i32..2), 2..60)
                    .prop_map(|l| l.into_iter().map(|(i, j)| (0.7 * f64::from(i), 0.7 * f64::from(j))).collect()),
            ].prop_map(|l: Vec<(f64, f64)>| l.into_iter().map(|(x, y)| Point2::new(x, y)).collect::<Vec<_>>()),
            side in prop_oneof![1.0f64..40.0, Just(0.7)],
        ) {
            prop_assert_eq!(neighbour_distance_mm(&places), slow_neighbour_distance_mm(&places));
            let outline = SkinOutline::PAPER;
            let area = probed_area_mm2(&outline, &places, side);
            prop_assert_eq!(area, slow_probed_area_mm2(&outline, &places, side));
            places.reverse();
            prop_assert_eq!(area, probed_area_mm2(&outline, &places, side));
        }
    }
}
