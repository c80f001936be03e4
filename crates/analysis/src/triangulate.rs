//! Intersection of two viewing rays: closed form, typed outcomes.

use skinrig_model::{Point2, SkinOutline, StereoGeometry};

use crate::result::LocationOutcome;

/// Rays with a smaller sine of their angle are parallel. At the skin's size the intersection would be tens of thousands of
/// kilometres away, or pure rounding error.
pub const PARALLEL_SINE: f64 = 1e-9;

/// Intersection of the two lines along the rays, without any validation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intersection {
    /// Position, mm. Infinite or NaN for parallel lines.
    pub at: Point2,
    /// Distance from each camera along its ray, mm; negative behind the camera.
    pub range_mm: [f64; 2],
    /// Sine of the angle from ray 1 to ray 2 (counter-clockwise positive).
    pub sine: f64,
}

/// Intersects the rays at these viewing angles (degrees, clockwise from each camera's axis, skew included).
///
/// With unit directions d1, d2 and w = p2 - p1: `s = d1 x d2`, `r1 = (w x d2) / s`, `r2 = (w x d1) / s`,
/// `X = p1 + r1 d1` (elementary; the published method solves the same equations iteratively). X is
/// evaluated from the nearer camera, which keeps the rounding error proportional to the shorter range.
#[must_use]
pub fn intersect(geometry: &StereoGeometry, angles_deg: [f64; 2]) -> Intersection {
    let [one, two] = geometry.cameras;
    intersect_rays(
        [one.position, two.position],
        [one.direction(angles_deg[0]), two.direction(angles_deg[1])],
    )
}

/// [`intersect`] for rays from `positions` along unit `directions`.
pub(crate) fn intersect_rays(positions: [Point2; 2], directions: [[f64; 2]; 2]) -> Intersection {
    let ([one, two], [d1, d2]) = (positions, directions);
    let w = [two.x_mm - one.x_mm, two.y_mm - one.y_mm];
    let sine = cross(d1, d2);
    let (r1, r2) = (cross(w, d2) / sine, cross(w, d1) / sine);
    let (from, d, r) = if r1.abs() <= r2.abs() {
        (one, d1, r1)
    } else {
        (two, d2, r2)
    };
    Intersection {
        at: Point2::new(from.x_mm + r * d[0], from.y_mm + r * d[1]),
        range_mm: [r1, r2],
        sine,
    }
}

/// Locates a press from the two viewing angles; NaN is a missing view. Rays that meet at no finite position give no location
/// either.
#[must_use]
pub fn locate_angles(
    geometry: &StereoGeometry,
    outline: &SkinOutline,
    angles_deg: [f64; 2],
) -> LocationOutcome {
    if !angles_deg.iter().all(|a| a.is_finite()) {
        return LocationOutcome::Missing;
    }
    let Intersection { at, range_mm, sine } = intersect(geometry, angles_deg);
    if !sine.is_finite() {
        LocationOutcome::Missing // a camera without a direction: it is at the point it aims at
    } else if sine.abs() < PARALLEL_SINE {
        LocationOutcome::Parallel { sine }
    } else if range_mm.iter().any(|r| *r < 0.0) {
        LocationOutcome::Behind { sine }
    } else if !(at.x_mm.is_finite() && at.y_mm.is_finite()) {
        LocationOutcome::Missing
    } else if outline.contains(at) {
        LocationOutcome::Located { at, sine }
    } else {
        LocationOutcome::Outside { at, sine }
    }
}

/// Locates a press from the two centroid columns (px); `None` or NaN is a missing view.
#[must_use]
pub fn locate(
    geometry: &StereoGeometry,
    outline: &SkinOutline,
    columns: [Option<f64>; 2],
) -> LocationOutcome {
    let [Some(u1), Some(u2)] = columns else {
        return LocationOutcome::Missing;
    };
    let [one, two] = &geometry.cameras;
    let angles = [one.angle_of_column_deg(u1), two.angle_of_column_deg(u2)];
    locate_angles(geometry, outline, angles)
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
