//! Areas: skin, seen by both cameras, probed; effective taxels.
//!
//! A camera sees the wedge between the viewing angles of its first and last column (0 and 640), clipped to the outline. A
//! location represents a square cell around it with the median neighbour distance as its side, so that a regular grid is
//! covered exactly once. Arcs of the outline are polygons of [`ARC_SEGMENTS`] segments each: 0.006 mm² less than the true
//! area of the published skin.

mod cells;
mod clip;

use skinrig_model::skin::polygon_area_mm2;
use skinrig_model::{CameraModel, Point2, PressRole, Verdict};

pub use cells::{neighbour_distance_mm, probed_area_mm2};

use crate::result::{Analysis, Coverage, Estimate, PressResult};

/// Segments per arc of the outline for computing areas.
pub const ARC_SEGMENTS: u32 = 256;
/// Segments per arc of polygons for drawing: 0.01 mm from the arc.
const DRAWN_ARC_SEGMENTS: u32 = 24;
/// Columns at the borders of the sensor, px.
const BORDER_COLUMNS: [f64; 2] = [0.0, skinrig_model::SENSOR_WIDTH as f64];

/// Areas and taxels of an analysed session; `None` if a camera has no direction (it is at the point it aims at).
///
/// The probed area is that of the locations whose scored presses are in the RMSE: each a cell as large as the distance between
/// neighbours among all pressed locations, those of calibration presses and of failed ones too.
#[must_use]
pub fn coverage(analysis: &Analysis) -> Option<Coverage> {
    let outline = &analysis.rig.outline;
    let cameras = &analysis.geometry.cameras;
    let fields_of_view = |arc_segments: u32| {
        let skin = outline.polygon(arc_segments);
        let views = [
            field_of_view(&cameras[0], &skin)?,
            field_of_view(&cameras[1], &skin)?,
        ];
        let overlap = overlap(&views);
        Some((views, overlap))
    };
    let (_, exact) = fields_of_view(ARC_SEGMENTS)?;
    let (views, overlap) = fields_of_view(DRAWN_ARC_SEGMENTS)?;
    let (pressed, _) = distinct_places(analysis, is_used);
    let cell_mm = neighbour_distance_mm(&pressed);
    let (places, locations) = distinct_places(analysis, PressResult::is_in_headline);
    let skin_mm2 = outline.area_mm2();
    let probed_mm2 = cell_mm
        .filter(|_| !places.is_empty())
        .map(|side| probed_area_mm2(outline, &places, side));
    let rmse_mm = analysis.scored.rmse_mm;
    Some(Coverage {
        skin_mm2,
        seen_by_both_mm2: exact.iter().map(|p| polygon_area_mm2(p)).sum(),
        probed_mm2,
        cell_mm,
        locations,
        places,
        views,
        overlap,
        taxels_skin: taxels(Some(skin_mm2), &rmse_mm),
        taxels_probed: taxels(probed_mm2, &rmse_mm),
    })
}

/// Part of the convex polygon `within` that `camera` sees, as convex pieces: a single one if the field of view is below
/// 180°, none if it sees nothing. `None` if the camera has no direction.
#[must_use]
pub fn field_of_view(camera: &CameraModel, within: &[Point2]) -> Option<Vec<Vec<Point2>>> {
    let [first, last] = BORDER_COLUMNS.map(|u| camera.angle_of_column_deg(u));
    let span = last - first;
    if !span.is_finite() || camera.direction(first).iter().any(|d| !d.is_finite()) {
        return None;
    }
    if span >= 360.0 {
        return Some(vec![within.to_vec()]);
    }
    if span <= 0.0 {
        return Some(Vec::new());
    }
    let count = (span / 180.0).floor() as u32 + 1;
    let edge = |i: u32| camera.direction(first + span * f64::from(i) / f64::from(count));
    let pieces = (0..count).map(|i| {
        // Angles grow clockwise: right of the first edge, left of the second.
        let ([ax, ay], [bx, by]) = (edge(i), edge(i + 1));
        let right = clip::half_plane(within, camera.position, [ay, -ax]);
        clip::half_plane(&right, camera.position, [-by, bx])
    });
    Some(pieces.filter(|p| p.len() > 2).collect())
}

/// Overlap of the pieces of both views, as convex pieces.
#[must_use]
pub fn overlap(views: &[Vec<Vec<Point2>>; 2]) -> Vec<Vec<Point2>> {
    let [first, second] = views;
    let pairs = first
        .iter()
        .flat_map(|a| second.iter().map(move |b| clip::convex(a, b)));
    pairs.filter(|p| p.len() > 2).collect()
}

/// Number of circles of radius RMSE that fill an area: area / (pi RMSE²), the paper's effective taxels. The interval is that
/// of the RMSE, inverted. No value without an area or with an RMSE of 0.
#[must_use]
pub fn taxels(area_mm2: Option<f64>, rmse_mm: &Estimate) -> Estimate {
    let of = |radius: Option<f64>| {
        let radius = radius.filter(|r| *r > 0.0)?;
        Some(area_mm2? / (std::f64::consts::PI * radius * radius))
    };
    Estimate {
        value: of(rmse_mm.value),
        low: of(rmse_mm.high),
        high: of(rmse_mm.low),
        n: rmse_mm.n,
    }
}

/// True for a press that was made and that neither the journal nor an operator excludes.
fn is_used(p: &PressResult) -> bool {
    let used = p.verdict != Verdict::Excluded || p.rule().is_some_and(|rule| rule.is_on_data());
    p.role != PressRole::Sync && p.verdict != Verdict::Missed && used
}

/// Distinct planned positions of some presses, and the number of their locations.
fn distinct_places(analysis: &Analysis, of: fn(&PressResult) -> bool) -> (Vec<Point2>, u32) {
    let probed = analysis.presses.iter().filter(|p| of(p));
    let mut locations: Vec<(u32, Point2)> =
        probed.map(|p| (p.location.index(), p.planned)).collect();
    locations.sort_by_key(|l| l.0);
    locations.dedup_by_key(|l| l.0);
    let count = locations.len() as u32;
    let mut places: Vec<Point2> = locations.into_iter().map(|l| l.1).collect();
    places.retain(|p| p.x_mm.is_finite() && p.y_mm.is_finite());
    places.sort_by(|a, b| (a.x_mm.total_cmp(&b.x_mm)).then(a.y_mm.total_cmp(&b.y_mm)));
    places.dedup();
    (places, count)
}
