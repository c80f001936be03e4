//! The skin's surroundings: outline, margin and keep-out areas, and distances to them.

use serde::{Deserialize, Serialize};
use skinrig_model::{Point2, SkinOutline};

/// The skin's outline and keep-outs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Surroundings {
    /// The skin's outline.
    pub outline: SkinOutline,
    /// Every press stays at least this far inside the outline, mm.
    pub margin_mm: f64,
    /// Areas that the tip must not enter.
    pub keep_outs: Vec<KeepOut>,
}

impl Surroundings {
    /// An outline without margin and keep-outs.
    #[must_use]
    pub const fn of(outline: SkinOutline) -> Self {
        Self {
            outline,
            margin_mm: 0.0,
            keep_outs: Vec::new(),
        }
    }
}

/// An area that the tip must not enter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct KeepOut {
    /// Name of the obstacle.
    pub name: String,
    /// The area.
    pub area: Area,
    /// The tip stays at least this far away, mm.
    pub margin_mm: f64,
    /// Travel at or above this height may pass over, mm; nothing passes over when absent.
    pub height_mm: Option<f64>,
}

impl KeepOut {
    /// How far from the area a motion from `a` to `b` stays whose lowest point is at `lowest_mm`, when that is too close:
    /// not more than the margin, and not above the height. `slack_mm` is taken off both.
    #[must_use]
    pub fn too_close_mm(&self, a: Point2, b: Point2, lowest_mm: f64, slack_mm: f64) -> Option<f64> {
        let passes = |h: f64| lowest_mm >= h + self.margin_mm - slack_mm;
        if self.height_mm.is_some_and(passes) {
            return None;
        }
        let distance_mm = self.area.distance_mm(a, b);
        let least_mm = (self.margin_mm - slack_mm).max(0.0);
        (distance_mm.is_nan() || distance_mm <= least_mm).then_some(distance_mm)
    }
}

/// A shape in the skin's plane, mm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Area {
    /// A circle.
    Circle {
        /// Its centre.
        centre: Point2,
        /// Its radius, mm.
        radius_mm: f64,
    },
    /// A closed polygon by its corners in order, at least 3; rectangles too.
    Polygon(Vec<Point2>),
}

impl Area {
    /// Distance of the segment from `a` to `b` to the area in mm; 0 when they touch or overlap.
    #[must_use]
    pub fn distance_mm(&self, a: Point2, b: Point2) -> f64 {
        match self {
            Self::Circle { centre, radius_mm } => {
                (point_to_segment(*centre, a, b) - radius_mm).max(0.0)
            }
            Self::Polygon(corners) => {
                if contains(corners, a) || contains(corners, b) {
                    return 0.0;
                }
                sides(corners)
                    .map(|(c, d)| segment_to_segment(a, b, c, d))
                    .fold(f64::INFINITY, f64::min)
            }
        }
    }
}

/// The sides of a closed polygon.
fn sides(corners: &[Point2]) -> impl Iterator<Item = (Point2, Point2)> {
    corners
        .iter()
        .copied()
        .zip(corners.iter().copied().cycle().skip(1))
}

/// True for points inside the polygon (even-odd rule).
fn contains(corners: &[Point2], p: Point2) -> bool {
    sides(corners)
        .filter(|(a, b)| {
            (a.y_mm > p.y_mm) != (b.y_mm > p.y_mm)
                && p.x_mm < (b.x_mm - a.x_mm) * (p.y_mm - a.y_mm) / (b.y_mm - a.y_mm) + a.x_mm
        })
        .count()
        % 2
        == 1
}

/// Distance of `p` to the segment from `a` to `b`, mm.
pub(crate) fn point_to_segment(p: Point2, a: Point2, b: Point2) -> f64 {
    let (dx, dy) = (b.x_mm - a.x_mm, b.y_mm - a.y_mm);
    let length2 = dx * dx + dy * dy;
    let t = if length2 > 0.0 {
        (((p.x_mm - a.x_mm) * dx + (p.y_mm - a.y_mm) * dy) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    p.distance_mm(Point2::new(a.x_mm + t * dx, a.y_mm + t * dy))
}

/// Distance of two segments, mm; 0 when they cross.
fn segment_to_segment(a: Point2, b: Point2, c: Point2, d: Point2) -> f64 {
    let side = |p: Point2, q: Point2, r: Point2| {
        (q.x_mm - p.x_mm) * (r.y_mm - p.y_mm) - (q.y_mm - p.y_mm) * (r.x_mm - p.x_mm)
    };
    if side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0 {
        return 0.0;
    }
    point_to_segment(a, c, d)
        .min(point_to_segment(b, c, d))
        .min(point_to_segment(c, a, b))
        .min(point_to_segment(d, a, b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn square() -> Area {
        Area::Polygon(vec![
            Point2::new(0.0, 0.0),
            Point2::new(2.0, 0.0),
            Point2::new(2.0, 2.0),
            Point2::new(0.0, 2.0),
        ])
    }

    #[test]
    fn segments_that_pass_through_touch() {
        let p = Point2::new;
        assert_eq!(square().distance_mm(p(-5.0, 1.0), p(5.0, 1.0)), 0.0);
        assert_eq!(square().distance_mm(p(1.0, 1.0), p(1.0, 1.0)), 0.0);
        assert_eq!(square().distance_mm(p(5.0, 1.0), p(5.0, 9.0)), 3.0);
        let circle = Area::Circle {
            centre: p(0.0, 0.0),
            radius_mm: 1.0,
        };
        assert_eq!(circle.distance_mm(p(-5.0, 3.0), p(5.0, 3.0)), 2.0);
        assert_eq!(circle.distance_mm(p(-5.0, 0.5), p(5.0, 0.5)), 0.0);
    }

    proptest! {
        /// The distance to a segment is the least distance to points along it.
        #[test]
        fn distance_agrees_with_sampling(ax in -5.0f64..5.0, ay in -5.0f64..5.0, bx in -5.0f64..5.0, by in -5.0f64..5.0) {
            let (a, b) = (Point2::new(ax, ay), Point2::new(bx, by));
            for area in [square(), Area::Circle { centre: Point2::new(1.0, 1.0), radius_mm: 1.5 }] {
                let exact = area.distance_mm(a, b);
                let sampled = (0..=2000)
                    .map(|k| {
                        let t = f64::from(k) / 2000.0;
                        let p = Point2::new(ax + t * (bx - ax), ay + t * (by - ay));
                        area.distance_mm(p, p)
                    })
                    .fold(f64::INFINITY, f64::min);
                prop_assert!(exact <= sampled + 1e-9 && sampled - exact < 0.01, "{exact} {sampled}");
            }
        }
    }
}
