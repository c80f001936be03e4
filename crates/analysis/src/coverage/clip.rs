//! Clipping of convex polygons (Sutherland and Hodgman 1974; for convex polygons the result is exact).

use skinrig_model::Point2;

/// Part of a convex polygon on the side of the line through `on` that `normal` points to, including the line. The result has
/// fewer than three points if nothing remains.
pub(crate) fn half_plane(polygon: &[Point2], on: Point2, normal: [f64; 2]) -> Vec<Point2> {
    let side = |p: Point2| (p.x_mm - on.x_mm) * normal[0] + (p.y_mm - on.y_mm) * normal[1];
    let mut out = Vec::with_capacity(polygon.len() + 1);
    let next = polygon.iter().cycle().skip(1);
    for (&a, &b) in polygon.iter().zip(next) {
        let (from, to) = (side(a), side(b));
        if from >= 0.0 {
            out.push(a);
        }
        if (from > 0.0 && to < 0.0) || (from < 0.0 && to > 0.0) {
            let share = from / (from - to);
            out.push(Point2::new(
                a.x_mm + share * (b.x_mm - a.x_mm),
                a.y_mm + share * (b.y_mm - a.y_mm),
            ));
        }
    }
    out
}

/// Intersection of two convex polygons; `window` is counter-clockwise.
pub(crate) fn convex(polygon: &[Point2], window: &[Point2]) -> Vec<Point2> {
    let mut out = polygon.to_vec();
    let next = window.iter().cycle().skip(1);
    for (a, b) in window.iter().zip(next) {
        if out.is_empty() {
            break;
        }
        out = half_plane(&out, *a, [a.y_mm - b.y_mm, b.x_mm - a.x_mm]);
    }
    out
}
