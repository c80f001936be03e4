//! Owns the part of the skin where a locator learnt: the convex hull of its calibration presses, and half a step beyond it.

use skinrig_model::Point2;

use crate::result::LearntPlaces;
use crate::sets::CalibrationPress;

impl LearntPlaces {
    /// Of these calibration presses; `None` without one.
    pub(super) fn of(presses: &[CalibrationPress]) -> Option<Self> {
        let mut by_location: Vec<(u32, Point2)> =
            presses.iter().map(|p| (p.location, p.truth)).collect();
        by_location.sort_by_key(|(location, _)| *location);
        by_location.dedup_by_key(|(location, _)| *location);
        let places: Vec<Point2> = by_location.into_iter().map(|(_, at)| at).collect();
        let nearest = |i: usize| {
            let others = places.iter().enumerate().filter(|(j, _)| *j != i);
            let each = others.map(|(_, p)| p.distance_mm(places[i]));
            each.fold(f64::INFINITY, f64::min)
        };
        let apart = (0..places.len()).map(nearest).fold(0.0, f64::max);
        (!places.is_empty()).then(|| Self {
            margin_mm: if apart.is_finite() { 0.5 * apart } else { 0.0 },
            places,
        })
    }
}

/// The part of the skin where a locator learnt.
#[derive(Debug, Clone)]
pub(super) struct LearntArea {
    /// Corners of the convex hull, mm, counter-clockwise; two or one if the places are on a line or one.
    corners_mm: Vec<[f64; 2]>,
    margin_mm: f64,
}

impl LearntArea {
    pub(super) fn new(learnt: &LearntPlaces) -> Self {
        let places = learnt.places.iter().map(|p| [p.x_mm, p.y_mm]);
        Self {
            corners_mm: hull(places.collect()),
            margin_mm: learnt.margin_mm,
        }
    }

    /// True if the area is within `reach_mm` of `at`: how far off the position may be. Without one, as far as the margin.
    pub(super) fn is_near(&self, at: [f64; 2], reach_mm: Option<f64>) -> bool {
        let most = self.margin_mm + reach_mm.unwrap_or(self.margin_mm);
        let n = self.corners_mm.len();
        let edges = || (0..n).map(|i| (self.corners_mm[i], self.corners_mm[(i + 1) % n]));
        let inside = n > 2 && edges().all(|(a, b)| turn(a, b, at) >= 0.0);
        inside || edges().any(|(a, b)| distance(at, a, b) <= most)
    }
}

/// Twice the area of the triangle, positive for a left turn.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Distance of `at` from the segment `a` to `b`.
fn distance(at: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let from = [at[0] - a[0], at[1] - a[1]];
    let length2 = along[0] * along[0] + along[1] * along[1];
    let share = (along[0] * from[0] + along[1] * from[1]) / length2;
    let share = if length2 > 0.0 {
        share.clamp(0.0, 1.0)
    } else {
        0.0
    };
    libm::hypot(from[0] - share * along[0], from[1] - share * along[1])
}

/// Corners of the convex hull, counter-clockwise (Andrew's monotone chain).
fn hull(mut at: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    at.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    at.dedup();
    if at.len() < 3 {
        return at;
    }
    let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && turn(a, b, p) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut corners = half(&mut at.iter().copied());
    corners.extend(half(&mut at.iter().rev().copied()));
    corners
}

#[cfg(test)]
mod tests {
    use skinrig_model::PressId;

    use super::*;

    fn presses(at: &[[f64; 2]]) -> Vec<CalibrationPress> {
        let each = at.iter().enumerate();
        each.map(|(i, at)| CalibrationPress {
            press: PressId::from_index(i as u32),
            location: i as u32,
            repetition: 0,
            columns: [0.0; 2],
            spreads: [None; 2],
            truth: Point2::new(at[0], at[1]),
            cluster_events: 100,
        })
        .collect()
    }

    fn area(at: &[[f64; 2]]) -> LearntArea {
        LearntArea::new(&LearntPlaces::of(&presses(at)).unwrap())
    }

    fn contains(area: &LearntArea, x: f64, y: f64) -> bool {
        area.is_near([x, y], Some(0.0))
    }

    #[test]
    fn an_area_is_the_hull_and_half_a_step_beyond() {
        let mut grid = Vec::new();
        for x in 0..3 {
            for y in 0..4 {
                grid.push([10.0 * f64::from(x), 10.0 * f64::from(y)]);
            }
        }
        let area = area(&grid);
        assert_eq!(area.margin_mm, 5.0);
        let corners = [[0.0, 0.0], [20.0, 0.0], [20.0, 30.0], [0.0, 30.0]];
        assert_eq!(area.corners_mm, corners);
        assert!(contains(&area, 5.0, 25.0) && contains(&area, -3.0, 32.0));
        assert!(contains(&area, 24.9, 15.0) && !contains(&area, 25.1, 15.0));
        let at = [26.9, 15.0];
        assert!(area.is_near(at, Some(2.0)) && !area.is_near(at, Some(1.8)));
        assert!(area.is_near(at, None) && !area.is_near([30.1, 15.0], None));
        // Around the corner, the distance counts.
        assert!(!contains(&area, 24.0, 34.0));
    }

    #[test]
    fn few_presses_span_a_line_or_a_point() {
        let line = area(&[[0.0, 0.0], [4.0, 0.0], [8.0, 0.0]]);
        assert!(contains(&line, 2.0, 1.9) && !contains(&line, 2.0, 2.1));
        let one = area(&[[1.0, 2.0]]);
        assert!(contains(&one, 1.0, 2.0) && !contains(&one, 1.1, 2.0));
        assert!(LearntPlaces::of(&[]).is_none());
    }
}
