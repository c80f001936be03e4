//! The skin's outline: a square with chamfered right corners and rounded left corners.
//!
//! Source of the shape and numbers: the public analysis code's outline (100 x 100 mm about (10, 2), chamfer
//! 20 mm at the two right corners, radius 25 mm at the two left ones). With true arcs its area is
//! 9331.75 mm²; the paper's 9328 mm² comes from a coarser polygon of the same outline (0.04 % smaller).

use serde::{Deserialize, Serialize};
use skinrig_settings::{Choice, Collector, Field, Settings, Shape};

use crate::frame::Point2;

/// A rectangle whose right corners (larger x) are chamfered and whose left corners are rounded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Settings)]
#[settings(name = "outline", finish = Self::corners_fit)]
pub struct SkinOutline {
    /// Middle of the rectangle.
    pub centre: Point2,
    /// Full extent along x.
    #[setting(above = 0.0, max = 1000.0)]
    pub width_mm: f64,
    /// Full extent along y.
    #[setting(above = 0.0, max = 1000.0)]
    pub height_mm: f64,
    /// Length cut from each side at the two right corners.
    #[setting(default = "0 mm", max = 1000.0)]
    pub chamfer_mm: f64,
    /// Radius of the two left corners.
    #[setting(default = "0 mm", max = 1000.0)]
    pub radius_mm: f64,
}

/// A predefined outline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Choice)]
enum KnownOutline {
    /// The published skin: 100 x 100 mm about (10, 2) mm, right corners chamfered by 20 mm, left corners rounded with 25 mm.
    Paper,
}

/// An outline in a file: the word `paper`, or a mapping.
pub const OUTLINE_SHAPE: Shape = Shape::WordOr(KnownOutline::WORDS, SkinOutline::TABLE);

impl SkinOutline {
    /// Reads an [`OUTLINE_SHAPE`].
    pub fn read(field: &Field, out: &mut Collector) -> Option<Self> {
        match field.as_word().and_then(KnownOutline::from_word) {
            Some(KnownOutline::Paper) => Some(Self::PAPER),
            None => Self::from_mapping(field, out),
        }
    }

    fn corners_fit(self, field: &Field, out: &mut Collector) -> Option<Self> {
        let half_mm = self.width_mm.min(self.height_mm) / 2.0;
        for (key, value_mm) in [("chamfer", self.chamfer_mm), ("radius", self.radius_mm)] {
            if value_mm > half_mm {
                let at = field.at(key);
                out.error(
                    at.span,
                    at.path.as_str(),
                    "the corner is larger than half the skin",
                )
                .expected(format!("at most {half_mm} mm, half of the shorter side"))
                .found(format!("{value_mm} mm"));
            }
        }
        Some(self)
    }
}

impl SkinOutline {
    /// The published skin.
    pub const PAPER: Self = Self {
        centre: Point2::new(10.0, 2.0),
        width_mm: 100.0,
        height_mm: 100.0,
        chamfer_mm: 20.0,
        radius_mm: 25.0,
    };

    /// Signed distance-like clearance of `p` from the outline in mm: positive inside. Inside the outline it
    /// is the exact distance to the nearest edge or arc; outside only its sign is meaningful. Negative infinity
    /// for a point with a NaN coordinate, which counts as outside.
    #[must_use]
    pub fn clearance_mm(&self, p: Point2) -> f64 {
        if p.x_mm.is_nan() || p.y_mm.is_nan() {
            return f64::NEG_INFINITY; // the minima below would ignore it
        }
        let (hx, hy) = (self.width_mm / 2.0, self.height_mm / 2.0);
        let x = p.x_mm - self.centre.x_mm;
        let y = (p.y_mm - self.centre.y_mm).abs(); // the outline is symmetric in y
        let mut clearance = (hx - x).min(hx + x).min(hy - y);
        // Chamfer from (hx - c, hy) to (hx, hy - c): the half plane x + y <= hx + hy - c.
        clearance = clearance.min((hx + hy - self.chamfer_mm - x - y) / std::f64::consts::SQRT_2);
        // Arc about (-hx + r, hy - r), only in its own corner.
        let (dx, dy) = (x - (self.radius_mm - hx), y - (hy - self.radius_mm));
        if dx < 0.0 && dy > 0.0 {
            clearance = clearance.min(self.radius_mm - libm::hypot(dx, dy));
        }
        clearance
    }

    /// True for points inside or on the outline.
    #[must_use]
    pub fn contains(&self, p: Point2) -> bool {
        self.clearance_mm(p) >= 0.0
    }

    /// True for points inside or on the enclosing rectangle; the published code's test of "inside".
    #[must_use]
    pub fn box_contains(&self, p: Point2) -> bool {
        (p.x_mm - self.centre.x_mm).abs() <= self.width_mm / 2.0
            && (p.y_mm - self.centre.y_mm).abs() <= self.height_mm / 2.0
    }

    /// Length of the enclosing rectangle's diagonal, mm.
    #[must_use]
    pub fn diagonal_mm(&self) -> f64 {
        libm::hypot(self.width_mm, self.height_mm)
    }

    /// Exact area in mm².
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        let corner = (1.0 - std::f64::consts::FRAC_PI_4) * self.radius_mm * self.radius_mm;
        self.width_mm * self.height_mm - self.chamfer_mm * self.chamfer_mm - 2.0 * corner
    }

    /// The outline as a closed polygon (first point not repeated), counter-clockwise, each arc in
    /// `arc_segments` (at least 1) pieces.
    #[must_use]
    pub fn polygon(&self, arc_segments: u32) -> Vec<Point2> {
        let n = arc_segments.max(1);
        let (hx, hy) = (self.width_mm / 2.0, self.height_mm / 2.0);
        let (c, r) = (self.chamfer_mm, self.radius_mm);
        let mut points = vec![(hx - c, -hy), (hx, -hy + c), (hx, hy - c), (hx - c, hy)];
        let arc = |cx: f64, cy: f64, from: f64| {
            (0..=n).map(move |k| {
                let a = (from + 90.0 * f64::from(k) / f64::from(n)).to_radians();
                (cx + r * libm::cos(a), cy + r * libm::sin(a))
            })
        };
        points.extend(arc(-hx + r, hy - r, 90.0));
        points.extend(arc(-hx + r, -hy + r, 180.0));
        points
            .into_iter()
            .map(|(x, y)| Point2::new(x + self.centre.x_mm, y + self.centre.y_mm))
            .collect()
    }
}

/// Area of a simple polygon in mm² (shoelace formula), positive for either orientation.
#[must_use]
pub fn polygon_area_mm2(points: &[Point2]) -> f64 {
    let twice: f64 = points
        .iter()
        .zip(points.iter().cycle().skip(1))
        .map(|(a, b)| a.x_mm * b.y_mm - b.x_mm * a.y_mm)
        .sum();
    twice.abs() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_is_the_published_one() {
        let polygon = SkinOutline::PAPER.polygon(18);
        assert!((polygon_area_mm2(&polygon) / 9328.12 - 1.0).abs() < 4e-4);
        assert!((SkinOutline::PAPER.area_mm2() - 9331.75).abs() < 0.005);
        assert!((polygon_area_mm2(&SkinOutline::PAPER.polygon(4000)) - 9331.75).abs() < 0.005);
    }

    #[test]
    fn corners_of_the_box_are_outside_the_outline() {
        let skin = SkinOutline::PAPER;
        for (x, y) in [
            (60.0, 52.0),
            (60.0, -48.0),
            (-40.0, 52.0),
            (-40.0, -48.0),
            (51.0, 51.9),
        ] {
            assert!(skin.box_contains(Point2::new(x, y)));
            assert!(!skin.contains(Point2::new(x, y)), "({x}, {y})");
        }
        for p in skin.polygon(7) {
            assert!(skin.clearance_mm(p).abs() < 1e-9);
        }
        assert!((skin.clearance_mm(skin.centre) - 50.0).abs() < 1e-12);
        assert!((skin.clearance_mm(Point2::new(50.0, 42.0)) - 0.0).abs() < 1e-12); // middle of the chamfer
    }
}
